"""A robot that stands on its left foot, at any angles: where its parts are, and what they ask of motors and ground."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import DM, SX

from nlp_gait.gaits.biped.instant import BOTH_FEET, Loader
from nlp_gait.robots import Robot
from nlp_gait.robots.tree import Body, tree_from
from nlp_gait.symbolic import trajectories
from nlp_gait.symbolic.kinematics import centre_of_mass, forward_kinematics
from nlp_gait.symbolic.simplification import simplify


class FreeParts(NamedTuple):
    """Where the free parts are.

    Attributes:
        torso: (3,) origin of the torso [m].
        ankle: (3,) of the right foot [m].
        corners: (3, 4) of the right sole [m].
        rotation: (3, 3) from the torso's axes.
    """

    torso: SX
    ankle: SX
    corners: SX
    rotation: SX


def free_parts(
    robot: Robot, tree: Sequence[Body], q: Mapping[str, SX], support: tuple[float, float, float]
) -> FreeParts:
    """Where torso and right foot are.

    Args:
        robot: with links welded that never move.
        tree: of the robot from its left foot.
        q: angles by joint name [rad].
        support: (3,) the left ankle, which stands [m].
    """
    found = forward_kinematics(tree, q, SX(DM(support)))
    poses = {body.link.name: pose for body, pose in zip(tree, found, strict=True)}
    torso = poses[robot.root]
    entry = next(body.joint for body in tree if body.link.name == robot.root)
    assert entry is not None  # the torso is not the fixed link; for the type checker
    foot = robot.feet["right"]
    ankle = poses[foot.link]
    corners = [
        (along, across, -foot.ankle_height_m)
        for along in (-foot.back_m, foot.front_m)
        for across in (-foot.right_m, foot.left_m)
    ]
    return FreeParts(
        torso.position - torso.rotation @ DM(entry.origin_m),
        ankle.position,
        ca.repmat(ankle.position, 1, 4) + ankle.rotation @ DM(np.array(corners).T),
        torso.rotation,
    )


@dataclass(frozen=True, kw_only=True, eq=False)
class Stance:
    """A robot whose left foot stands.

    Attributes:
        robot: with links welded that never move.
        joints: those that turn.
        images: of every joint on the other side.
        support: (3,) origin of the left foot's link [m].
        hip_m: (3,) point of the torso that is called the hip, from its origin, in its axes [m].
    """

    robot: Robot
    joints: tuple[str, ...]
    images: tuple[str, ...]
    support: tuple[float, float, float]
    hip_m: Sequence[float] = (0.0, 0.0, 0.0)

    @cached_property
    def places(self) -> ca.Function:
        """From angles (J,) to torso, hip and right ankle (3,), corners of the right sole (3, 4) [m], and cosine of the lean."""
        q = SX.sym("q", len(self.joints))
        parts = free_parts(self.robot, self.tree, dict(zip(self.joints, ca.vertsplit(q), strict=True)), self.support)
        hip = parts.torso + parts.rotation @ DM(self.hip_m)
        return ca.Function("places", [q], [parts.torso, hip, parts.ankle, parts.corners, parts.rotation[2, 2]])

    @cached_property
    def tree(self) -> tuple[Body, ...]:
        """Of the robot from its left foot."""
        return tree_from(self.robot, self.robot.feet["left"].link)


@lru_cache(maxsize=8)  # the phases of a few robots: every motion of one has the same
def instant_of(stance: Stance, loads: Loader) -> ca.Function:
    """One instant, from angles and both derivatives (J,).

    Outputs: torque (J,), ZMP (2,), torso (3,), hip (3,) and its velocity, right ankle (3,), corners of the right sole (12,),
    centre of mass (3,), and the ground's wrench (6,) on each sole.
    """
    joints = stance.joints
    q, qd, qdd = (SX.sym(name, len(joints)) for name in ("q", "qd", "qdd"))
    torso, hip, ankle, corners, _ = stance.places(q)
    motions = {name: trajectories.Motion(*(part[row] for part in (q, qd, qdd))) for row, name in enumerate(joints)}
    found = loads(motions, torso, {"L": SX(DM(stance.support[:2])), "R": ankle[:2]}, SX(0, 1))
    torque = ca.vertcat(*(found.torques[name] for name in joints))
    angles = dict(zip(joints, ca.vertsplit(q), strict=True))
    com = centre_of_mass(stance.tree, forward_kinematics(stance.tree, angles, SX(DM(stance.support))))
    outputs = [torque, found.zmp, torso, hip, ca.jtimes(hip, q, qd), ankle, ca.vec(corners), com]
    outputs += [found.wrenches[side] for side in BOTH_FEET]
    return ca.Function("instant", [q, qd, qdd], simplify(outputs))
