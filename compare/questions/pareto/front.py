"""The true front of power against one criterion, both objectives of one problem: least power for each value, and its knees."""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from casadi import MX

from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.kernel.compiled import CompiledObjective
from nlp_gait.backends.solve import Continuation, find_cheapest_feasible, make_solution, solve
from nlp_gait.backends.solvers.ipopt import IpoptSettings
from nlp_gait.backends.solvers.solver import Solver
from nlp_gait.errors import InputError, unknown
from nlp_gait.formulation import Array, Assembly, GaitProblem, Objective, Parameter, Point
from nlp_gait.formulation.solution import Outcome, Solution
from nlp_gait.interrupts import Progress, ignore_progress
from nlp_gait.symbolic.nonsmooth import Nonsmooth

SPEED = "speed"
MARGINS = ("dbm_y_mean", "dbm_x_mean")
REWARD = "reward_W_per_unit"


@dataclass(frozen=True, kw_only=True)
class Margin:
    """A dynamic balance margin's mean over the samples, along x or across y."""

    name: str
    unit: str = "m"

    def drop_demand(self, problem: GaitProblem) -> GaitProblem:
        """Return the problem with the least demand: zero, which keeps the ZMP within the soles' box."""
        return self.demand(problem, 0.0)

    def demand(self, problem: GaitProblem, least: float) -> GaitProblem:
        """Return the problem with a least value."""
        return problem.with_values(**{f"{self.name}_limit_m": least})

    def evaluate(self, problem: GaitProblem, x: Array) -> float:
        """Return the exact value at x (n,)."""
        return build_exact_model(problem).at(x, problem.p).metrics[f"{self.name}_m"]

    def evaluate_many(self, objective: CompiledObjective, X: Array) -> Array:
        """Return the values (P,) of candidates (P, n)."""
        values: Array = objective.constraints(X)[:, objective.groups.index(self.name)]
        return values

    def express(self, point: Point, assembly: Assembly) -> MX:
        """Return a scalar for the assembly of a problem."""
        return assembly.group(self.name).value

    def compute_price(self, solution: Solution) -> float:
        """Return the change of the least power per unit of the demand [W/unit]."""
        return sum((a.price for a in solution.active_constraints if a.name.partition("[")[0] == self.name), 0.0)


@dataclass(frozen=True, kw_only=True)
class Speed:
    """Mean speed of the hip over the phase, with the methods of ``Margin``: its prescribed distance by its duration."""

    duration: str  #: variable that holds the phase's duration
    distance_m: float  #: of the hip along x
    name: str = SPEED
    unit: str = "m/s"

    def drop_demand(self, problem: GaitProblem) -> GaitProblem:
        return problem  # its bound on the duration demands no more speed than that

    def demand(self, problem: GaitProblem, least: float) -> GaitProblem:
        longest = max(problem.value(f"{self.duration}.lower"), self.distance_m / least)
        return problem.with_values(**{f"{self.duration}.upper": longest})

    def evaluate(self, problem: GaitProblem, x: Array) -> float:
        return self.distance_m / float(x[problem.variable_index(self.duration)])

    def evaluate_many(self, objective: CompiledObjective, X: Array) -> Array:
        return self.distance_m / X[:, objective.names.index(self.duration)]

    def express(self, point: Point, assembly: Assembly) -> MX:
        return self.distance_m / point[self.duration]

    def compute_price(self, solution: Solution) -> float:
        # dP/dv = dP/dT dT/dv with T = distance / v
        bound = f"bounds[{self.duration}]"
        per_second = sum(a.price for a in solution.active_constraints if a.name == bound and a.side == "upper")
        return -per_second * solution.x[self.duration] ** 2 / self.distance_m


CompetingObjective = Margin | Speed
"""A quantity to be maximised, whose least value can be demanded by a parameter."""


