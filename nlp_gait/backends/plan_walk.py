"""Plan a whole walk from standing to standing, and say what stops it."""

import math
import re
import tomllib
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.solve import solve
from nlp_gait.backends.solvers.ipopt import BARRIERS, Ipopt, IpoptSettings
from nlp_gait.errors import InputError, check_count
from nlp_gait.files import replace_nan, write_json
from nlp_gait.formulation import Array, GaitProblem, Result, load
from nlp_gait.formulation.solution import ConstraintValue, Solution
from nlp_gait.gaits.biped.body import TIMED_UNITS, Body
from nlp_gait.gaits.biped.cycle import STEP
from nlp_gait.gaits.biped.footholds import list_arc, list_swings, parse_footholds, read_footholds
from nlp_gait.gaits.biped.support_phases import compute_sole_margins
from nlp_gait.gaits.biped.walk import name_speed
from nlp_gait.gaits.biped.walk_sections import GREATEST_SPEED, HALF_STEPS, LEAST_SPEED, start_from_cycle
from nlp_gait.gaits.humanoid.body import Humanoid, make_humanoid
from nlp_gait.gaits.humanoid.turning import list_turn
from nlp_gait.gaits.nao.body import make_nao
from nlp_gait.interrupts import Progress, ignore_progress
from nlp_gait.robots.loading import hold_robots

AT_BOUND = 1e-4  # share of a variable's range
# Default least margins of the ZMP in a plan, along and across, as shares of a sole's length and width; chosen by energy against
# the push survived, see ``benchmarks/humanoids.py``.
MARGINS = (0.06, 0.08)
# Intervals of each phase: of the first grid, of the grid on which energies are evaluated, and the most that are planned. The
# planned energy on a grid must be as near to the fine one as this, otherwise the next grid is finer by a factor.
FIRST_GRID, FINE_GRID, LAST_GRID = 10, 120, 40
ENERGY_ERROR, FINER = 0.01, 1.5
# On the rows that are near their bounds at the start an iteration takes a third of the time.
SOLVER = IpoptSettings(few_rows=True, within=0.3)
MANY_SOLVES = 10  # compiled functions pay, because they suit walks of any length and speed
LEAST_MARGINS = ("dbm_x_min_limit_m", "dbm_y_min_limit_m")  # ends of the names of parameters
MARGIN_WORDS = {
    f"dbm_{axis}{end}": f"{kind} margin {word}"
    for axis, word in (("x", "along"), ("y", "across"))
    for end, kind in (("", "least"), ("_mean", "mean"))
}
REMEDIES = files(__package__).joinpath("walk_remedies.toml")
SENTENCES: Mapping[str, Mapping[str, Any]] = tomllib.loads(REMEDIES.read_text(encoding="utf-8"))


@dataclass(frozen=True, kw_only=True, eq=False)
class WalkPlan:
    """A planned walk."""

    solution: Solution  #: of the solver, judged by the exact functions
    distance_m: float  #: that the feet advance
    duration_s: float  #: of the whole walk
    energy_J: float  #: of the whole walk, on a fine grid

    @property
    def steps(self) -> int:
        """Swings of a foot, both half steps included."""
        return int(self.solution.problem.options["steps"])

    @property
    def feasible(self) -> bool:
        """Whether all limits are satisfied."""
        return self.solution.feasible

    @property
    def obstacles(self) -> tuple[str, ...]:
        """Sentences that name step, constraint, amount and remedy of the largest violations; empty if feasible."""
        if self.feasible:
            return ()
        rows = dict.fromkeys(describe_violation(row, self.steps) for row in self.solution.worst_violations[:5])
        return (*rows, *describe_own_bounds(self.solution.problem, self.solution.x))

    @property
    def active_margins(self) -> tuple[str, ...]:
        """Sentences that name the balance margins at their limits and their prices, the dearest first."""
        prices: dict[tuple[str, str], float] = {}
        bounds: dict[tuple[str, str], float] = {}
        for active in self.solution.active_constraints:
            where, stem = find_place(active.name.partition("[")[0], self.steps)
            if stem in MARGIN_WORDS:
                prices[where, stem] = prices.get((where, stem), 0.0) + abs(active.price)
                bounds[where, stem] = active.bound
        ordered = sorted(prices, key=lambda key: -prices[key])
        return tuple(
            f"{where}: {MARGIN_WORDS[stem]} of {1e3 * bounds[where, stem]:.1f} mm, {prices[where, stem] / 1e3:.2g} J/m per mm"
            for where, stem in ordered
        )

    @property
    def result(self) -> Result:
        """The walk as a result, for signals, simulation and export."""
        return Result(problem=self.solution.problem, x=self.solution.best.x)

    def to_json(self) -> dict[str, Any]:
        """Return the plan as plain data, from which ``load_result`` reads it."""
        names = ("feasible", "energy_J", "distance_m", "duration_s", "steps")
        numbers = {name: getattr(self, name) for name in names}
        sentences = {name: list(getattr(self, name)) for name in ("obstacles", "active_margins")}
        return {**self.solution.to_json(), **numbers, **sentences}

    def save(self, path: str | Path) -> None:
        """Write the plan to a JSON file for ``nlp-gait simulate`` and ``export``; raises OutputError."""
        write_json(Path(path), replace_nan(self.to_json()))


