"""Walks of several steps from one cycle: each step is the mirror image of the previous one, one step length ahead."""

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from nlp_gait.errors import check_count
from nlp_gait.formulation.signals import Array, Signals
from nlp_gait.robots import Robot
from nlp_gait.robots.tree import find_partners, mirror_sign
from nlp_gait.symbolic.kinematics import turn_quaternion

JOINT_ARRAYS = ("q", "qd", "qdd", "tau", "q_desired", "qd_desired")
SIDES_SWAPPED = {
    f"{side}_{what}": f"{opposite}_{what}"
    for side, opposite in (("left", "right"), ("right", "left"))
    for what in ("foot", "bears", "force", "moment")
}
YAW = "feet_yaw"
TURNED_ONLY = tuple(f"{side}_{half}" for side in ("left", "right") for half in ("force", "moment"))
# Arrays that do not move along with the walk; a reflection at the plane y = 0 of a quaternion (w, x, y, z).
UNMOVED = (*JOINT_ARRAYS, "left_bears", "right_bears")
MIRRORED_ATTITUDE = np.array([1.0, -1.0, 1.0, -1.0])


def repeat_steps(cycle: Signals, robot: Robot, steps: int) -> Signals:
    """Return several steps of a cycle that ends in the mirror image of its start; InputError for none."""
    steps = check_count("steps", steps)
    return join_steps([cycle] * steps, robot, np.outer(np.arange(steps), [measure_step(cycle), 0.0, 0.0, 0.0]))


def join_steps(steps: Sequence[Signals], robot: Robot, places: Array) -> Signals:
    """Return a walk of steps on the left foot at x = 0, every second mirrored, from places (K, 4): x, y, z [m], yaw [rad]."""
    arrays: dict[str, list[Array]] = {name: [] for name in steps[0].arrays}
    mirrored: dict[int, Signals] = {}
    begin = 0.0
    for k, step in enumerate(steps):
        if k % 2 and id(step) not in mirrored:
            mirrored[id(step)] = mirror(step, robot)
        side = mirrored[id(step)] if k % 2 else step
        for name, values in _move(side, places[k, :3], places[k, 3], begin).items():
            arrays[name].append(values if k == 0 else values[1:])
        begin += float(step.arrays["t"][-1])
    return replace(steps[0], arrays={name: np.concatenate(histories) for name, histories in arrays.items()})


def measure_step(cycle: Signals) -> float:
    """Return the distance that a cycle moves the hip forward [m]."""
    hip = cycle.arrays["hip"]
    return float(hip[-1, 0] - hip[0, 0])


def mirror(signals: Signals, robot: Robot) -> Signals:
    """Return time histories with left and right exchanged; torques are right for a symmetric robot."""
    partners = find_partners(robot)
    columns = [signals.joints.index(partners[name]) for name in signals.joints]
    signs = np.array([mirror_sign(robot, name, partners[name]) for name in signals.joints])
    arrays: dict[str, Array] = {}
    for name, array in signals.arrays.items():
        if name in JOINT_ARRAYS:
            arrays[name] = signs * array[:, columns]
        elif name == "t":
            arrays[name] = array
        elif name == "attitude":
            arrays[name] = array * MIRRORED_ATTITUDE
        elif name == YAW:
            arrays[name] = -array[:, ::-1]
        else:
            # A reflection changes the sign of a moment relative to a force (pseudovector).
            reflected = np.array([1.0, -1.0, 1.0]) * (-1.0 if signals.columns[name].unit == "Nm" else 1.0)
            arrays[SIDES_SWAPPED.get(name, name)] = array * reflected[: array.shape[1]]
    return replace(signals, arrays=arrays)


def _move(signals: Signals, distance: Array, yaw: float, delay: float) -> dict[str, Array]:
    """Return arrays turned about the vertical through the origin [rad], moved by (x, y, z) [m] and delayed [s]."""
    arrays, turn = {}, np.array([[math.cos(yaw), -math.sin(yaw), 0], [math.sin(yaw), math.cos(yaw), 0], [0, 0, 1]])
    for name, array in signals.arrays.items():
        width = array.shape[-1]
        if name in UNMOVED:
            arrays[name] = array
        elif name == "t":
            arrays[name] = array + delay
        elif name == YAW:
            arrays[name] = array + yaw
        elif name == "attitude":
            arrays[name] = np.stack(turn_quaternion(array.T, math.cos(yaw / 2), math.sin(yaw / 2)), axis=1)
        else:
            turned = array @ turn[:width, :width].T if yaw else array
            arrays[name] = turned if name in TURNED_ONLY else turned + distance[:width]
    return arrays
