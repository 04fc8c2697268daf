"""The true front of power against one criterion: least power for each demanded value of the criterion, and its knees."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from compare.questions.pareto.competing import REWARD, CompetingObjective, add_reward
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.solve import Continuation, find_cheapest_feasible, make_solution, solve
from nlp_gait.backends.solvers.ipopt import IpoptSettings
from nlp_gait.backends.solvers.solver import Solver
from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.solution import Outcome, Solution
from nlp_gait.progress import Progress, ignore_progress

# The front ends where another hundredth of the criterion would cost ten times the least power.
LARGEST_TRADE_OFF = 1000.0
LEAST_POINTS = 5
# Random starts are tried at every third point of the first, evenly spaced ones.
CHECK_EVERY = 3
# So many solves that compiling IPOPT's functions pays.
SOLVES = 200

# A bend is a knee if the front turns by this much [rad] within this part of its length, the ranges of both objectives being 1.
LEAST_TURN = np.pi / 12
WINDOW = 0.1


@dataclass(frozen=True, kw_only=True)
class FrontPoint:
    """A point of the front."""

    value: float  #: exact value of the criterion
    power_W: float  #: exact power
    #: slope of the front, from the multiplier of the demand [W per unit of the criterion]; NaN if the solver gives none
    price: float = 0.0
    violation: float  #: exact total violation
    x: tuple[float, ...]  #: (n,) as plain numbers


def solve_front(
    problem: GaitProblem,
    criterion: CompetingObjective,
    *,
    points: int = 40,
    starts: int = 5,
    seed: int = 0,
    solver: Solver | None = None,
    progress: Progress = ignore_progress,
    known: Sequence[float] = (),
) -> list[FrontPoint]:
    """Return points of the front, by rising criterion, about evenly spaced along it.

    Half of the points are spaced evenly over the criterion, from its value at the least power to the end of the front; the
    others halve the longest gaps between neighbours, measured with both ranges as 1. Each is solved from both neighbours, some
    also from random starts, and the whole front is then followed forwards and backwards, so that a better local optimum
    spreads as far as it is the better one. The problem keeps its other limits; its demand on the criterion is dropped. ``starts``
    counts the random starts at both ends and at every third point; the solver is IPOPT with its defaults if it is None. One
    more start is a point (n,) that is known to be good, from which the power at its own criterion is solved for.

    Raises:
        InputError: too few points, or the least power or the largest criterion cannot be found.
    """
    if points < LEAST_POINTS:
        raise InputError(f"points must be at least {LEAST_POINTS}, got {points}")
    problem = criterion.drop_demand(problem)
    low, high = _solve_ends(problem, criterion, starts, seed, solver)
    ready = (solver or IpoptSettings()).prepare(problem, SOLVES)
    rng = np.random.default_rng(seed)
    found: dict[float, list[Outcome]] = {}

    def attempt(at: float, x0: Array) -> None:
        limited = criterion.demand(problem, at)
        found.setdefault(at, []).append(ready.run(limited, np.clip(x0, limited.lower, limited.upper)))

    def follow(order: Sequence[float], path_seed: int) -> None:
        path = Continuation(starts=starts, seed=path_seed, solver=solver, solves=SOLVES)
        for at in order:
            limited = criterion.demand(problem, at)
            found[at] = found.get(at, []) + path.run(limited, found.get(at, []))
            progress(f"{criterion.name} {at:.5g} {criterion.unit}")

    grid = np.linspace(low.value, high.value, max(LEAST_POINTS, points // 2)).tolist()
    for point, at in ((low, grid[0]), (high, grid[-1])):
        attempt(at, np.array(point.x))
    if known:
        attempt(criterion.evaluate(problem, np.array(known)), np.array(known))
    for at in grid[::CHECK_EVERY]:
        for _ in range(starts):
            attempt(at, criterion.demand(problem, at).start_point(rng))
        progress(f"random starts at {criterion.name} {at:.5g} {criterion.unit}")
    follow(grid, seed)
    follow(grid[::-1], seed + 1)
    while len(found) < points:
        at, neighbours = _find_largest_gap(found)
        limited = criterion.demand(problem, at)
        warm = (ready.run_from(limited, end) for end in neighbours)
        found[at] = [*found.get(at, []), *(end for end in warm if end is not None)]
        if find_cheapest_feasible(found[at]) is None:
            for end in neighbours:
                attempt(at, end.x)
        progress(f"{criterion.name} {at:.5g} {criterion.unit}")
    follow(sorted(found), seed)
    follow(sorted(found, reverse=True), seed + 1)
    return select_front(
        [p for at in sorted(found) if (p := _make_point(problem, criterion, at, found[at])) is not None]
    )


def solve_point(
    problem: GaitProblem, criterion: CompetingObjective, least: float, x0: Array, solver: Solver | None = None
) -> FrontPoint | None:
    """Return the least power with the criterion at least at a value, from a start (n,); None if it does not converge."""
    limited = criterion.demand(problem, least)
    x0 = np.clip(x0, limited.lower, limited.upper)
    return _make_point(
        problem, criterion, least, [(solver or IpoptSettings()).prepare(problem, SOLVES).run(limited, x0)]
    )


def select_front(points: Iterable[FrontPoint]) -> list[FrontPoint]:
    """Return the points, by rising criterion, that no other point equals or betters in both; the first of equal ones stays."""
    kept: list[FrontPoint] = []
    for point in sorted(points, key=lambda p: (-p.value, p.power_W)):
        if not kept or point.power_W < kept[-1].power_W:
            kept.append(point)
    return kept[::-1]


def _solve_ends(
    problem: GaitProblem, criterion: CompetingObjective, starts: int, seed: int, solver: Solver | None
) -> tuple[FrontPoint, FrontPoint]:
    """Return the least power, and the point beyond which the criterion costs too much."""
    solution = solve(problem, starts=2 * starts, seed=seed, solver=solver)
    if not solution.converged:
        raise InputError(f"{problem.name} has no front: {solution.status}")
    low = _make_reached(problem, criterion, solution)
    reward = LARGEST_TRADE_OFF * abs(low.power_W / low.value)
    ending = add_reward(problem, criterion).with_values(**{REWARD: reward})
    solution = solve(ending, starts=2 * starts, seed=seed, solver=solver)
    if not solution.converged:
        raise InputError(f"the largest {criterion.name} of {problem.name} was not found: {solution.status}")
    return low, _make_reached(problem, criterion, solution)


def _find_largest_gap(found: dict[float, list[Outcome]]) -> tuple[float, list[Outcome]]:
    """Middle of the longest gap between solved neighbours, and their ends."""
    solved = [(at, end) for at in sorted(found) if (end := find_cheapest_feasible(found[at])) is not None]
    at = np.array([a for a, _ in solved])
    cost = np.array([end.cost for _, end in solved])
    lengths = np.hypot(np.diff(at) / np.ptp(at), np.diff(cost) / np.ptp(cost))
    k = int(np.argmax(lengths))
    return float((at[k] + at[k + 1]) / 2), [solved[k][1], solved[k + 1][1]]


def _make_point(
    problem: GaitProblem, criterion: CompetingObjective, at: float, outcomes: Sequence[Outcome]
) -> FrontPoint | None:
    solution = make_solution(criterion.demand(problem, at), outcomes)
    best = find_cheapest_feasible(outcomes)
    if best is None:
        return None
    price = math.nan if best.guess is None else criterion.compute_price(solution)
    return replace(_make_reached(problem, criterion, solution), price=price)


def _make_reached(problem: GaitProblem, criterion: CompetingObjective, solution: Solution) -> FrontPoint:
    x = problem.check_x(solution.x)
    return FrontPoint(
        value=criterion.evaluate(problem, x),
        power_W=build_exact_model(problem).at(x, problem.p).cost,
        violation=solution.best.violation,
        x=tuple(x.tolist()),
    )


@dataclass(frozen=True, kw_only=True)
class Knee:
    """A point at which the front bends away from the better values."""

    value: float  #: of the criterion
    power_W: float  #: there
    price_before: float  #: slope just below it [W per unit]
    price_after: float  #: slope just above it [W per unit]
    turn_deg: float  #: by how much the front turns around it, with both ranges as 1 [degree]


def find_knees(front: Sequence[FrontPoint]) -> tuple[Knee, ...]:
    """Return the knees of a front (at least three points, by rising criterion), by rising criterion.

    At a knee, the straight lines from the point a twentieth of the front's length before it and to the point as far behind it
    differ in direction by at least 15 degrees, towards higher prices, both ranges being 1; so a single inaccurate point makes
    no knee. Of those within a tenth of the length the sharpest counts. The prices come from the multipliers.
    """
    value, power = np.array([(p.value, p.power_W) for p in front]).T
    scaled = np.column_stack([(value - value[0]) / np.ptp(value), (power - power[0]) / np.ptp(power)])
    across, up = np.diff(scaled, axis=0).T
    along = np.concatenate([[0.0], np.cumsum(np.hypot(across, up))])
    half = WINDOW * along[-1] / 2

    def at(place: Array) -> Array:
        return np.column_stack([np.interp(place, along, column) for column in scaled.T])

    before, after = scaled - at(along - half), at(along + half) - scaled
    turns = np.arctan2(after[:, 1], after[:, 0]) - np.arctan2(before[:, 1], before[:, 0])
    turns[(along < half) | (along > along[-1] - half)] = 0.0
    knees = []
    while turns.max() >= LEAST_TURN:
        centre = int(np.argmax(turns))
        window = np.flatnonzero(np.abs(along - along[centre]) <= half)
        knees.append(
            Knee(
                value=front[centre].value,
                power_W=front[centre].power_W,
                price_before=front[max(0, window[0] - 1)].price,
                price_after=front[min(len(front) - 1, window[-1] + 1)].price,
                turn_deg=float(np.degrees(turns[centre])),
            )
        )
        turns[np.abs(along - along[centre]) <= 2 * half] = 0.0
    return tuple(sorted(knees, key=lambda knee: knee.value))
