"""Left and right of a robot: pairs of mirrored joints, and whether both turn the same way in mirrored motions."""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np

from nlp_gait.robots.robot import Robot

# Mirrored places agree to this, and mirrored axes to this cosine.
MIRROR_M, MIRROR_COSINE = 2e-3, 0.999


def partner(name: str) -> str:
    """Return the joint on the other side by name, LKneePitch for RKneePitch; a joint of neither side is its own partner."""
    swapped = {"L": "R", "R": "L"}.get(name[0])
    return swapped + name[1:] if swapped and name[1:2].isupper() else name


def partners(robot: Robot) -> Mapping[str, str]:
    """Return the mirror image of every joint by its place at zero angles, because names mislead; else by its name."""
    places = {
        name: np.sum([above.origin_m for above in robot.path_to_root(joint.child)], axis=0)
        for name, joint in robot.joints.items()
    }
    axes = {name: np.array(joint.axis) for name, joint in robot.joints.items()}

    def image(name: str) -> str:
        named = partner(name)
        fitting = [o for o in places if are_mirror_images(places[name], axes[name], places[o], axes[o])]
        if named in fitting or not fitting:
            return named if named in places else name
        return fitting[0]

    return {name: image(name) for name in places}


def are_mirror_images(
    place: np.ndarray, axis: np.ndarray, other_place: np.ndarray, other_axis: np.ndarray, across: int = 1
) -> bool:
    """Return whether two joints are mirror images in the plane through the root across an axis."""
    image = np.ones(3)
    image[across] = -1.0
    near = math.dist(image * place, other_place) <= MIRROR_M
    return near and abs(float((image * axis) @ other_axis)) >= MIRROR_COSINE


def mirror_sign(robot: Robot, joint: str, image: str | None = None) -> float:
    """Return +1 if a joint and its image turn the same way in motions mirrored left to right, otherwise -1.

    A reflection at the plane y = 0 turns an axis (x, y, z) of rotation into (-x, y, -z). Without an image, the
    partner by name is meant.

    Raises:
        UnknownNameError: the robot lacks the joint or its partner.
    """
    (x, y, z), other = robot.joint(joint).axis, robot.joint(partner(joint) if image is None else image).axis
    return 1.0 if -x * other[0] + y * other[1] - z * other[2] > 0.0 else -1.0
