"""Plan a whole walk from standing to standing, and say what stops it."""

import math
import re
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from typing import Any

import numpy as np

from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.solve import solve
from nlp_gait.backends.solvers.ipopt import IpoptSettings
from nlp_gait.errors import InputError, check_count
from nlp_gait.files import replace_nan, write_json
from nlp_gait.formulation import Array, GaitProblem, Result, load
from nlp_gait.formulation.solution import ConstraintValue, Solution
from nlp_gait.gaits.biped.body import TIMED_UNITS, Body
from nlp_gait.gaits.biped.cycle_motion import STEP
from nlp_gait.gaits.biped.footholds import list_arc, list_swings, parse_footholds, read_footholds
from nlp_gait.gaits.biped.footstep_walk import name_speed
from nlp_gait.gaits.biped.walk_parts import GREATEST_SPEED, HALF_STEPS, LEAST_SPEED, start_from_cycle
from nlp_gait.gaits.humanoid.body import Humanoid, make_humanoid
from nlp_gait.gaits.humanoid.turning import list_turn
from nlp_gait.gaits.nao.body import load_nao, make_nao
from nlp_gait.progress import Progress, ignore_progress

AT_BOUND = 1e-4  # share of a variable's range
MANY_SOLVES = 10  # compiled functions pay, because they suit walks of any length and speed
REMEDIES = files(__package__).joinpath("walk_remedies.toml")
SENTENCES: Mapping[str, Mapping[str, Any]] = tomllib.loads(REMEDIES.read_text(encoding="utf-8"))


@dataclass(frozen=True, kw_only=True, eq=False)
class WalkPlan:
    """A planned walk."""

    problem: GaitProblem  #: with its values
    solution: Solution  #: of the solver, judged by the exact functions
    steps: int  #: swings of a foot, both half steps included
    distance_m: float  #: that the feet advance
    duration_s: float  #: of the whole walk
    energy_J: float  #: of the whole walk

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
        return (*rows, *describe_own_bounds(self.problem, self.solution.x))

    @property
    def result(self) -> Result:
        """The walk as a result, for signals, simulation and export."""
        return Result(problem=self.problem, x=self.problem.check_x(self.solution.x))

    def to_json(self) -> dict[str, Any]:
        """Return the plan as plain data, from which ``load_result`` reads it."""
        own = {name: getattr(self, name) for name in ("feasible", "energy_J", "distance_m", "duration_s", "steps")}
        return {**self.solution.to_json(), **own, "obstacles": list(self.obstacles)}

    def save(self, path: str | Path) -> None:
        """Write the plan to a JSON file for ``nlp-gait simulate`` and ``export``; raises OutputError."""
        write_json(Path(path), replace_nan(self.to_json()))