@dataclass(frozen=True, kw_only=True)
class WalkSettings:
    """How a walk is planned, wherever it leads."""

    intervals: int | None = None  #: of each phase; None for as many as the energy needs
    limits: str = ""  #: added to every phase: names separated by commas, see ``nlp_gait.limits``
    values: Mapping[str, float] = field(default_factory=dict)  #: parameters and bounds of the problem, by name
    #: Least margins of the ZMP along and across, as shares of a sole; None for ``MARGINS``, or the problem's own if larger
    margins: Sequence[float] | None = None
    starts: int = 3  #: most start points, until one converges
    progress: Progress = ignore_progress  #: receives a line about each start

    @property
    def options(self) -> dict[str, Any]:
        """Those that are options of the problem."""
        return {"intervals": self.intervals or FIRST_GRID, "limits": self.limits}

    def apply(self, problem: GaitProblem) -> GaitProblem:
        """Return a walk with these margins and values; raises InputError for a margin that no sole has."""
        shares = MARGINS if self.margins is None else self.margins
        if len(shares) != 2 or not all(0.0 <= share < 0.5 for share in shares):
            raise InputError(f"margins must be two shares of a sole, each from 0 to less than 0.5, got {shares}")
        along, across = shares
        assert problem.display.robot is not None
        least_m = compute_sole_margins(problem.display.robot.feet["left"], (along, across))
        ends = list(zip(LEAST_MARGINS, least_m, strict=True))
        values = {name: m for name in problem.parameter_values for end, m in ends if name.endswith(end)}
        if self.margins is None:
            values = {name: max(value, problem.value(name)) for name, value in values.items()}
        return problem.with_values(**{**values, **self.values})


@hold_robots()
def plan_walk(
    robot: str = "nao-v5",
    steps: int | None = None,
    *,
    speed_m_s: float | None = None,
    distance_m: float | None = None,
    slope_deg: float = 0.0,
    settings: WalkSettings = WalkSettings(),
) -> WalkPlan:
    """Plan a straight walk from standing to standing with least energy per metre.

    If left and right of a humanoid differ, its steps have the usual length and are planned one by one.

    Args:
        robot: name or file; robots of NAO's build swing their arms and have closed-form legs, others are planned as humanoids.
        steps: swings of a foot, both half steps included; None for 10, or for as many as the distance takes.
        speed_m_s: of the inner steps; None for the cheapest.
        distance_m: that the feet advance; None for the cheapest steps.
        slope_deg: by which the ground rises forward; the distance is along it.
        settings: of the planning.

    Raises InputError for a number that is not allowed or does not fit the others; GaitError for a robot that cannot walk.
    """
    _check_positive(speed_m_s=speed_m_s, distance_m=distance_m)
    body = make_body(robot)
    if isinstance(body, Humanoid) and body.biped.differences and not slope_deg:  # every step has its own side
        if steps is None and distance_m is not None:
            steps = max(HALF_STEPS, round(distance_m / body.step_length_m) + 1)
        speeds = () if speed_m_s is None else (speed_m_s,)
        return plan_route(robot, steps=steps, distance_m=distance_m, speeds_m_s=speeds, settings=settings)
    walk = f"{body.family}-walk"
    count = 10 if steps is None else check_count("steps", steps, at_least=HALF_STEPS)
    problem = load(walk, robot=robot, steps=count, slope_deg=slope_deg, **settings.options)
    if steps is None and distance_m is not None:
        natural = problem.by_name(problem.start_point(np.random.default_rng(0)))[STEP]
        count = max(HALF_STEPS, round(distance_m / natural) + 1)
        problem = load(walk, **{**problem.options, "steps": count})
    problem = _fix_speed(settings.apply(problem), speed_m_s)
    if distance_m is not None:
        problem = _fix_step(problem, distance_m)
    cycle = None if body.closed_form else _load_cycle(problem, None)
    return _solve(problem, cycle, settings)


