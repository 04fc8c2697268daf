"""A whole walk from standing to standing: weight shift, first half step, steps, last half step, weight shift.

All inner steps are the same cycle, whose states at both switches are variables; the start ends in the cycle's state, and the stop
begins there. So the size of the problem does not depend on the number of steps, and hip, feet and joints have continuous
positions and velocities for any x. A walk of two half steps has no inner step, and neither variables nor rows of one.
"""

from __future__ import annotations

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache, partial
from importlib.resources import files
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import MX

from nlp_gait.errors import check_count
from nlp_gait.formulation import (
    Array,
    Assembly,
    Constraint,
    Display,
    GaitProblem,
    Grid,
    InstantPoint,
    NumericPoint,
    Parameter,
    Point,
    RowsOverTime,
    Signals,
    SolverHints,
    Variable,
)
from nlp_gait.formulation.assembly import parameters
from nlp_gait.gaits.biped.body import LIFT, TIMES, Body
from nlp_gait.gaits.biped.cycle import make_cycle_margins
from nlp_gait.gaits.biped.cycle_motion import (
    STEP,
    PhaseMotion,
    make_cycle_variables,
    make_planner,
    make_state_variables,
    read_state,
)
from nlp_gait.gaits.biped.double_support import (
    compute_double_support_mean_margins,
    make_double_support_margins,
    make_support_box,
)
from nlp_gait.gaits.biped.goals import Goal
from nlp_gait.gaits.biped.joined_phases import (
    ENERGY_PER_METRE,
    STAND,
    assemble_part,
    collect_parameters,
    join_phases,
    list_rows_over_time,
)
from nlp_gait.gaits.biped.limits import RowsAndIndexes
from nlp_gait.gaits.biped.load_sharing import LoadSharing
from nlp_gait.gaits.biped.phase import Phase
from nlp_gait.gaits.biped.phase_problem import add_robot, make_phase_limits
from nlp_gait.gaits.biped.samples import LEAST_DURATION, Samples
from nlp_gait.gaits.biped.single_support import make_single_support_loads
from nlp_gait.gaits.several_steps import join_steps
from nlp_gait.symbolic.nonsmooth import Nonsmooth

CYCLE_END = "cycle_end"
HALF_STEPS, MOST_STEPS = 2, 1000  # the first and the last step are half steps
LEAST_SPEED, GREATEST_SPEED = "least_speed_m_s", "greatest_speed_m_s"  # parameters: of the inner steps
NO_LIMIT = 100.0  # [m/s]
START_NOISE = 0.002  # of start points, as a share of the bounds' ranges
STEPS = "step_count"  # parameter, so that compiled functions suit walks of any length
# Variables of a phase besides those of its first and last state.
DURATION, RIGHT_FROM = "duration_s", "right_from_m"


class Part(NamedTuple):
    """A phase of the walk over the left foot, which stands at x = 0."""

    kind: str  # ``ssp``, ``dsp`` with a foot ahead, or ``stand`` with both feet side by side
    begin: str  # state at its begin
    end: str
    feet: tuple[int, int]  # places of the right foot at begin and end, in step lengths
    duration: str  # variable

    @property
    def lift(self) -> str:
        """Variable of single support: height of the swing."""
        return self.duration.replace(TIMES["ssp"], LIFT)


# In the order of time; of the pose in which the robot stands only the limits count.
PARTS = {
    STAND: Part(STAND, STAND, STAND, (0, 0), "shift_time_s"),
    "shift": Part(STAND, STAND, "start_lift_off", (0, 0), "shift_time_s"),
    "start_ssp": Part("ssp", "start_lift_off", "start_touch_down", (0, 1), f"start_{TIMES['ssp']}"),
    "start_dsp": Part("dsp", "start_touch_down", CYCLE_END, (1, 1), f"start_{TIMES['dsp']}"),
    "ssp": Part("ssp", "lift_off", "touch_down", (-1, 1), TIMES["ssp"]),
    "dsp": Part("dsp", "touch_down", CYCLE_END, (1, 1), TIMES["dsp"]),
    "stop_ssp": Part("ssp", "lift_off", "stop_touch_down", (-1, 0), f"stop_{TIMES['ssp']}"),
    "stop_dsp": Part(STAND, "stop_touch_down", STAND, (0, 0), f"stop_{TIMES['dsp']}"),
}
# States that are variables in addition to the cycle's, with the switch of the cycle whose bounds they have.
STATES = {"start_lift_off": "lift_off", "start_touch_down": "touch_down", "stop_touch_down": "touch_down"}


