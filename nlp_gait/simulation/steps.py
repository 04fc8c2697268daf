"""A walk of several steps from one cycle: every second step is the mirror image of the one before, a step further."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from nlp_gait.errors import InputError
from nlp_gait.problem import Array, Signals
from nlp_gait.robots import Robot
from nlp_gait.robots.mirror import mirror_sign, partner

JOINT_ARRAYS = ("q", "qd", "qdd", "tau")
SIDES_SWAPPED = {
    f"{side}_{what}": f"{other}_{what}"
    for side, other in (("left", "right"), ("right", "left"))
    for what in ("foot", "force", "moment")
}


def walk(cycle: Signals, robot: Robot, steps: int) -> Signals:
    """Time histories of so many steps.

    Args:
        cycle: of one step that begins on the left foot and ends in the mirror image of its beginning.
        robot: whose joints are mirrored.
        steps: at least 1.

    Raises:
        InputError: no step.
    """
    if isinstance(steps, bool) or not isinstance(steps, int) or steps < 1:
        raise InputError(f"steps must be a whole number >= 1, got {steps!r}")
    image = mirror_image(cycle, robot)
    advance, period = step_of(cycle), float(cycle.arrays["t"][-1])
    parts = [_moved(cycle if k % 2 == 0 else image, k * advance, k * period) for k in range(steps)]
    arrays = {name: np.concatenate([parts[0][name], *(part[name][1:] for part in parts[1:])]) for name in parts[0]}
    return replace(cycle, arrays=arrays)


def step_of(cycle: Signals) -> float:
    """How far a cycle moves the hip forward [m]."""
    hip = cycle.arrays["hip"]
    return float(hip[-1, 0] - hip[0, 0])


def mirror_image(signals: Signals, robot: Robot) -> Signals:
    """Time histories with left and right exchanged. Torques are those of a robot that is itself symmetric."""
    columns = [signals.joints.index(partner(name)) for name in signals.joints]
    signs = np.array([mirror_sign(robot, name) for name in signals.joints])
    arrays: dict[str, Array] = {}
    for name, array in signals.arrays.items():
        if name in JOINT_ARRAYS:
            arrays[name] = signs * array[:, columns]
        elif name == "t":
            arrays[name] = array
        else:
            # A reflection turns a moment, as any turning, the other way than a force.
            reflected = np.array([1.0, -1.0, 1.0]) * (-1.0 if signals.columns[name].unit == "Nm" else 1.0)
            arrays[SIDES_SWAPPED.get(name, name)] = array * reflected[: array.shape[1]]
    return replace(signals, arrays=arrays)


def _moved(signals: Signals, distance: float, delay: float) -> dict[str, Array]:
    """Arrays with all positions moved forward [m] and all times delayed [s]."""
    arrays = {}
    for name, array in signals.arrays.items():
        if name == "t":
            arrays[name] = array + delay
        elif name not in JOINT_ARRAYS and signals.columns[name].unit == "m":
            arrays[name] = array + distance * np.eye(1, array.shape[1])[0]
        else:
            arrays[name] = array
    return arrays
