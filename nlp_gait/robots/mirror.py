"""Left and right of a robot: which joint is the image of which, and whether both turn the same way in mirrored motions."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from nlp_gait.robots.feet import mirrored
from nlp_gait.robots.robot import Robot


def partner(name: str) -> str:
    """Joint on the other side, for example LKneePitch for RKneePitch; a joint of neither side is its own image."""
    swapped = {"L": "R", "R": "L"}.get(name[0])
    return swapped + name[1:] if swapped and name[1:2].isupper() else name


def partners(robot: Robot) -> Mapping[str, str]:
    """Image of every joint, by where they are at zero angles, for names mislead; by name where no place fits."""
    places = {
        name: np.sum([above.origin_m for above in robot.path_to_root(joint.child)], axis=0)
        for name, joint in robot.joints.items()
    }
    axes = {name: np.array(joint.axis) for name, joint in robot.joints.items()}

    def image(name: str) -> str:
        named = partner(name)
        fitting = [o for o in places if mirrored(places[name], axes[name], places[o], axes[o])]
        if named in fitting or not fitting:
            return named if named in places else name
        return fitting[0]

    return {name: image(name) for name in places}


def mirror_sign(robot: Robot, joint: str, image: str | None = None) -> float:
    """+1 if a joint and its image turn the same way in motions mirrored left to right, -1 if in opposite ways.

    A reflection at the plane y = 0 turns an axis (x, y, z) of rotation into (-x, y, -z).

    Args:
        robot: whose joints they are.
        joint: name.
        image: of the joint on the other side; None for the one that its name says.

    Raises:
        UnknownNameError: the robot lacks the joint or its partner.
    """
    (x, y, z), other = robot.joint(joint).axis, robot.joint(partner(joint) if image is None else image).axis
    return 1.0 if -x * other[0] + y * other[1] - z * other[2] > 0.0 else -1.0
