"""What is drawn of the 12-joint biped: hips beside the waist, knees from the lengths of thigh and shank."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import numpy as np

from nlp_gait.formulation import Array, Signals
from nlp_gait.formulation.stick_figure import LEFT, RIGHT, Limb, Skeleton, Sole, make_flat_skeleton, make_rectangle
from nlp_gait.gaits.walk12.robot import PointMassBiped


def skeleton(robot: PointMassBiped) -> Callable[[Signals, Mapping[str, float]], Skeleton]:
    """What draws the robot; it heads by ``turn_rad`` further to the left after each step."""
    return lambda signals, parameters: _skeleton(robot, signals, parameters["turn_rad"])


def _skeleton(robot: PointMassBiped, signals: Signals, turn: float) -> Skeleton:
    arrays = signals.arrays
    waist, left_stands = arrays["waist"], arrays["left_stance"] > 0.5
    steps = np.concatenate([[0], np.cumsum(np.diff(left_stands.astype(int)) != 0)])
    heading = steps * turn
    forward = np.stack([np.cos(heading), np.sin(heading), np.zeros_like(heading)], axis=1)
    across = np.stack([-np.sin(heading), np.cos(heading), np.zeros_like(heading)], axis=1)
    outline = make_rectangle(-robot.foot_back_m, robot.foot_front_m, -robot.foot_width_m / 2, robot.foot_width_m / 2)
    limbs, soles = [], []
    for side, sign, stands in ((LEFT, 0.5, left_stands), (RIGHT, -0.5, ~left_stands)):
        hip, ankle = waist + sign * robot.hip_distance_m * across, arrays[f"{side}_ankle"]
        knee = _knee(hip, ankle, forward, robot.thigh_m, robot.shank_m)
        limbs.append(Limb(side=side, points=np.stack([waist, hip, knee, ankle], axis=1)))
        corners = ankle[:, None, :] + outline[:, :1] * forward[:, None, :] + outline[:, 1:2] * across[:, None, :]
        soles.append(Sole(side=side, corners=corners, supports=stands))
    return make_flat_skeleton(signals, limbs, soles)


def _knee(hip: Array, ankle: Array, forward: Array, thigh: float, shank: float) -> Array:
    """Knee (T, 3) bent forward in the plane of the leg and the forward axis [m]; a leg out of reach is drawn straight."""
    leg = ankle - hip
    length = np.linalg.norm(leg, axis=1, keepdims=True)
    along = leg / length
    down = (thigh**2 - shank**2 + length**2) / (2 * length)
    ahead = forward - (forward * along).sum(axis=1, keepdims=True) * along
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    return np.asarray(hip + down * along + np.sqrt(np.maximum(thigh**2 - down**2, 0.0)) * ahead)
