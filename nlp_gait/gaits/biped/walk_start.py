"""Start points of a whole walk: near one of NAO in proportion, or from a cycle of the same robot."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping, Sequence
from functools import cache
from importlib.resources import files

import numpy as np

from nlp_gait.formulation import Array, GaitProblem, Variable
from nlp_gait.gaits.biped.body import TIMES
from nlp_gait.gaits.biped.cycle_motion import STEP
from nlp_gait.gaits.biped.joined_phases import STAND
from nlp_gait.gaits.biped.walk_parts import GREATEST_SPEED, LEAST_SPEED

EACH_STEP = re.compile(r"(start|stop|step\d+)_")  # in names of variables that a cycle has once
START_NOISE = 0.002  # of start points, as a share of the bounds' ranges


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
    """Return a start point (n,) with the states and times of a cycle in all phases; ``start`` has what a cycle has not.

    On stairs, of which each step climbs ``rise_m``, the hip is as far above the middle of both feet as on the flat.
    """
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
