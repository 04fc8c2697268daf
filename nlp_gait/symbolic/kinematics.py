"""Forward kinematics of a tree of bodies."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import casadi as ca
from casadi import DM, SX

from nlp_gait.robots.tree import Body


class Pose(NamedTuple):
    """Pose of a body in the world."""

    rotation: SX  #: (3, 3) from body axes to world axes
    position: SX  #: (3,) reference point of the body [m]
    com: SX  #: (3,) centre of mass [m]


def axis_rotation(axis: Sequence[float], angle: SX) -> SX:
    """Return the rotation (3, 3) about a fixed unit axis by an angle [rad]."""
    return rotation_matrix(DM(axis), ca.cos(angle), ca.sin(angle))


def rotation_matrix(k: DM, cos: SX, sin: SX) -> SX:
    """Return the rotation (3, 3) about a fixed unit axis (Rodrigues); coordinate axes need no superfluous terms."""
    along = k @ k.T
    return SX(along) + cos * (DM.eye(3) - along) + sin * ca.skew(k)


def relative_rotation(body: Body, q: Mapping[str, SX]) -> SX:
    """Return the rotation (3, 3) from a body's axes to those of its parent in the tree; q by joint name [rad]."""
    if body.joint is None:
        return SX.eye(3)
    return axis_rotation(body.joint.axis, body.direction * q[body.joint.name])


def forward_kinematics(tree: Sequence[Body], q: Mapping[str, SX], base: SX) -> list[Pose]:
    """Return the poses of all bodies; the first is at ``base`` (3,) [m] with world axes, and q has joint angles [rad]."""
    poses: list[Pose] = []
    for body in tree:
        if body.parent < 0:
            rotation, position = SX.eye(3), base
        else:
            parent = poses[body.parent]
            rotation = parent.rotation @ relative_rotation(body, q)
            position = parent.position + parent.rotation @ DM(body.offset_m)
        poses.append(Pose(rotation, position, position + rotation @ DM(body.com_offset_m)))
    return poses


def centre_of_mass(tree: Sequence[Body], poses: Sequence[Pose]) -> SX:
    """Return the centre of mass (3,) of all bodies [m].

    Source:
        Gupta, Pratihar, Deb (2023), eq. (23).
    """
    total = sum(body.link.mass_kg for body in tree)
    return sum((body.link.mass_kg * pose.com for body, pose in zip(tree, poses, strict=True)), SX(3, 1)) / total