def make_competing_objective(name: str, problem: GaitProblem) -> CompetingObjective:
    """Return the objective of this name that a NAO phase trades against power.

    Raises:
        UnknownNameError: an unknown objective.
        InputError: the problem has no power, margins and duration to trade.
    """
    durations = problem.display.durations
    if problem.objective.name != "power" or len(durations) != 1 or problem.display.motion is None:
        raise InputError(f"{problem.name} has no power, balance and speed to trade; allowed are nao-ssp and nao-dsp")
    if name in MARGINS:
        return Margin(name=name)
    if name != SPEED:
        raise unknown("objective next to power", name, (*MARGINS, SPEED))
    middle = (problem.lower + problem.upper) / 2
    hip = problem.signals(middle).arrays["hip"]
    return Speed(duration=durations[0], distance_m=round(float(hip[-1, 0] - hip[0, 0]), 9))


def add_reward(problem: GaitProblem, criterion: CompetingObjective, reward: float) -> GaitProblem:
    """Return the problem that minimises power less a reward for the criterion [W per unit]."""

    def change(assembly: Assembly, point: Point, ops: Nonsmooth) -> Assembly:
        cost = assembly.objective - point[REWARD] * criterion.express(point, assembly)
        return replace(assembly, objective=cost)

    parameter = Parameter(
        name=REWARD, unit=f"W/({criterion.unit})", default=0.0, description=f"reward for {criterion.name}", minimum=0.0
    )
    return problem.derive(
        name=f"{problem.name}-{criterion.name}",
        objective=Objective(name="rewarded_power", unit="W"),
        parameters=(parameter,),
        change=change,
    ).with_values(**{REWARD: reward})


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


