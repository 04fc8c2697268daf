"""Rotations, kinematics of a tree of bodies, and a leg with two axes at hip and ankle in closed form."""

from collections.abc import Iterable, Mapping, Sequence
from functools import lru_cache
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from casadi import DM, SX

from nlp_gait.robots.tree import TreeBody
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.symbolic.trajectories import Array, Motion, stack

LEAST_NORM = 1e-20  # keeps norms away from zero, where a pose is out of reach

FORWARD, TO_THE_LEFT, UP = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)  # axes of the world


def axis_rotation(axis: Sequence[float], angle: SX) -> SX:
    """Return the rotation (3, 3) about a fixed unit axis by an angle [rad]."""
    return build_rotation(tuple(axis))(ca.cos(angle), ca.sin(angle))


def turn_quaternion(attitude: Iterable[Any], cos: Any, sin: Any) -> list[Any]:
    """Return an attitude, a quaternion (w, x, y, z), after a rotation about the vertical by twice the angle of cos and sin."""
    w, x, y, z = attitude
    return [cos * w - sin * z, cos * x - sin * y, cos * y + sin * x, cos * z + sin * w]


@lru_cache
def build_rotation(axis: tuple[float, ...]) -> ca.Function:
    """Return the rotation (3, 3) about a fixed unit axis as a function of cosine and sine (Rodrigues), sparse if it can be."""
    k, cos, sin = DM(axis), SX.sym("cos"), SX.sym("sin")
    along = k @ k.T
    return ca.Function("rotation", [cos, sin], [SX(along) + cos * (DM.eye(3) - along) + sin * ca.skew(k)])


def find_rotation(axis: Array, before: SX, after: SX) -> tuple[SX, SX]:
    """Return cosine and sine of the rotation about an axis that takes one vector nearest to another."""
    k = DM(axis)
    cos = ca.dot(before, after) - ca.dot(k, before) * ca.dot(k, after)
    sin = ca.dot(k, ca.cross(before, after))
    scale = 1 / ca.sqrt(ca.fmax(cos**2 + sin**2, LEAST_NORM**2))
    return cos * scale, sin * scale


def invert_turn(turn: tuple[SX, SX]) -> tuple[SX, SX]:
    """Return cosine and sine of the opposite angle."""
    return turn[0], -turn[1]


def rotate_vector(axis: SX, cos: SX, sin: SX, vector: SX) -> SX:
    """Return a vector (3,) after the rotation about a unit axis (Rodrigues)."""
    return cos * vector + sin * ca.cross(axis, vector) + ((1 - cos) * ca.dot(axis, vector)) * axis


def turn_about_vertical(points: Array, yaw: Array) -> Array:
    """Return points (..., 3) turned about the vertical through the origin by angles [rad] of the leading shape."""
    x, y, z = (points[..., i] for i in range(3))
    cos, sin = np.cos(yaw), np.sin(yaw)
    return np.stack(np.broadcast_arrays(cos * x - sin * y, sin * x + cos * y, z), axis=-1)


class Pose(NamedTuple):
    """Pose of a body in the world."""

    rotation: SX  #: (3, 3) from body axes to world axes
    position: SX  #: (3,) reference point of the body [m]
    com: SX  #: (3,) centre of mass [m]


def relative_rotation(body: TreeBody, q: Mapping[str, SX]) -> SX:
    """Return the rotation (3, 3) from a body's axes to those of its parent in the tree; q by joint name [rad]."""
    if body.joint is None:
        return SX.eye(3)
    return axis_rotation(body.joint.axis, body.direction * q[body.joint.name])


def forward_kinematics(tree: Sequence[TreeBody], q: Mapping[str, SX], base: SX) -> list[Pose]:
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


def centre_of_mass(tree: Sequence[TreeBody], poses: Sequence[Pose]) -> SX:
    """Return the centre of mass (3,) of all bodies [m].

    Source:
        Gupta, Pratihar, Deb (2023), eq. (23); (K.4) in docs/model.
    """
    total = sum(body.link.mass_kg for body in tree)
    return sum((body.link.mass_kg * pose.com for body, pose in zip(tree, poses, strict=True)), SX(3, 1)) / total


