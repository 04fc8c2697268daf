"""The phases of a whole walk, each over the left foot at x = 0, their states, the variables of both, and their start points."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from importlib.resources import files
from typing import NamedTuple

import numpy as np

from nlp_gait.formulation import Array, GaitProblem, Variable
from nlp_gait.gaits.biped.body import LIFT, TIMES, Body, Support
from nlp_gait.gaits.biped.bounds import make_lift_variable, make_usual_bounds
from nlp_gait.gaits.biped.cycle_motion import STEP, make_cycle_variables
from nlp_gait.gaits.biped.sequence import CYCLE, CYCLE_END, LIFT_OFF, End, MotionSection
from nlp_gait.gaits.biped.switch import SWITCHES, make_state_variables

STAND = Support.STAND.value  # first pose, and state of its variables
SHIFT = "shift_time_s"
HALF_STEPS = 2  # the first and the last step are half steps
LEAST_SPEED, GREATEST_SPEED = "least_speed_m_s", "greatest_speed_m_s"  # parameters: of the inner steps
DURATION, RIGHT_FROM = "duration_s", "right_from_m"  # variables of a phase besides those of its first and last state

START_NOISE = 0.002  # of start points, as a share of the bounds' ranges


class State(NamedTuple):
    """A state between two phases, whose variables are those of a switch of the cycle."""

    name: str  # in names of variables
    switch: str  # of the cycle, whose bounds they have

    def make_variables(self, body: Body) -> list[Variable]:
        """Return the variables of the state."""
        return make_state_variables(body, self.name, self.switch)

    def find_alike(self, body: Body) -> dict[str, str]:
        """Return the cycle's variable for each of the state's."""
        variables, cycle = self.make_variables(body), make_state_variables(body, self.switch, self.switch)
        return {variable.name: like.name for variable, like in zip(variables, cycle, strict=True)}


STATES = (
    *(State(switch, switch) for switch in SWITCHES),
    State("start_lift_off", "lift_off"),
    State("start_touch_down", "touch_down"),
    State("stop_touch_down", "touch_down"),
)
START_LIFT_OFF, START_TOUCH_DOWN, STOP_TOUCH_DOWN = map(End, range(len(SWITCHES), len(STATES)))

_SINGLE, _DOUBLE = TIMES[Support.SINGLE], TIMES[Support.DOUBLE]
START = (
    MotionSection(STAND, Support.STAND, End(), End(), (0, 0), SHIFT, occurs=0),
    MotionSection("shift", Support.STAND, End(), START_LIFT_OFF, (0, 0), SHIFT),
    MotionSection(
        "start_ssp", Support.SINGLE, START_LIFT_OFF, START_TOUCH_DOWN, (0, 1), f"start_{_SINGLE}", f"start_{LIFT}"
    ),
    MotionSection("start_dsp", Support.DOUBLE, START_TOUCH_DOWN, CYCLE_END, (1, 1), f"start_{_DOUBLE}"),
)
STOP = (
    MotionSection(
        "stop_ssp", Support.SINGLE, LIFT_OFF, STOP_TOUCH_DOWN, (-1, 0), f"stop_{_SINGLE}", f"stop_{LIFT}", step=3
    ),
    MotionSection("stop_dsp", Support.STAND, STOP_TOUCH_DOWN, End(), (0, 0), f"stop_{_DOUBLE}", step=3),
)


def list_sections(steps: int) -> tuple[MotionSection, ...]:
    """Return the phases of a walk of so many steps, whose inner ones are the same cycle; two half steps have none."""
    inner = [section._replace(step=2, occurs=steps - HALF_STEPS) for section in CYCLE]
    return (*START, *(inner if steps > HALF_STEPS else ()), *STOP)


def make_phase_variables(body: Body) -> tuple[Variable, ...]:
    """Return the variables of one phase: states at both ends, height of the swing, duration, places of the right foot."""
    *_, single, _, step = make_cycle_variables(body)
    return (
        *make_state_variables(body, "begin", "lift_off"),
        *make_state_variables(body, "end", "touch_down"),
        make_lift_variable(body),
        replace(single, name=DURATION),
        replace(step, name=RIGHT_FROM),
        step,
    )


def make_walk_variables(body: Body, steps: int) -> tuple[Variable, ...]:
    """Return the variables of the cycle and of both ends of the walk; without inner steps, few of the cycle's remain."""
    cycle = make_cycle_variables(body)
    by_name = {variable.name: variable for variable in cycle}
    inner = {LIFT, *TIMES.values(), *(v.name for v in STATES[1].make_variables(body))}
    variables = [variable for variable in cycle if steps > HALF_STEPS or variable.name not in inner]
    for state in STATES[len(SWITCHES) :]:
        variables += state.make_variables(body)
    variables += make_pose_variables(body)
    for section in (*START[1:], *STOP):
        kind = Support.SINGLE if section.kind is Support.SINGLE else Support.DOUBLE
        variables.append(
            replace(by_name[TIMES[kind]], name=section.duration, description=f"duration of the phase {section.name}")
        )
        if kind is Support.SINGLE:
            words = f"{make_lift_variable(body).description}, phase {section.name}"
            variables.append(replace(make_lift_variable(body), name=section.lift, description=words))
    return tuple(variables)