@dataclass(frozen=True, kw_only=True, eq=False)
class _Front:
    """A front in the making: the runs at each demanded value of the criterion."""

    problem: GaitProblem  #: without a demand on the criterion
    criterion: CompetingObjective
    starts: int  #: random starts where no neighbour helps
    solver: Solver
    progress: Progress
    runs: dict[float, list[Outcome]] = field(default_factory=dict)

    @cached_property
    def prepared(self) -> Solver:
        """The solver, ready for many solves."""
        return self.solver.prepare(self.problem, SOLVES)

    def limit(self, value: float) -> GaitProblem:
        """Return the problem that demands a value."""
        return self.criterion.demand(self.problem, value)

    def note(self, words: str, value: float) -> None:
        """Report what was solved at a value."""
        self.progress(f"{words}{self.criterion.name} {value:.5g} {self.criterion.unit}")

    def run(self, value: float, x0: Array) -> None:
        """Solve at a value from a start (n,)."""
        limited = self.limit(value)
        end = self.prepared.run(limited, np.clip(x0, limited.lower, limited.upper))
        self.runs.setdefault(value, []).append(end)

    def follow(self, values: Sequence[float], seed: int) -> None:
        """Solve at all values in this order, each from its neighbour."""
        path = Continuation(starts=self.starts, seed=seed, solver=self.solver, solves=SOLVES)
        for value in values:
            earlier = self.runs.get(value, [])
            self.runs[value] = earlier + path.run(self.limit(value), earlier)
            self.note("", value)

    def halve_longest_gap(self) -> None:
        """Solve in the middle of the longest gap between solved neighbours, both ranges being 1, from these neighbours."""
        ends = {value: find_cheapest_feasible(self.runs[value]) for value in sorted(self.runs)}
        solved = [(value, end) for value, end in ends.items() if end is not None]
        values, costs = np.array([(value, end.cost) for value, end in solved]).T
        k = int(np.argmax(np.hypot(np.diff(values) / np.ptp(values), np.diff(costs) / np.ptp(costs))))
        middle, neighbours = float((values[k] + values[k + 1]) / 2), [solved[k][1], solved[k + 1][1]]
        warm = (self.prepared.run_from(self.limit(middle), end) for end in neighbours)
        self.runs[middle] = [*self.runs.get(middle, []), *(end for end in warm if end is not None)]
        if find_cheapest_feasible(self.runs[middle]) is None:
            for end in neighbours:
                self.run(middle, end.x)
        self.note("", middle)

    def find_best(self, value: float) -> FrontPoint | None:
        """Return the best point at a value; None if no run converged there."""
        best = find_cheapest_feasible(self.runs[value])
        if best is None:
            return None
        solution = make_solution(self.limit(value), self.runs[value])
        price = math.nan if best.guess is None else self.criterion.compute_price(solution)
        return _make_point(self.problem, self.criterion, solution, price)


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
) -> tuple[FrontPoint, ...]:
    """Return points of the front, by rising criterion, about evenly spaced along it.

    Half of the points are spaced evenly over the criterion, from its value at the least power to the end of the front; the
    others halve the longest gaps between neighbours, measured with both ranges as 1. Each is solved from both neighbours, some
    also from random starts, and the whole front is then followed forwards and backwards, so that a better local optimum
    spreads as far as it is the better one. The problem keeps its other limits; its demand on the criterion is dropped.
    ``starts`` counts the random starts at both ends and at every third point; the solver is IPOPT with its defaults if it is
    None. One more start is a point (n,) that is known to be good, from which the power at its own criterion is solved for.

    Raises:
        InputError: too few points, or the least power or the largest criterion cannot be found.
    """
    if points < LEAST_POINTS:
        raise InputError(f"points must be at least {LEAST_POINTS}, got {points}")
    problem, solver = criterion.drop_demand(problem), solver or IpoptSettings()
    low, high = _solve_ends(problem, criterion, starts, seed, solver)
    front = _Front(problem=problem, criterion=criterion, starts=starts, solver=solver, progress=progress)
    grid = np.linspace(low.value, high.value, max(LEAST_POINTS, points // 2)).tolist()
    front.run(grid[0], np.array(low.x))
    front.run(grid[-1], np.array(high.x))
    if known:
        front.run(criterion.evaluate(problem, np.array(known)), np.array(known))
    rng = np.random.default_rng(seed)
    for value in grid[::CHECK_EVERY]:
        for _ in range(starts):
            front.run(value, front.limit(value).start_point(rng))
        front.note("random starts at ", value)
    front.follow(grid, seed)
    front.follow(grid[::-1], seed + 1)
    while len(front.runs) < points:
        front.halve_longest_gap()
    front.follow(sorted(front.runs), seed)
    front.follow(sorted(front.runs, reverse=True), seed + 1)
    return select_front(filter(None, map(front.find_best, sorted(front.runs))))


def select_front(points: Iterable[FrontPoint]) -> tuple[FrontPoint, ...]:
    """Return the points, by rising criterion, that no other point equals or betters in both; the first of equal ones stays."""
    kept: list[FrontPoint] = []
    for point in sorted(points, key=lambda p: (-p.value, p.power_W)):
        if not kept or point.power_W < kept[-1].power_W:
            kept.append(point)
    return tuple(kept[::-1])


def _solve_ends(
    problem: GaitProblem, criterion: CompetingObjective, starts: int, seed: int, solver: Solver
) -> tuple[FrontPoint, FrontPoint]:
    """Return the least power, and the point beyond which the criterion costs too much."""
    solution = solve(problem, starts=2 * starts, seed=seed, solver=solver)
    if not solution.converged:
        raise InputError(f"{problem.name} has no front: {solution.status}")
    low = _make_point(problem, criterion, solution)
    ending = add_reward(problem, criterion, LARGEST_TRADE_OFF * abs(low.power_W / low.value))
    solution = solve(ending, starts=2 * starts, seed=seed, solver=solver)
    if not solution.converged:
        raise InputError(f"the largest {criterion.name} of {problem.name} was not found: {solution.status}")
    return low, _make_point(problem, criterion, solution)


def _make_point(
    problem: GaitProblem, criterion: CompetingObjective, solution: Solution, price: float = 0.0
) -> FrontPoint:
    x = problem.check_x(solution.x)
    return FrontPoint(
        value=criterion.evaluate(problem, x),
        power_W=build_exact_model(problem).at(x, problem.p).cost,
        price=price,
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