# A leg folded onto its own hip axis has no roll angle; closer than 0.1 mm its rates are damped, so that they stay finite.
LEAST_LEG_LENGTH = 1e-4


class LegAngles(NamedTuple):
    """Angles of a leg whose pelvis is upright and whose sole is flat."""

    #: (5,) hip roll, hip pitch, knee pitch, ankle pitch, ankle roll [rad] with velocities and accelerations
    joints: Motion
    knee_cosine: (
        SX  #: cosine of the knee angle by the law of cosines: above 1 the ankle is out of reach, 1 a stretched leg
    )


def knee_cosine(distance_squared: SX, thigh: float, tibia: float) -> SX:
    """Return the cosine of the knee angle (0 if stretched) from the squared distance of hip and ankle [m^2]."""
    return (distance_squared - thigh**2 - tibia**2) / (2 * thigh * tibia)


def leg_angles(hip_to_ankle: Motion, thigh: float, tibia: float, margin: SX, ops: Nonsmooth) -> LegAngles:
    """Return the angles, velocities and accelerations of a leg, defined for every finite input.

    Takes the vector (3,) from the hip joint to the ankle in world axes [m], the lengths from hip to knee and from there to the
    ankle [m], and the reach margin on the cosine of the knee angle (see ``Nonsmooth.acos``).

    Source:
        Gupta, Pratihar, Deb (2023), eqs. (5)-(14) with the hip yaw-pitch angle at zero; the arcsine of eq. (9) replaced by the
        two-argument arctangent, rates by differentiating in closed form: (K.5) to (K.17) in docs/model.
    """
    (x, y, z), (xd, yd, zd), (xdd, ydd, zdd) = (ca.vertsplit(vector) for vector in hip_to_ankle)

    # Roll: the leg's plane, from y and z. Length is that of the leg seen along the roll axis.
    length_squared = ca.fmax(y * y + z * z, LEAST_LEG_LENGTH**2)
    length = ca.sqrt(length_squared)
    half_square_rate = y * yd + z * zd
    lengthd = half_square_rate / length
    lengthdd = (yd * yd + zd * zd + y * ydd + z * zdd - lengthd * lengthd) / length
    roll = ca.atan2(y, -z)
    rolld = (y * zd - z * yd) / length_squared
    rolldd = (y * zdd - z * ydd - 2 * rolld * half_square_rate) / length_squared

    # Knee: law of cosines (eq. 6).
    distance_squared = x * x + length_squared
    cosine = knee_cosine(distance_squared, thigh, tibia)
    cosined = (x * xd + half_square_rate) / (thigh * tibia)
    cosinedd = (xd * xd + yd * yd + zd * zd + x * xdd + y * ydd + z * zdd) / (thigh * tibia)
    knee, slope, bend = ops.acos(cosine, margin)
    kneed = slope * cosined
    kneedd = slope * cosinedd + bend * cosined**2

    # Hip pitch: direction of the ankle less the angle between thigh and that direction.
    direction = ca.atan2(-x, length)
    directiond = (x * lengthd - length * xd) / distance_squared
    directiondd = (x * lengthdd - length * xdd - 2 * directiond * (x * xd + half_square_rate)) / distance_squared
    sin_knee, cos_knee = ca.sin(knee), ca.cos(knee)
    span_squared = ca.fmax(thigh**2 + tibia**2 + 2 * thigh * tibia * cos_knee, LEAST_LEG_LENGTH**2)
    share = tibia * (tibia + thigh * cos_knee) / span_squared
    sharek = thigh * tibia * sin_knee * (tibia**2 - thigh**2) / span_squared**2
    pitch = direction - ca.atan2(tibia * sin_knee, thigh + tibia * cos_knee)
    pitchd = directiond - share * kneed
    pitchdd = directiondd - share * kneedd - sharek * kneed**2

    joints = stack(
        Motion(roll, rolld, rolldd),
        Motion(pitch, pitchd, pitchdd),
        Motion(knee, kneed, kneedd),
        Motion(-(pitch + knee), -(pitchd + kneed), -(pitchdd + kneedd)),
        Motion(-roll, -rolld, -rolldd),
    )
    return LegAngles(joints, cosine)
