"""Inertia tensors about the wrong point: public robot files have some about the joint in fields for the centre of mass."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from nlp_gait.errors import RobotDataError
from nlp_gait.robots.robot import Link
from nlp_gait.robots.tree import inertia_moments, point_inertia

# A tensor about the joint gives ratios below 1 (see ``joint_distance_ratio``); printed digits may lift one by some percent.
GREATEST_JOINT_RATIO = 1.05
# Above one half, the joint is at least as far from the centre of mass as the matter is spread, if the tensor is about the joint.
FAR_RATIO = 0.5
# Fewer links than this prove nothing.
LEAST_LINKS = 5
# Keeps the ratio of a point mass finite [kg m^2].
LEAST_MOMENT = 1e-30


def joint_distance_ratio(link: Link) -> float:
    """Squared distance of joint and centre of mass, in units of the matter's spread along that direction.

    With s for a tensor about the centre of mass, the same link described by the tensor about its joint has s / (1 + s), which
    is below 1. A uniform rod held at its end has s = 3, and 0.75 with the wrong tensor.
    """
    inertia, com = link.inertia_matrix, np.array(link.com_m)
    second_moments, axes = np.linalg.eigh(np.trace(inertia) / 2 * np.eye(3) - inertia)
    return float(link.mass_kg * np.sum((com @ axes) ** 2 / np.maximum(second_moments, LEAST_MOMENT)))


def check_inertias(robot: str, links: Sequence[Link]) -> None:
    """Refuse tensors that look as if they were about the joints.

    Of links that hang on their joints, most have ratios above 1. Where not one of at least five links has, and most are above
    one half, all of them were probably taken about the joint. One wrong tensor among right ones is not found.

    Raises:
        RobotDataError: with the ratios of the farthest links, and what to write into the file.
    """
    ratios = {link.name: joint_distance_ratio(link) for link in links}
    far = sorted((name for name in ratios if ratios[name] > FAR_RATIO), key=lambda name: -ratios[name])
    if len(ratios) < LEAST_LINKS or max(ratios.values()) > GREATEST_JOINT_RATIO or 2 * len(far) < len(ratios):
        return
    shown = ", ".join(f"{name} {ratios[name]:.2f}" for name in far[:3])
    raise RobotDataError(
        f"robot {robot!r}: the inertia tensors look as if taken about the joints, not about the centres of mass: none of its "
        f"{len(ratios)} links is farther from its joint than its matter is spread (ratios {shown}, ...; a rod has 3, by the "
        'wrong tensor 0.75). If so, write "inertia_about": "joint" into the robot file and they are shifted; if they are '
        'right, write "inertia_about": "com"'
    )


def shifted_to_com(link: Link) -> Link:
    """The link whose tensor was taken about its joint.

    Raises:
        RobotDataError: no rigid body has such a tensor about its joint.
    """
    about_com = link.inertia_matrix - point_inertia(link.mass_kg, np.array(link.com_m))
    return replace(link, inertia_com_kgm2=inertia_moments(about_com))