@hold_robots()
def plan_climb(
    robot: str, stairs: str, *, speed_m_s: float | None = None, settings: WalkSettings = WalkSettings()
) -> WalkPlan:
    """Plan a walk up ``RISExRUN:N``, N treads of these sizes [m]: every step climbs one, and the walk ends on the last.

    The other arguments and errors are those of ``plan_walk``; every robot is planned as a humanoid.
    """
    _check_positive(speed_m_s=speed_m_s)
    sizes = re.fullmatch(r"(\d*\.?\d+)x(\d*\.?\d+):(\d{1,3})", stairs)
    if sizes is None or int(sizes[3]) < 1:
        raise InputError(f"stairs must be RISExRUN:N with rise and run in metres, such as 0.03x0.24:3, got {stairs!r}")
    flight = {"stair_rise_m": float(sizes[1]), "stair_run_m": float(sizes[2])}
    problem = load("humanoid-walk", robot=robot, steps=int(sizes[3]) + 1, **flight, **settings.options)
    problem = _fix_speed(settings.apply(problem), speed_m_s)
    return _solve(problem, _load_cycle(problem, None), settings)


@hold_robots()
def plan_route(
    robot: str,
    *,
    footholds: str | Path | None = None,
    turn_deg: float = 0.0,
    steps: int | None = None,
    distance_m: float | None = None,
    speeds_m_s: Sequence[float] = (),
    settings: WalkSettings = WalkSettings(),
) -> WalkPlan:
    """Plan a walk whose steps differ, on a level floor: along footholds, a turn, or a line with several speeds.

    Args:
        robot: as in ``plan_walk``.
        footholds: CSV file with columns ``x_m,y_m,z_m,yaw_deg``, where the right foot, the left foot and so on land; it
            determines steps, distance and turn.
        turn_deg: by which the walk turns to the left, along an arc; without steps, by 15 degrees each, and without a distance
            by two thirds of the robot's usual step length each.
        steps: as in ``plan_walk``.
        distance_m: that the feet advance; None for the robot's usual steps.
        speeds_m_s: of the inner steps one by one, between which it changes evenly if there are more steps; all have the same
            length.
        settings: of the planning.

    Raises as ``plan_walk``.
    """
    _check_positive(distance_m=distance_m)
    if footholds is not None and (turn_deg, steps, distance_m) != (0.0, None, None):
        raise InputError("footholds determine steps, distance and turn; leave out steps, distance and turn")
    body = make_body(robot)
    if steps is None and len(speeds_m_s):
        steps = len(speeds_m_s) + HALF_STEPS
    if footholds is not None:
        text = read_footholds(footholds)
    elif turn_deg and isinstance(body, Humanoid):
        text = list_turn(body, turn_deg, steps, distance_m)
    else:
        count = check_count("steps", steps or 10, at_least=HALF_STEPS)
        text = list_arc(turn_deg, count, distance_m or body.step_length_m * (count - 1), body.feet_y)
    places = parse_footholds(text)
    problem = load(f"{body.family}-walk", robot=robot, steps=len(places), footholds=text, **settings.options)
    problem = settings.apply(problem.with_values(**list_speeds(speeds_m_s, len(places))))
    swings = list_swings(places, body.feet_y)
    step_m = sum(landed.x for _, landed in swings) / max(len(swings) - 1, 1)
    return _solve(problem, _load_cycle(problem, step_m), settings)