def plan_walk(
    robot: str = "nao-v5",
    steps: int | None = None,
    *,
    speed_m_s: float | None = None,
    speeds_m_s: Sequence[float] = (),
    distance_m: float | None = None,
    slope_deg: float = 0.0,
    stairs: str = "",
    turn_deg: float = 0.0,
    footholds: str | Path | None = None,
    intervals: int = 10,
    values: dict[str, float] | None = None,
    starts: int = 3,
    progress: Progress = ignore_progress,
) -> WalkPlan:
    """Plan a walk from standing to standing with least energy per metre.

    Args:
        robot: name or file; robots of NAO's build swing their arms and have closed-form legs, others are planned as humanoids.
        steps: swings of a foot, both half steps included; None for 10, or for as many as the distance takes.
        speed_m_s: of the inner steps; None for the cheapest.
        speeds_m_s: of the inner steps one by one, between which it changes evenly if there are more steps; all have the same
            length, without a distance the robot's usual one.
        distance_m: that the feet advance; None for the cheapest steps.
        slope_deg: by which the ground rises forward; the distance is along it.
        stairs: ``RISExRUN:N``, a flight of N treads of these sizes [m]; every step climbs one, and the walk ends on the last.
        turn_deg: by which the walk turns to the left, along an arc; without steps, by 15 degrees each, and without a distance
            by two thirds of the robot's usual step length each.
        footholds: CSV file with columns ``x_m,y_m,z_m,yaw_deg``, where the right foot, the left foot and so on land.
        intervals: of each phase.
        values: parameters and bounds of ``nao-walk`` or ``humanoid-walk``, by name.
        starts: most start points, until one converges.
        progress: receives a line about each start.

    Raises InputError for a number that is not allowed or does not fit the others; GaitError for a robot that cannot walk.
    """
    for name, value in (("speed_m_s", speed_m_s), ("distance_m", distance_m)):
        if value is not None and not (isinstance(value, (int, float)) and 0.0 < value < math.inf):
            raise InputError(f"{name} must be a finite number > 0, got {value!r}")
    name, ahead = find_walk(robot), None
    more: dict[str, str | float] = {}
    if stairs:
        if (steps, distance_m) != (None, None):
            raise InputError("stairs determine steps and distance; leave out steps and distance_m")
        name, (rise, run, treads) = "humanoid-walk", _parse_stairs(stairs)
        steps, more = treads + 1, {"stair_rise_m": rise, "stair_run_m": run}
    if turn_deg or footholds is not None or len(speeds_m_s):
        if (speed_m_s, stairs, slope_deg) != (None, "", 0.0):
            raise InputError(
                "a walk whose steps differ has no single speed and is on a level floor; leave out speed_m_s, slope and stairs"
            )
        if footholds is not None and (turn_deg, steps, distance_m) != (0.0, None, None):
            raise InputError("footholds determine steps, distance and turn; leave out steps, distance and turn")
        if steps is None and len(speeds_m_s):
            steps = len(speeds_m_s) + HALF_STEPS
        text, ahead = _list_footholds(robot, footholds, turn_deg, steps, distance_m)
        steps, distance_m, more = text.count(";") + 1, None, {"footholds": text}
        values = {**list_speeds(speeds_m_s, steps), **(values or {})}
    count = 10 if steps is None else check_count("steps", steps, at_least=HALF_STEPS)
    problem = load(name, robot=robot, steps=count, intervals=intervals, slope_deg=slope_deg, **more)
    if steps is None and distance_m is not None:
        natural = problem.by_name(problem.start_point(np.random.default_rng(0)))[STEP]
        count = max(HALF_STEPS, round(distance_m / natural) + 1)
        problem = load(name, **{**problem.options, "steps": count})
    problem = problem.with_values(**(values or {}))
    if speed_m_s is not None:
        if LEAST_SPEED not in problem.parameter_values:
            raise InputError(
                f"speed_m_s={speed_m_s:g} is that of the inner steps, and a walk of {HALF_STEPS} half steps has none; "
                "plan more steps, or leave the speed out"
            )
        problem = problem.with_values(**{LEAST_SPEED: speed_m_s, GREATEST_SPEED: speed_m_s})
    if distance_m is not None:
        problem = _fix_step(problem, distance_m)
    cycle = None
    if name != "nao-walk" or more:
        cycle = load(name.replace("walk", "cycle"), robot=robot, intervals=intervals)
    if ahead is None and problem.value(f"{STEP}.lower") == problem.value(f"{STEP}.upper"):
        ahead = problem.value(f"{STEP}.lower")
    if cycle is not None and ahead is not None:
        least, most = (cycle.value(f"{STEP}.{end}") for end in ("lower", "upper"))
        cycle = cycle.fix(**{STEP: min(max(ahead, least), most)})
    return _solve(problem, cycle, starts, progress)