@dataclass(frozen=True, kw_only=True, eq=False)
class WholeWalk:
    """A walk sampled over its distinct phases; inner steps are counted as often as they occur."""

    body: Body
    steps: int  # swings, the half steps included
    variables: tuple[Variable, ...]
    phases: Mapping[str, Phase]  # by kind

    @property
    def parts(self) -> dict[str, Part]:
        """The phases that it consists of: without those of the inner steps if there are none."""
        return {name: part for name, part in PARTS.items() if self.steps > HALF_STEPS or name not in TIMES}

    @property
    def counts(self) -> dict[str, int]:
        """How often each part occurs in the walk."""
        often = {STAND: 0, "ssp": self.steps - HALF_STEPS, "dsp": self.steps - HALF_STEPS}
        return {name: often.get(name, 1) for name in self.parts}

    @property
    def parameters(self) -> tuple[Parameter, ...]:
        """Parameters of all phases; those of balance begin with the kind of the phase."""
        speeds = parameters(
            (LEAST_SPEED, "m/s", 0.0, "least speed of the inner steps", 0.0, NO_LIMIT),
            (GREATEST_SPEED, "m/s", NO_LIMIT, "greatest speed of the inner steps (no limit by default)", 0.0, NO_LIMIT),
        )
        count = parameters(
            (STEPS, "1", float(self.steps), "number of steps; set by the option steps", self.steps, self.steps)
        )
        found = collect_parameters(self.phases)
        own = (*count, *speeds) if "ssp" in self.parts else count
        return (*own, *sorted(found, key=lambda p: p.name.endswith((".lower", ".upper"))))

    def assemble(self, at: Point, ops: Nonsmooth) -> Assembly:
        """Return energy per metre, rows and indexes."""
        parts = self.parts
        points = {name: self.read_part(name, at) for name in parts}
        samples: dict[str, Samples] = {}
        for kinds in (("ssp",), ("dsp", STAND)):  # double support differs in its limits only
            names = [name for name, part in parts.items() if part.kind in kinds]
            several = self.phases[kinds[0]].sample_several([points[name] for name in names], ops)
            samples |= dict(zip(names, several, strict=True))
        found = {
            name: assemble_part(name, part.kind, self.phases[part.kind], points[name], samples[name], ops)
            for name, part in parts.items()
        }
        times = {name: point[DURATION] for name, point in points.items()}
        energies = {name: found[name].indexes[f"{name}_power_W"] * times[name] for name in parts}
        inner = at[STEPS] - HALF_STEPS
        energy, duration = (
            sum((part[name] * (inner if name in TIMES else 1) for name in parts if name != STAND), MX(0))
            for part in (energies, times)
        )
        distance = (inner + 1) * at[STEP]
        speeds, indexes = self._limit_speed(at, times, energies) if "ssp" in parts else ((), {})
        return Assembly(
            objective=energy / distance,
            constraints=(*(row for part in found.values() for row in part.constraints), *speeds),
            indexes={
                "energy_J": energy,
                "distance_m": distance,
                "duration_s": duration,
                "energy_J_per_m": energy / distance,
                **indexes,
                **{name: value for part in found.values() for name, value in part.indexes.items()},
            },
        )

    def _limit_speed(self, at: Point, times: Mapping[str, MX], energies: Mapping[str, MX]) -> RowsAndIndexes:
        """Return the row and the indexes of the inner steps."""
        speed = at[STEP] / (times["ssp"] + times["dsp"])
        row = Constraint(
            name="speed",
            unit="m/s",
            scale=0.01,
            value=speed,
            lower=at[LEAST_SPEED],
            upper=at[GREATEST_SPEED],
            over="once",
        )
        cost = (energies["ssp"] + energies["dsp"]) / at[STEP]
        return (row,), {"speed_m_s": speed, "cycle_energy_J_per_m": cost}

    def read_part(self, name: str, at: NumericPoint) -> NumericPoint:
        """Return the point of one phase: its own variables, see ``make_phase_variables``, from those of the walk."""
        part, step = PARTS[name], at[STEP]
        lift = at[part.lift] if part.kind == "ssp" else 0.0
        values = [*self._read_state(part.begin, at), *self._read_state(part.end, at), lift]
        values += [ca.fmax(at[part.duration], LEAST_DURATION), part.feet[0] * step, part.feet[1] * step]
        names = [variable.name for variable in self.phases["ssp"].variables]
        own = replace(at, x=ca.vertcat(*values), positions={n: p for n, p in at.positions.items() if p[0] == "p"})
        return replace(own, positions={**own.positions, **{n: ("x", i) for i, n in enumerate(names)}})

    def _read_state(self, state: str, at: NumericPoint) -> list[MX]:
        """Values of a state in the order of ``make_state_variables``."""
        coordinates = self.body.coordinates
        if state == STAND:
            symmetric = [at[f"{c.name}_{STAND}_rad"] if c.image > 0 else 0 for c in coordinates]
            return [at[f"hip_x_{STAND}_m"], 0, at[f"hip_z_{STAND}_m"], 0, 0, 0, *(v for a in symmetric for v in (a, 0))]
        names = [variable.name for variable in make_state_variables(self.body, "lift_off", "lift_off")]
        if state != CYCLE_END:
            return [at[name.replace("lift_off", state)] for name in names]
        x, y, z, vx, vy, vz, *angles = (at[name] for name in names)  # the mirror image of lift-off, a step further
        images = [c.image for c in coordinates for _ in range(2)]
        return [x + at[STEP], -y, z, vx, -vy, vz, *(i * a for i, a in zip(images, angles, strict=True))]

    @property
    def rows_over_time(self) -> tuple[RowsOverTime, ...]:
        """All phases as functions of time; of the inner steps the first one."""
        counts = self.counts
        parts = ((name, part.kind, part.duration, counts[name]) for name, part in self.parts.items())
        return list_rows_over_time(parts, self.phases, self.read_part)

    def signals(self, at: NumericPoint) -> Signals:
        """Return time histories of the whole walk at a point of numbers."""

        def join(*names: str) -> Signals:
            return join_phases(self.phases[PARTS[name].kind].signals(self.read_part(name, at)) for name in names)

        inner = [join("ssp", "dsp")] * (self.steps - HALF_STEPS) if "ssp" in self.parts else []
        steps = [join("shift", "start_ssp", "start_dsp"), *inner, join("stop_ssp", "stop_dsp")]
        return join_steps(steps, self.body.robot, np.array([float(at[STEP]), 0.0, 0.0]))


