"""The phases of a whole walk, each over the left foot at x = 0, their states, the variables of both, and their start points."""

import json
import re
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import cache
from importlib.resources import files
from typing import Any, NamedTuple

import numpy as np

from nlp_gait.formulation import Array, GaitProblem, Variable
from nlp_gait.gaits.biped.body import LIFT, TIMES, Body
from nlp_gait.gaits.biped.cycle_motion import STEP, make_cycle_variables, make_state_variables
from nlp_gait.gaits.biped.joined_phases import STAND

CYCLE_END, STAND_AT_END = "cycle_end", "stand_at_end"
HALF_STEPS = 2  # the first and the last step are half steps
LEAST_SPEED, GREATEST_SPEED = "least_speed_m_s", "greatest_speed_m_s"  # parameters: of the inner steps
DURATION, RIGHT_FROM = "duration_s", "right_from_m"  # variables of a phase besides those of its first and last state

EACH_STEP = re.compile(r"(start|stop|step\d+)_")  # in names of variables that a cycle has once
START_NOISE = 0.002  # of start points, as a share of the bounds' ranges


class Part(NamedTuple):
    """A phase of the walk over the left foot, which stands at x = 0."""

    kind: str  # ``ssp``, ``dsp`` with a foot ahead, or ``stand`` with both feet side by side
    begin: str  # state at its begin
    end: str
    feet: tuple[Any, Any]  # places of the right foot at begin and end, in step lengths; or its footholds
    duration: str  # variable
    step: int = 0  # of a walk along footholds: from 1, whose standing foot is the left one here

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
    """Return the variables of the cycle and of both ends of the walk; without inner steps, few of the cycle's remain."""
    cycle = make_cycle_variables(body)
    own = {variable.name: variable for variable in cycle}
    inner = {LIFT, *TIMES.values()} | {name for name in own if "touch_down" in name}
    found = [variable for variable in cycle if steps > HALF_STEPS or variable.name not in inner]
    for name, switch in STATES.items():
        found += make_state_variables(body, name, switch)
    found += make_pose_variables(body)
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


def make_pose_variables(body: Body) -> list[Variable]:
    """Return the variables of the pose at both ends: symmetric and at rest, so that the other coordinates are zero."""
    names = ["hip_x_{}_m", "hip_z_{}_m", *(f"{c.name}_{{}}_rad" for c in body.coordinates if c.image > 0)]
    own = {v.name: v for v in make_state_variables(body, STAND, "lift_off")}
    found = (own[name.format(STAND)] for name in names)
    return [replace(v, description=v.description.replace("at stand", "standing")) for v in found]


@cache
def _load_start() -> dict[str, float]:
    """Shares of the bounds' ranges at a walk of NAO."""
    shares: dict[str, float] = json.loads(files(__package__).joinpath("walk_start.json").read_text(encoding="utf-8"))
    return shares


def start_walk(
    variables: Sequence[Variable], rise: float, parameters: Mapping[str, float], rng: np.random.Generator
) -> Array:
    """Draw a start point (n,) near NAO's walk in proportion to the bounds, at the required speed, on ground that may rise."""
    shares, widths = _load_start(), [variable.upper - variable.lower for variable in variables]
    x = {
        variable.name: variable.lower + width * shares.get(EACH_STEP.sub("", variable.name), 0.5)
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


def start_from_cycle(walk: GaitProblem, start: Array, cycle: Mapping[str, float], rise_m: float = 0.0) -> Array:
    """Return ``start`` (n,) with states and times of a cycle in all phases; on stairs the hip rises with the feet's middle."""
    found = walk.by_name(start)
    for name in found:
        same = EACH_STEP.sub("", name).replace(STAND, "lift_off")
        found[name] = cycle.get(TIMES["dsp"] if name == "shift_time_s" else same, found[name])
    # A lift-off between both feet is ahead of one side by side.
    first = next(name for name in found if name in ("hip_x_start_lift_off_m", "hip_x_step1_lift_off_m"))
    found |= dict.fromkeys((f"hip_x_{STAND}_m", first), 0.2 * (found | dict(cycle))[STEP])
    for state, share in {"lift_off": -0.5, "touch_down": 0.5, "start_touch_down": 0.5}.items():
        if (name := f"hip_z_{state}_m") in found:
            found[name] += share * rise_m
    return np.asarray(np.clip(list(found.values()), walk.lower, walk.upper))