def list_speeds(speeds_m_s: Sequence[float], steps: int) -> dict[str, float]:
    """Return the limits of the inner steps' speeds by name: evenly between those that are given."""
    if not len(speeds_m_s):
        return {}
    speeds, count = np.asarray(speeds_m_s, dtype=float), steps - HALF_STEPS
    if not (np.isfinite(speeds) & (speeds > 0.0)).all():
        raise InputError(f"speeds_m_s must be finite numbers > 0, got {list(speeds_m_s)}")
    if len(speeds) > count:
        raise InputError(
            f"{len(speeds)} speeds are given, and a walk of {steps} steps has {count} inner ones; plan more steps"
        )
    inner = np.interp(np.linspace(0.0, 1.0, count), np.linspace(0.0, 1.0, len(speeds)), speeds)
    return {name_speed(end, f"step{k}_"): v for k, v in enumerate(inner.tolist(), 2) for end in ("least", "greatest")}


def _check_positive(**values: float | None) -> None:
    for name, value in values.items():
        if value is not None and not (isinstance(value, (int, float)) and 0.0 < value < math.inf):
            raise InputError(f"{name} must be a finite number > 0, got {value!r}")


def make_body(robot: str) -> Body:
    """Return a robot as its walks take it: with closed-form legs where they fit, or any humanoid."""
    try:
        return make_nao(robot)
    except InputError:
        return make_humanoid(robot)


def _fix_speed(problem: GaitProblem, speed_m_s: float | None) -> GaitProblem:
    if speed_m_s is None:
        return problem
    if LEAST_SPEED not in problem.parameter_values:
        raise InputError(
            f"speed_m_s={speed_m_s:g} is that of the inner steps, and a walk of {HALF_STEPS} half steps has none; "
            "plan more steps, or leave the speed out"
        )
    return problem.with_values(**{LEAST_SPEED: speed_m_s, GREATEST_SPEED: speed_m_s})


def _fix_step(problem: GaitProblem, distance_m: float) -> GaitProblem:
    steps = int(problem.options["steps"])
    step_m, i = distance_m / (steps - 1), problem.names.index(STEP)
    least, most = float(problem.lower[i]), float(problem.upper[i])
    if not least <= step_m <= most:
        fewest, largest = math.ceil(distance_m / most) + 1, math.floor(distance_m / least) + 1
        remedy = f"use {fewest} to {largest} steps" if HALF_STEPS <= fewest <= largest else "choose another distance"
        raise InputError(
            f"{distance_m:g} m in {steps} steps needs steps of {step_m:.3g} m; they are {least:g} to {most:g} m long; {remedy}"
        )
    return problem.fix(**{STEP: step_m})


def _load_cycle(problem: GaitProblem, step_m: float | None) -> GaitProblem:
    """Return the cycle from whose gait a walk starts, with steps of a length [m] or, if that is fixed, of the walk's."""
    options = problem.options
    name = problem.name.replace("walk", "cycle")
    sides = {"alike": True} if "alike" in options else {}  # it is only where a solver starts
    cycle = load(name, robot=options["robot"], intervals=options["intervals"], **sides)
    if step_m is None and problem.value(f"{STEP}.lower") == problem.value(f"{STEP}.upper"):
        step_m = problem.value(f"{STEP}.lower")
    if step_m is None:
        return cycle
    least, most = (cycle.value(f"{STEP}.{end}") for end in ("lower", "upper"))
    return cycle.fix(**{STEP: min(max(step_m, least), most)})


def _solve(problem: GaitProblem, cycle: GaitProblem | None, settings: WalkSettings) -> WalkPlan:
    best: Solution | None = None
    for solution in _run_starts(problem, cycle, settings):
        if best is None or solution.best.rank < best.best.rank:
            best = solution
        if best.converged:
            break
    assert best is not None  # at least one start
    while settings.intervals is None and best.converged:
        finer = choose_finer_grid(best.problem, best.best.x, settings)
        if finer is None:
            break
        solution = solve(finer, x0=best.best.x, solver=SOLVER, workers=1)
        if not solution.feasible:
            break
        best = solution
    return WalkPlan(solution=best, **_evaluate(best.problem, best.best.x, FINE_GRID))


def choose_finer_grid(problem: GaitProblem, x: Array, settings: WalkSettings) -> GaitProblem | None:
    """Return a walk on the next finer grid, or None if its energy at x is right or its grid is the last."""
    intervals = int(problem.options["intervals"])
    coarse, fine = (_evaluate(problem, x, count)["energy_J"] for count in (intervals, FINE_GRID))
    error = abs(coarse / fine - 1.0)
    if error < ENERGY_ERROR or intervals >= LAST_GRID:
        return None
    more = min(LAST_GRID, math.ceil(FINER * intervals))
    settings.progress(f"{intervals} intervals of a phase: energy {error:.1%} off, now {more}")
    return load(problem.name, **{**problem.options, "intervals": more}).with_values(**problem.values)