def _list_footholds(
    robot: str, path: str | Path | None, turn_deg: float, steps: int | None, distance_m: float | None
) -> tuple[str, float]:
    """Return the footholds of a file, a turn or a line, and the mean length of their steps [m]."""
    is_nao = find_walk(robot) == "nao-walk"
    body: Body = make_nao(robot) if is_nao else make_humanoid(robot)
    if path is not None:
        text = read_footholds(path)
    elif turn_deg and isinstance(body, Humanoid):
        text = list_turn(body, turn_deg, steps, distance_m)
    else:
        count = check_count("steps", steps or 10, at_least=HALF_STEPS)
        text = list_arc(turn_deg, count, distance_m or body.step_length_m * (count - 1), body.feet_y)
    places = parse_footholds(text)
    if is_nao and any(place.yaw for place in places):
        raise InputError(
            f"robot {robot!r} does not turn: NAO has one motor for both hip yaw-pitch joints, so that no foot turns alone; "
            "turns are planned for legs whose hip joints turn one by one"
        )
    swings = list_swings(places, body.feet_y)
    return text, sum(landed.x for _, landed in swings) / max(len(swings) - 1, 1)


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
    found = np.interp(np.linspace(0.0, 1.0, count), np.linspace(0.0, 1.0, len(speeds)), speeds)
    return {name_speed(end, k): v for k, v in enumerate(found.tolist(), 2) for end in ("least", "greatest")}


def _parse_stairs(text: str) -> tuple[float, float, int]:
    found = re.fullmatch(r"(\d*\.?\d+)x(\d*\.?\d+):(\d{1,3})", text)
    if found is None or int(found[3]) < 1:
        raise InputError(f"stairs must be RISExRUN:N with rise and run in metres, such as 0.03x0.24:3, got {text!r}")
    return float(found[1]), float(found[2]), int(found[3])


def find_walk(robot: str) -> str:
    """Return the name of the walk's problem: NAO's for robots of its build."""
    try:
        load_nao(robot)
    except InputError:
        return "humanoid-walk"
    return "nao-walk"


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


def _solve(problem: GaitProblem, cycle: GaitProblem | None, starts: int, progress: Progress) -> WalkPlan:
    """Solve a walk from start points, for which a cycle is solved first if it is given."""
    rng, best = np.random.default_rng(0), None
    solver = IpoptSettings(few_rows=False).prepare(problem, solves=MANY_SOLVES)
    for k in range(check_count("starts", starts)):
        x0: Array = np.clip(problem.start_point(rng), problem.lower, problem.upper)
        if cycle is not None:
            gait = solve(cycle, seed=k, workers=1)
            progress(f"start {k + 1}, cycle: {gait.status}")
            x0 = start_from_cycle(problem, x0, gait.x, float(problem.options.get("stair_rise_m", 0.0)))
        found = solve(problem, x0=x0, solver=solver, workers=1)
        progress(f"start {k + 1}: {found.status}")
        if best is None or found.best.rank < best.best.rank:
            best = found
        if best.converged:
            break
    assert best is not None  # at least one start
    indexes = build_exact_model(problem).at(problem.check_x(best.x), problem.p).indexes
    numbers = {name: float(indexes[name]) for name in ("distance_m", "duration_s", "energy_J")}
    return WalkPlan(problem=problem, solution=best, steps=int(problem.options["steps"]), **numbers)


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


def describe_violation(row: ConstraintValue, steps: int) -> str:
    """Return a sentence about a violated row of a walk: step, constraint, amount and remedy."""
    begins = SENTENCES["places"]
    if found := re.match(r"step(\d+)_(ssp_|dsp_)?", row.name):  # of a walk whose steps differ
        support = {"ssp_": ", single support", "dsp_": ", double support"}.get(found[2], "")
        prefix, where = found[0], f"step {found[1]}{support}"
    else:
        prefix = next(begin for begin in begins if row.name.startswith(begin))
        where = begins[prefix].format(steps=steps, inner=f"steps 2 to {steps - 1}" if steps > 3 else "step 2")
    stem, _, label = row.name.removeprefix(prefix).partition("[")
    begin = next(begin for begin in SENTENCES["constraints"] if stem.startswith(begin))
    words, remedy = SENTENCES["constraints"][begin]
    if prefix.startswith("stand_"):
        remedy = SENTENCES["standing"].get(begin, remedy)
    owner = label.rstrip("]").split(",")[0].strip()
    what = f"{stem} {words}" if not owner or owner.isdigit() else f"{owner} {words}"
    return f"{where}: {what} by {row.violation:.3g} {row.unit} ({row.name}); {remedy}"
