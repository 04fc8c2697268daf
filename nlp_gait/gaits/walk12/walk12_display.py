"""Drawing of the 12-joint biped as a stick figure."""

from collections.abc import Mapping

import numpy as np

from nlp_gait.formulation import Array, Signals, display
from nlp_gait.gaits.walk12.walk12_model import PointMassBiped


def make_skeleton(robot: PointMassBiped, signals: Signals, parameters: Mapping[str, float]) -> display.Skeleton:
    """Return the stick figure of a motion; the robot turns to the left by ``turn_rad`` after each step."""
    arrays = signals.arrays
    waist, left_stands = arrays["waist"], arrays["left_stance"] > 0.5
    heading = np.concatenate([[0], np.cumsum(np.diff(left_stands) != 0)]) * parameters["turn_rad"]
    forward = np.stack([np.cos(heading), np.sin(heading), np.zeros_like(heading)], axis=1)
    across = np.stack([-np.sin(heading), np.cos(heading), np.zeros_like(heading)], axis=1)
    outline = display.make_rectangle(
        -robot.foot_back_m, robot.foot_front_m, -robot.foot_width_m / 2, robot.foot_width_m / 2
    )
    limbs, soles = [], []
    for side, sign, stands in ((display.LEFT, 0.5, left_stands), (display.RIGHT, -0.5, ~left_stands)):
        hip, ankle = waist + sign * robot.hip_distance_m * across, arrays[f"{side}_ankle"]
        knee = _place_knee(hip, ankle, forward, robot.thigh_m, robot.shank_m)
        limbs.append(display.Limb(side=side, points=np.stack([waist, hip, knee, ankle], axis=1)))
        corners = ankle[:, None, :] + outline[:, :1] * forward[:, None, :] + outline[:, 1:2] * across[:, None, :]
        soles.append(display.Sole(side=side, corners=corners, supports=stands))
    return display.make_flat_skeleton(signals, limbs, soles)


def _place_knee(hip: Array, ankle: Array, forward: Array, thigh: float, shank: float) -> Array:
    """Return the knee (T, 3), bent forward in the plane of the leg and the forward axis [m]; a leg out of reach is straight."""
    leg = ankle - hip
    length = np.linalg.norm(leg, axis=1, keepdims=True)
    along = leg / length
    down = (thigh**2 - shank**2 + length**2) / (2 * length)
    ahead = forward - (forward * along).sum(axis=1, keepdims=True) * along
    ahead /= np.linalg.norm(ahead, axis=1, keepdims=True)
    return np.asarray(hip + down * along + np.sqrt(np.maximum(thigh**2 - down**2, 0.0)) * ahead)