def make_whole_walk(body: Body, steps: int, sharing: LoadSharing, grid: Grid, goal: Goal) -> WholeWalk:
    """Return the phases of a walk of so many swings, joined."""
    margins = make_cycle_margins(body)
    box = make_support_box(body.robot, {"L": (0.0, body.feet_y[0]), "R": (0.0, body.feet_y[1])})
    beside = make_double_support_margins(box), compute_double_support_mean_margins(box)

    def read(at: InstantPoint, swings: bool) -> PhaseMotion:
        begin, end = (read_state(at, name, body.coordinates) for name in ("begin", "end"))
        return PhaseMotion(begin, end, at[DURATION], at[RIGHT_FROM], at[STEP], at[LIFT] if swings else None)

    phases = {
        kind: Phase(
            body=body,
            variables=make_phase_variables(body),
            duration=DURATION,
            plan=make_planner(body, partial(read, swings=kind == "ssp")),
            loads=make_single_support_loads(body) if kind == "ssp" else sharing.loads,
            grid=grid,
            limits=(*make_phase_limits(body, *own), *body.motors.limits),
            goal=goal,
        )
        for kind, own in {"ssp": margins["ssp"], "dsp": margins["dsp"], STAND: beside}.items()
    }
    return WholeWalk(body=body, steps=steps, variables=make_walk_variables(body, steps), phases=phases)


def make_phase_variables(body: Body) -> tuple[Variable, ...]:
    """Return the variables of one phase: states at both ends, height of the swing, duration, places of the right foot."""
    cycle = make_cycle_variables(body)
    *_, single, _, step = cycle
    return (
        *make_state_variables(body, "begin", "lift_off"),
        *make_state_variables(body, "end", "touch_down"),
        body.lift_variable,
        replace(single, name=DURATION),
        replace(step, name=RIGHT_FROM),
        step,
    )


