"""A gait that keeps its limits for all masses and soles within their tolerances.

The uncertain robots form a box: each mass within a share, each sole within a distance. A scenario problem over a few of its
corners is solved; then the corner that is worst for each limit, by the rows' derivatives, is added, until no corner found in this
way violates a limit or costs more.

Source:
    Mutapcic, Boyd (2009), Cutting-set methods for robust convex optimization with pessimizing oracles, used here on a problem
    that is not convex: the corners are evaluated exactly, but it is not proven that the box contains no worse point.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import reduce

import numpy as np

from compare.questions.perturbed_problem import get_quantity, perturb_robot
from compare.questions.question import Work
from nlp_gait.backends.exact import ExactValues, build_exact_model
from nlp_gait.backends.solve import solve
from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.assembly import Assembly, Point
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE, Solution
from nlp_gait.symbolic.nonsmooth import Nonsmooth

# Number of limits for which a round looks for the worst corner: those violated most, one of each group of rows.
CORNERS_IN_ROUND = 3
# A corner costs more than the worst known one if it does so by more than this share.
COST_TOLERANCE = 1e-6
ROUNDS = 8

Box = Mapping[str, float]  # half-widths by the robot's quantity
Corner = tuple[int, ...]  # +1 or -1 for each quantity of the box


def make_worst_case(scenarios: Sequence[GaitProblem]) -> GaitProblem:
    """Return the problem of one x that satisfies all scenarios and minimises the objective of the worst one.

    Limits, bounds and parameter values are those of the first scenario.

    Raises:
        InputError: no scenarios, different variables or parameters, or an objective that is maximised.
    """
    if not scenarios:
        raise InputError("a worst case requires at least one scenario")
    first = scenarios[0]
    for other in scenarios:
        if other.names != first.names or [q.name for q in other.parameters] != [q.name for q in first.parameters]:
            raise InputError(f"all scenarios of {first.name!r} must have the same variables and parameters")
        if other.objective.sense != "minimise":
            raise InputError(
                f"a worst case requires an objective that is minimised; {first.objective.name} is maximised"
            )

    def change(assembly: Assembly, point: Point, ops: Nonsmooth) -> Assembly:
        parts = [assembly, *(scenario.assemble(point, ops) for scenario in scenarios[1:])]
        constraints = tuple(
            replace(constraint, name=f"{constraint.name}@{k}" if k else constraint.name)
            for k, assembly in enumerate(parts)
            for constraint in assembly.constraints
        )
        # As the minimum of the negatives: its lifted variable is an epigraph variable for any objectives.
        worst = -reduce(ops.min, [-assembly.objective for assembly in parts])
        indexes = {
            f"{name}@{k}" if k else name: v for k, assembly in enumerate(parts) for name, v in assembly.indexes.items()
        }
        return Assembly(objective=worst, constraints=constraints, indexes=indexes)

    worst = first.derive(title=f"{first.title}, worst of {len(scenarios)} scenarios", change=change)
    return replace(worst, refine=None)  # refining the first scenario only would be another problem


@dataclass(frozen=True, kw_only=True)
class Worst:
    """The worst case of a gait over a set of robots."""

    violation: float  #: largest of one row, in its unit; 0 if all limits are satisfied
    row: str  #: its name
    unit: str  #: of the violation
    corner: Mapping[str, float]  #: changes of the quantities of that robot
    power_W: float  #: largest over all robots of the set


class RobotBox:
    """A problem with all robots in a box and the same limits; each is built once."""

    def __init__(self, nominal: GaitProblem, box: Box) -> None:
        self.nominal, self._box = nominal, box
        self.centre: Corner = (0,) * len(box)
        self._problems: dict[Corner, GaitProblem] = {self.centre: nominal}

    def changes(self, corner: Corner) -> dict[str, float]:
        """Return the changes of the robot's quantities, shares of masses and lengths."""
        return {name: sign * half for (name, half), sign in zip(self._box.items(), corner, strict=True) if sign}

    def evaluate(self, corner: Corner, x: Array) -> ExactValues:
        """Return the exact values at x (n,) with a corner's robot."""
        return build_exact_model(self.problem(corner)).at(x, self.nominal.p)

    def problem(self, corner: Corner) -> GaitProblem:
        """Return the problem with a corner's robot."""
        if corner not in self._problems:
            values = {name: get_quantity(self.nominal, name) + by for name, by in self.changes(corner).items()}
            self._problems[corner] = perturb_robot(self.nominal, values)
        return self._problems[corner]

    def find_worst(self, x: Array, corners: Sequence[Corner]) -> Worst:
        """Return the worst case of a gait over some corners; rows are compared in units of their scales."""
        model = build_exact_model(self.nominal)
        largest = (-np.inf, 0, 0.0, self.centre)
        power = -np.inf
        for corner in corners:
            values = self.evaluate(corner, x)
            power = max(power, values.cost)
            violations = np.maximum(np.maximum(values.lower - values.g, values.g - values.upper), 0.0)
            i = int(np.argmax(violations / model.row_scales))
            largest = max(largest, (float(violations[i] / model.row_scales[i]), i, float(violations[i]), corner))
        _, i, violation, corner = largest
        return Worst(
            violation=violation,
            row=model.row_names[i] if violation > 0.0 else "",
            unit=model.row_units[i],
            corner=self.changes(corner),
            power_W=power,
        )

    def find_worse_corners(self, x: Array, known: Sequence[Corner], cost: float) -> list[Corner]:
        """Return new corners that violate a limit at x or cost more than is known; found by the rows' derivatives."""
        model, count = build_exact_model(self.nominal), len(self._box)
        centre = self.evaluate(self.centre, x)
        slopes, cost_slopes = [], []
        for k in range(count):
            high, low = (self.evaluate(tuple(sign * (i == k) for i in range(count)), x) for sign in (1, -1))
            slopes.append((high.g - low.g) / 2)
            cost_slopes.append((high.cost - low.cost) / 2)
        slope = np.array(slopes)
        reach = np.abs(slope).sum(axis=0)
        below = (centre.lower - centre.g + reach) / model.row_scales
        above = (centre.g + reach - centre.upper) / model.row_scales
        candidates = [tuple(np.where(np.array(cost_slopes) >= 0.0, 1, -1).tolist())]
        groups: set[str] = set()
        for i in np.argsort(-np.maximum(below, above)):
            group = model.row_names[i].partition("[")[0]
            if max(below[i], above[i]) <= FEASIBILITY_TOLERANCE or len(groups) == CORNERS_IN_ROUND:
                break
            if group not in groups:
                groups.add(group)
                sign = 1 if above[i] >= below[i] else -1
                candidates.append(tuple(np.where(sign * slope[:, i] >= 0.0, 1, -1).tolist()))
        return [corner for corner in dict.fromkeys(candidates) if corner not in known and self._worse(corner, x, cost)]

    def _worse(self, corner: Corner, x: Array, cost: float) -> bool:
        values = self.evaluate(corner, x)
        return not values.violation <= FEASIBILITY_TOLERANCE or values.cost > cost * (1.0 + COST_TOLERANCE)