def _evaluate(problem: GaitProblem, x: Array, intervals: int) -> dict[str, float]:
    """Return distance, duration and energy of a walk on a grid with at least ``intervals`` intervals a phase."""
    fine = problem.dense(math.ceil(intervals / int(problem.options["intervals"]))) or problem
    metrics = build_exact_model(fine).at(x, fine.p).metrics
    return {name: float(metrics[name]) for name in ("distance_m", "duration_s", "energy_J")}


def _run_starts(problem: GaitProblem, cycle: GaitProblem | None, settings: WalkSettings) -> Iterator[Solution]:
    """Solve a walk from start points, by each barrier, for which a cycle is solved first if it is given."""
    rng, solvers = np.random.default_rng(0), dict[str, Ipopt]()
    for k in range(check_count("starts", settings.starts)):
        x0: Array = np.clip(problem.start_point(rng), problem.lower, problem.upper)
        if cycle is not None:
            gait = solve(cycle, seed=k, workers=1)
            settings.progress(f"start {k + 1}, cycle: {gait.status}")
            x0 = start_from_cycle(problem, x0, gait.x, float(problem.options.get("stair_rise_m", 0.0)))
            if (
                k == 0 and settings.intervals is None and gait.converged
            ):  # before a library for the coarse grid is built
                problem = choose_finer_grid(problem, x0, settings) or problem
        for barrier in BARRIERS:
            if barrier not in solvers:  # the second one is rarely needed
                ipopt = replace(SOLVER, few_rows=barrier == BARRIERS[0], barrier=barrier)
                solvers[barrier] = ipopt.prepare(problem, solves=MANY_SOLVES)
            solution = solve(problem, x0=x0, solver=solvers[barrier], workers=1)
            settings.progress(f"start {k + 1}, {barrier} barrier: {solution.status}")
            yield solution


def describe_own_bounds(problem: GaitProblem, x: Mapping[str, float]) -> list[str]:
    """Return a sentence about the bounds on times and velocities that a gait reaches, which are not the robot's."""
    reached = [
        f"{variable.name}.{end}={bound:g}"
        for variable, low, high in zip(problem.variables, problem.lower, problem.upper, strict=True)
        for end, bound in (("lower", low), ("upper", high))
        if variable.unit in TIMED_UNITS and low < high and abs(x[variable.name] - bound) <= AT_BOUND * (high - low)
    ]
    if not reached:
        return []
    return [f"it reaches bounds of this package, not of the robot: {', '.join(reached)}; --set moves them"]


def find_place(name: str, steps: int) -> tuple[str, str]:
    """Return where in a walk of ``steps`` steps a row of that name is, and the rest of its name."""
    if step := re.match(r"step(\d+)_(ssp_|dsp_)?", name):  # of a walk whose steps differ
        support = {"ssp_": ", single support", "dsp_": ", double support"}.get(step[2], "")
        return f"step {step[1]}{support}", name.removeprefix(step[0])
    prefix = next(begin for begin in SENTENCES["places"] if name.startswith(begin))
    where = SENTENCES["places"][prefix].format(steps=steps, inner=f"steps 2 to {steps - 1}" if steps > 3 else "step 2")
    return where, name.removeprefix(prefix)


def describe_violation(row: ConstraintValue, steps: int) -> str:
    """Return a sentence about a violated row of a walk: step, constraint, amount and remedy."""
    where, name = find_place(row.name, steps)
    stem, _, label = name.partition("[")
    begin = next(begin for begin in SENTENCES["constraints"] if stem.startswith(begin))
    words, remedy = SENTENCES["constraints"][begin]
    if row.name.startswith("stand_"):
        remedy = SENTENCES["standing"].get(begin, remedy)
    owner = label.rstrip("]").split(",")[0].strip()
    what = f"{stem} {words}" if not owner or owner.isdigit() else f"{owner} {words}"
    return f"{where}: {what} by {row.violation:.3g} {row.unit} ({row.name}); {remedy}"