def make_walk_variables(body: Body, steps: int) -> tuple[Variable, ...]:
    """Return the variables of the cycle, and those of both ends of the walk after them.

    Without inner steps, only the state between the half steps and the step length remain of the cycle.
    """
    cycle = make_cycle_variables(body)
    own = {variable.name: variable for variable in cycle}
    inner = {LIFT, *TIMES.values()} | {name for name in own if "touch_down" in name}
    found = [variable for variable in cycle if steps > HALF_STEPS or variable.name not in inner]
    for name, switch in STATES.items():
        found += make_state_variables(body, name, switch)
    # The pose at both ends is symmetric and at rest, so the other coordinates are zero.
    pose = ["hip_x_{}_m", "hip_z_{}_m", *(f"{c.name}_{{}}_rad" for c in body.coordinates if c.image > 0)]
    for name in pose:
        variable = own[name.format("lift_off")]
        text = variable.description.replace("at lift-off", "standing")
        found.append(replace(variable, name=name.format(STAND), description=text))
    for name, part in PARTS.items():
        if name in (STAND, *TIMES):
            continue
        kind = "ssp" if part.kind == "ssp" else "dsp"
        words = f"duration of the phase {name}"
        found.append(replace(own[TIMES[kind]], name=part.duration, description=words))  # type: ignore[index]
        if kind == "ssp":
            words = f"{body.lift_variable.description}, phase {name}"
            found.append(replace(body.lift_variable, name=part.lift, description=words))
    return tuple(found)


def plan_whole_walk(body: Body, steps: int, grid: Grid, goal: Goal, sharing: LoadSharing) -> GaitProblem:
    """Return the problem of a whole walk of least energy per metre; for the options see ``gaits.nao``."""
    steps = check_count("steps", steps, at_least=HALF_STEPS, at_most=MOST_STEPS)
    walk = make_whole_walk(body, steps, sharing, grid, goal)
    durations = [PARTS[name].duration for name, count in walk.counts.items() for _ in range(count)]
    problem = GaitProblem(
        name=f"{body.family}-walk",
        title=f"{body.title}, walk from standing to standing: least energy per metre",
        variables=walk.variables,
        own_parameters=walk.parameters,
        objective=ENERGY_PER_METRE,
        assemble=walk.assemble,
        grid=grid,
        rows_over_time=walk.rows_over_time if body.closed_form else (),
        display=Display(motion=walk.signals, durations=tuple(durations)),
        hints=SolverHints(
            start=partial(start_walk, walk.variables, math.tan(body.slope_rad)), starts=3, searchable=False
        ),
    )
    return add_robot(problem, body, steps=steps)


@cache
def _load_start() -> dict[str, float]:
    """Shares of the bounds' ranges at a walk of NAO."""
    shares: dict[str, float] = json.loads(files(__package__).joinpath("walk_start.json").read_text(encoding="utf-8"))
    return shares


def start_walk(
    variables: Sequence[Variable], rise: float, parameters: Mapping[str, float], rng: np.random.Generator
) -> Array:
    """Draw a start point (n,) near a walk of NAO in proportion to the bounds, at the required speed.

    On ground that rises forward, by ``rise`` for each metre, the hip is ahead by that share of its height.
    """
    shares, widths = _load_start(), [variable.upper - variable.lower for variable in variables]
    x = {
        variable.name: variable.lower + width * shares.get(variable.name, 0.5)
        for variable, width in zip(variables, widths, strict=True)
    }
    for name in x:
        if name.startswith("hip_x_"):
            x[name] += rise * x[f"hip_z_{STAND}_m"]
    if LEAST_SPEED in parameters:
        speed = x[STEP] / sum(x[time] for time in TIMES.values())
        wanted = min(max(speed, parameters[LEAST_SPEED]), parameters[GREATEST_SPEED])
        x[TIMES["dsp"]] += max(x[STEP] / wanted - x[STEP] / speed, 0.0)
        x[STEP] *= max(wanted / speed, 1.0)
    lower, upper = (np.array([parameters[f"{name}.{end}"] for name in x]) for end in ("lower", "upper"))
    noise = START_NOISE * np.array(widths) * rng.uniform(-1.0, 1.0, len(x))
    return np.asarray(np.clip(np.array(list(x.values())) + noise, lower, upper))


def start_from_cycle(walk: GaitProblem, start: Array, cycle: Mapping[str, float]) -> Array:
    """Return a start point (n,) with the states and times of a cycle in all phases; ``start`` has what a cycle has not."""
    found = walk.by_name(start)
    for name in found:
        same = name.replace("start_", "").replace("stop_", "").replace(STAND, "lift_off")
        found[name] = cycle.get(TIMES["dsp"] if name == "shift_time_s" else same, found[name])
    # A lift-off between both feet is ahead of one side by side.
    found |= dict.fromkeys((f"hip_x_{STAND}_m", "hip_x_start_lift_off_m"), 0.2 * found[STEP])
    return np.asarray(np.clip(list(found.values()), walk.lower, walk.upper))