@dataclass(frozen=True, kw_only=True)
class RobustGait:
    """A gait that keeps its limits in a box of robots."""

    name: str  #: of the box, in words
    box: Mapping[str, float]  #: half-widths by quantity
    #: changes of the robots in the scenario problem; the first is the nominal one, without changes
    corners: tuple[Mapping[str, float], ...]
    robots: tuple[str, ...]  #: their names
    rounds: int  #: number of searches for worse corners
    settled: bool  #: the last round found no worse corner
    status: str  #: of the last solution
    nominal_x: Mapping[str, float]  #: optimum for the nominal robot alone
    nominal_W: float  #: its power there
    nominal_worst: Worst  #: its worst case over the corners
    x: Mapping[str, float]  #: robust optimum
    power_W: float  #: with the nominal robot
    worst_W: float  #: in the worst corner: the minimised objective
    worst: Worst  #: its worst case over the corners
    random_worst: Worst  #: over random corners that are not in the scenario problem


def make_boxes(problem: GaitProblem, mass: float, sole_m: float) -> dict[str, Box]:
    """Return boxes of growing uncertainty by name: soles alone, with the whole robot's mass, with each link's mass.

    The tolerance of masses is a share, that of the soles' position is in metres; raises InputError without a robot.
    """
    robot = problem.display.robot
    if robot is None:
        raise InputError(f"problem {problem.name!r} has no robot that could be uncertain; the NAO problems have one")
    soles = {"sole_x_m": sole_m, "sole_y_m": sole_m}
    return {
        "soles": soles,
        "soles, mass of the whole": {"mass": mass, **soles},
        "soles, mass of each link": {**{f"{link}.mass": mass for link in robot.links}, **soles},
    }


def solve_robust(
    problem: GaitProblem, name: str, box: Box, *, starts: int, seed: int, samples: int, work: Work
) -> RobustGait:
    """Return the robust optimum over a box of robots; raises InputError if there is no feasible gait.

    Starts and seed are those of the nominal problem; so many samples are random corners on which the optimum is evaluated.
    """
    robots, solver = RobotBox(problem, box), work.solver()
    work.progress(f"{name}: nominal optimum")
    nominal = _require(solve(problem, starts=starts, seed=seed, solver=solver), "the nominal problem")
    nominal_x = x = problem.check_x(nominal.x)
    corners: list[Corner] = [robots.centre]
    robust, settled, rounds = nominal, False, 0
    for rounds in range(1, ROUNDS + 1):
        work.progress(f"{name}: round {rounds}, {len(corners)} scenarios")
        worse = robots.find_worse_corners(x, corners, float(robust.objective))
        if not worse:
            settled = True
            break
        corners += worse
        robust = solve(make_worst_case([robots.problem(corner) for corner in corners]), x0=x, solver=solver)
        _require(robust, f"{len(corners)} scenarios together ({name})")
        x = problem.check_x(robust.x)
    rng = np.random.default_rng(seed)
    random = [tuple(rng.choice((-1, 1), len(box)).tolist()) for _ in range(samples)]
    work.progress(f"{name}: {samples} random corners")
    return RobustGait(
        name=name,
        box=dict(box),
        corners=tuple(robots.changes(corner) for corner in corners),
        robots=tuple(str(robots.problem(corner).options["robot"]) for corner in corners),
        rounds=rounds,
        settled=settled,
        status=robust.status,
        nominal_x=nominal.x,
        nominal_W=nominal.objective,
        nominal_worst=robots.find_worst(nominal_x, corners),
        x=robust.x,
        power_W=robots.evaluate(robots.centre, x).cost,
        worst_W=robust.objective,
        worst=robots.find_worst(x, corners),
        random_worst=robots.find_worst(x, random or corners),
    )


def _require(solution: Solution, what: str) -> Solution:
    if not solution.converged:
        raise InputError(f"{what}: {solution.status}; a smaller uncertainty or more --starts may help")
    return solution
