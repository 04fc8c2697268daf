"""The true front of power against one criterion, by epsilon-constraint: least power for each demanded value of the criterion."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from compare.questions.pareto.competing import REWARD, CompetingObjective, rewarding
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.optima.continuation import Continuation, find_cheapest_feasible
from nlp_gait.backends.solve import make_solution, solve
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
# Planned at least: IPOPT's functions are worth compiling.
SOLVES = 200


@dataclass(frozen=True, kw_only=True)
class FrontPoint:
    """A point of the front.

    Attributes:
        demanded: least value of the criterion that was demanded.
        value: exact value of the criterion, at least that.
        power_W: exact power.
        price: slope of the front, from the multiplier of the demand [W per unit of the criterion]; NaN if the solver gives none.
        violation: exact total violation.
        x: (n,) as plain numbers.
    """

    demanded: float
    value: float
    power_W: float
    price: float = 0.0
    violation: float
    x: tuple[float, ...]


def pareto_front(
    problem: GaitProblem,
    criterion: CompetingObjective,
    *,
    points: int = 40,
    starts: int = 5,
    seed: int = 0,
    solver: Solver | None = None,
    progress: Progress = ignore_progress,
) -> list[FrontPoint]:
    """Points of the front, by rising criterion, about evenly spaced along it.

    Half of the points are spaced evenly over the criterion, from its value at the least power to the end of the front; the
    others halve the longest gaps between neighbours, measured with both ranges as 1. Each is solved from both neighbours and
    at some from random starts, and the whole is then walked there and back, so that a better local optimum found anywhere
    spreads as far as it is the better one.

    Args:
        problem: with its other limits; its demand on the criterion is dropped.
        criterion: what is traded against power.
        points: at least five.
        starts: random starts at both ends and at every third point.
        seed: of the random starts.
        solver: with its settings; None for IPOPT with its defaults.
        progress: told what is done.

    Raises:
        InputError: too few points, or the least power or the largest criterion cannot be found.
    """
    if points < LEAST_POINTS:
        raise InputError(f"points must be at least {LEAST_POINTS}, got {points}")
    free = criterion.freed(problem)
    low, high = front_ends(free, criterion, starts, seed, solver)
    ready = (solver or IpoptSettings()).prepare(free, SOLVES)
    rng = np.random.default_rng(seed)
    found: dict[float, list[Outcome]] = {}

    def attempt(at: float, x0: Array) -> None:
        limited = criterion.limited(free, at)
        found.setdefault(at, []).append(ready.run(limited, np.clip(x0, limited.lower, limited.upper)))

    def walk(order: Sequence[float], path_seed: int) -> None:
        path = Continuation(starts=starts, seed=path_seed, solver=solver, solves=SOLVES)
        for at in order:
            limited = criterion.limited(free, at)
            found[at] = found.get(at, []) + path.run(limited, found.get(at, []))
            progress(f"{criterion.name} {at:.5g} {criterion.unit}")

    grid = np.linspace(low.value, high.value, max(LEAST_POINTS, points // 2)).tolist()
    for point, at in ((low, grid[0]), (high, grid[-1])):
        attempt(at, np.array(point.x))
    for at in grid[::CHECK_EVERY]:
        for _ in range(starts):
            attempt(at, criterion.limited(free, at).start_point(rng))
        progress(f"random starts at {criterion.name} {at:.5g} {criterion.unit}")
    walk(grid, seed)
    walk(grid[::-1], seed + 1)
    while len(found) < points:
        at, neighbours = _largest_gap(found)
        limited = criterion.limited(free, at)
        warm = (ready.run_from(limited, end) for end in neighbours)
        found[at] = [*found.get(at, []), *(end for end in warm if end is not None)]
        if find_cheapest_feasible(found[at]) is None:
            for end in neighbours:
                attempt(at, end.x)
        progress(f"{criterion.name} {at:.5g} {criterion.unit}")
    walk(sorted(found), seed)
    walk(sorted(found, reverse=True), seed + 1)
    return nondominated([p for at in sorted(found) if (p := _point(free, criterion, at, found[at])) is not None])


def point_at(
    free: GaitProblem, criterion: CompetingObjective, least: float, x0: Array, solver: Solver | None = None
) -> FrontPoint | None:
    """Least power with the criterion at least at a value, from a start (n,); None if it does not converge."""
    limited = criterion.limited(free, least)
    x0 = np.clip(x0, limited.lower, limited.upper)
    return _point(free, criterion, least, [(solver or IpoptSettings()).prepare(free, SOLVES).run(limited, x0)])


def nondominated(points: Sequence[FrontPoint]) -> list[FrontPoint]:
    """Points by rising criterion without those that another equals or betters in both; of equals the first stays."""
    kept: list[FrontPoint] = []
    for point in sorted(points, key=lambda p: (-p.value, p.power_W)):
        if not kept or point.power_W < kept[-1].power_W:
            kept.append(point)
    return kept[::-1]


def front_ends(
    free: GaitProblem, criterion: CompetingObjective, starts: int, seed: int, solver: Solver | None = None
) -> tuple[FrontPoint, FrontPoint]:
    """Least power, and the point beyond which the criterion costs too much."""
    solution = solve(free, starts=2 * starts, seed=seed, solver=solver)
    if not solution.converged:
        raise InputError(f"{free.name} has no front: {solution.status}")
    low = _reached(free, criterion, solution)
    reward = LARGEST_TRADE_OFF * low.power_W / abs(low.value)
    ending = rewarding(free, criterion).with_values(**{REWARD: reward})
    solution = solve(ending, starts=2 * starts, seed=seed, solver=solver)
    if not solution.converged:
        raise InputError(f"the largest {criterion.name} of {free.name} was not found: {solution.status}")
    return low, _reached(free, criterion, solution)


def _largest_gap(found: dict[float, list[Outcome]]) -> tuple[float, list[Outcome]]:
    """Middle of the longest gap between neighbours that were solved, and their ends."""
    solved = [(at, end) for at in sorted(found) if (end := find_cheapest_feasible(found[at])) is not None]
    at = np.array([a for a, _ in solved])
    cost = np.array([end.cost for _, end in solved])
    lengths = np.hypot(np.diff(at) / np.ptp(at), np.diff(cost) / np.ptp(cost))
    k = int(np.argmax(lengths))
    return float((at[k] + at[k + 1]) / 2), [solved[k][1], solved[k + 1][1]]


def _point(
    free: GaitProblem, criterion: CompetingObjective, at: float, outcomes: Sequence[Outcome]
) -> FrontPoint | None:
    solution = make_solution(criterion.limited(free, at), outcomes)
    best = find_cheapest_feasible(outcomes)
    if best is None:
        return None
    price = math.nan if best.guess is None else criterion.price(solution)
    return replace(_reached(free, criterion, solution), demanded=at, price=price)


def _reached(free: GaitProblem, criterion: CompetingObjective, solution: Solution) -> FrontPoint:
    """A solution as a point that demands what it reaches."""
    x = free.check_x(solution.x)
    value = criterion.value(free, x)
    return FrontPoint(
        demanded=value,
        value=value,
        power_W=build_exact_model(free).at(x, free.p).cost,
        violation=solution.violation,
        x=tuple(x.tolist()),
    )