def make_pose_variables(body: Body) -> list[Variable]:
    """Return the variables of the pose at both ends: symmetric and at rest, so that the other coordinates are zero."""
    free = {"hip_x", "hip_z", *(c.name for c in body.coordinates if c.image > 0)}
    states = make_state_variables(body, STAND, "lift_off")
    return [
        replace(variable, description=variable.description.replace("at stand", "standing"))
        for variable in states
        if variable.name.partition(f"_{STAND}_")[0] in free
    ]


@cache
def _load_start() -> dict[str, float]:
    """Shares of the bounds' ranges at a walk of NAO."""
    shares: dict[str, float] = json.loads(files(__package__).joinpath("walk_start.json").read_text(encoding="utf-8"))
    return shares


@dataclass(frozen=True, kw_only=True, eq=False)
class WalkStart:
    """Start points of a walk, near one of NAO or near a cycle."""

    variables: Sequence[Variable]  # between whose bounds it starts
    alike: Mapping[str, str]  # the cycle's variable for each of the walk's
    pose: Mapping[str, str]  # the same for those of the poses at both ends
    rise: float  # of the ground, for each metre forward

    def __call__(self, parameters: Mapping[str, float], rng: np.random.Generator) -> Array:
        """Draw a start point (n,) near NAO's walk in proportion to the bounds, at the required speed."""
        shares, widths = _load_start(), [variable.upper - variable.lower for variable in self.variables]
        x = {
            variable.name: variable.lower + width * shares.get(self.alike.get(variable.name, variable.name), 0.5)
            for variable, width in zip(self.variables, widths, strict=True)
        }
        for name in x:
            if name.startswith("hip_x_"):
                x[name] += self.rise * x[f"hip_z_{STAND}_m"]
        if LEAST_SPEED in parameters:
            speed = x[STEP] / sum(x[time] for time in TIMES.values())
            wanted = min(max(speed, parameters[LEAST_SPEED]), parameters[GREATEST_SPEED])
            x[TIMES[Support.DOUBLE]] += max(x[STEP] / wanted - x[STEP] / speed, 0.0)
            x[STEP] *= max(wanted / speed, 1.0)
        lower, upper = (np.array([parameters[f"{name}.{end}"] for name in x]) for end in ("lower", "upper"))
        noise = START_NOISE * np.array(widths) * rng.uniform(-1.0, 1.0, len(x))
        return np.asarray(np.clip(np.array(list(x.values())) + noise, lower, upper))


def make_walk_start(
    body: Body, variables: Sequence[Variable], states: Sequence[State], sections: Sequence[MotionSection]
) -> WalkStart:
    """Return the start points of a walk of these states and phases."""
    alike = {name: like for state in states for name, like in state.find_alike(body).items()}
    for section in sections:
        if section.duration != SHIFT:
            alike[section.duration] = TIMES[Support.SINGLE if section.kind is Support.SINGLE else Support.DOUBLE]
        if section.kind is Support.SINGLE:
            alike[section.lift] = LIFT
    return WalkStart(
        variables=[make_usual_bounds(body, variable) for variable in variables],
        alike=alike,
        pose=State(STAND, "lift_off").find_alike(body) | {SHIFT: TIMES[Support.DOUBLE]},
        rise=math.tan(body.slope_rad),
    )


def start_from_cycle(walk: GaitProblem, start: Array, cycle: Mapping[str, float], rise_m: float = 0.0) -> Array:
    """Return ``start`` (n,) with states and times of a cycle in all phases; on stairs the hip rises with the feet's middle."""
    rule = walk.hints.start
    assert isinstance(rule, WalkStart)
    alike = {**rule.alike, **rule.pose}
    values = {name: cycle.get(alike.get(name, name), value) for name, value in walk.by_name(start).items()}
    # A lift-off between both feet is ahead of one side by side.
    first = next(name for name in values if name in ("hip_x_start_lift_off_m", "hip_x_step1_lift_off_m"))
    values |= dict.fromkeys((f"hip_x_{STAND}_m", first), 0.2 * (values | dict(cycle))[STEP])
    for state, share in {"lift_off": -0.5, "touch_down": 0.5, "start_touch_down": 0.5}.items():
        if (name := f"hip_z_{state}_m") in values:
            values[name] += share * rise_m
    return np.asarray(np.clip(list(values.values()), walk.lower, walk.upper))
