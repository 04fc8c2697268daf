"""Inverse dynamics of an upright biped in world coordinates: the torques of the recursion, with narrow bounds over boxes.

Axes and centres of all links are functions of the positions of hips and ankles, and moments are sums of arms times forces. The
recursion passes forces from joint to joint, which multiplies errors over a box. Here the knee follows from the squared distance
of hip and ankle, without an angle.
"""

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import DM, SX

from nlp_gait.robots.robot import Joint, Link
from nlp_gait.symbolic.kinematics import axis_rotation, knee_cosine
from nlp_gait.symbolic.trajectories import Motion, map_motion


class Frame(NamedTuple):
    """Pose of a link in the world."""

    axes: Motion  # (3, 3) motion of the rotation from link axes to world axes
    origin: Motion  # (3,) motion of the origin of the link's frame [m]


class LegFrames(NamedTuple):
    """Frames of a leg under an upright pelvis and over a flat sole: rolled links at hip and ankle, thigh and tibia."""

    hip: Frame
    thigh: Frame
    tibia: Frame
    ankle: Frame


def make_leg_frames(hip: Motion, ankle: Motion, thigh: float, tibia: float, largest_cosine: float = 1.0) -> LegFrames:
    """Return the frames of a leg's links for the motions (3,) of its hip joint and its ankle [m].

    The lengths of thigh and tibia are in metres. Distances beyond the one at the largest cosine of the knee's angle are replaced
    by it, so that nothing is undefined; the result is then wrong.

    Source:
        The pose of Gupta, Pratihar, Deb (2023), eqs. (5)-(14); this form is the package's own.
    """
    farthest = thigh**2 + tibia**2 + 2 * thigh * tibia * largest_cosine

    def columns(v: SX) -> SX:
        """Return the rolled axes, the axes of thigh and tibia, and the knee from the hip, side by side (3, 10)."""
        x, y, z = ca.vertsplit(v)
        length_squared = y * y + z * z
        length = ca.sqrt(length_squared)
        forward, left, upward = SX(DM([1, 0, 0])), ca.vertcat(0, -z, y) / length, ca.vertcat(0, -y, -z) / length
        near = ca.fmin(x * x + length_squared, farthest)
        inverse, cosine = 1 / near, knee_cosine(near, thigh, tibia)
        along = 0.5 + (thigh**2 - tibia**2) / 2 * inverse
        across = thigh * tibia * ca.sqrt(1 - cosine * cosine) * inverse
        out, down = along * x + across * length, along * length - across * x  # of the knee from the hip
        upper = _turn_axes(-out / thigh, down / thigh, forward, left, upward)
        lower = _turn_axes((out - x) / tibia, (length - down) / tibia, forward, left, upward)
        return ca.horzcat(forward, left, upward, upper, lower, out * forward - down * upward)

    moved = map_motion(columns, Motion(*(a - h for a, h in zip(ankle, hip, strict=True))))
    rolled, upper, lower = (Motion(*(order[:, 3 * i : 3 * i + 3] for order in moved)) for i in range(3))
    knee = Motion(*(h + order[:, 9] for h, order in zip(hip, moved, strict=True)))
    return LegFrames(Frame(rolled, hip), Frame(upper, hip), Frame(lower, knee), Frame(rolled, ankle))


def _turn_axes(sine: SX, cosine: SX, forward: SX, left: SX, upward: SX) -> SX:
    """Return (3, 3) axes turned about the second one."""
    return ca.horzcat(cosine * forward - sine * upward, left, sine * forward + cosine * upward)


def make_chain_frames(joints: Sequence[Joint], angles: Mapping[str, Motion], base: Motion) -> dict[str, Frame]:
    """Return the frames of a chain's links, outwards from a base (3,) [m] that does not turn, with angles by joint name [rad]."""
    names = [joint.name for joint in joints]

    def columns(q: SX) -> SX:
        rotation, position, frames = SX.eye(3), SX(3, 1), []
        for i, joint in enumerate(joints):
            position = position + rotation @ DM(joint.origin_m)
            rotation = rotation @ axis_rotation(joint.axis, q[i])
            frames.append(ca.horzcat(rotation, position))
        return ca.horzcat(*frames)

    moved = map_motion(columns, Motion(*(ca.vertcat(*(angles[name][order] for name in names)) for order in range(3))))
    frames = {}
    for i, joint in enumerate(joints):
        axes = Motion(*(order[:, 4 * i : 4 * i + 3] for order in moved))
        frames[joint.child] = Frame(
            axes, Motion(*(o + order[:, 4 * i + 3] for o, order in zip(base, moved, strict=True)))
        )
    return frames


def make_upright_frame(origin: Motion) -> Frame:
    """Return the frame of a link that does not turn."""
    return Frame(Motion(SX.eye(3), SX(3, 3), SX(3, 3)), origin)


def move_wrench(wrench: SX, arm: SX) -> SX:
    """Return wrenches (6, k) about another point, from which ``arm`` (3,) leads to theirs [m]."""
    force = wrench[:3, :]
    moved = (m + ca.cross(arm, f) for m, f in zip(ca.horzsplit(wrench[3:, :]), ca.horzsplit(force), strict=True))
    return ca.vertcat(force, ca.horzcat(*moved))


def link_wrench(link: Link, axes: Motion, acceleration: SX, gravity: float) -> SX:
    """Return the wrench (6, 2) that moves a link, about the origin of its frame: of gravity, and of its motion in unit time.

    In a time T, the second one is divided by T^2. A wrench is a force [N] above a moment [Nm]. Motions are those of the link's
    axes (3, 3) and the acceleration (3,) of its frame's origin, in unit time [m]; gravity acts along -z [m/s^2].

    Source:
        Sum over the link's matter, by its second moments about the frame's origin.
    """
    mass, com, inertia = link.mass_kg, np.array(link.com_m), link.inertia_matrix
    second = np.trace(inertia) / 2 * np.eye(3) - inertia + mass * np.outer(com, com)
    arm, bent = axes.position @ DM(mass * com), axes.acceleration @ DM(second)
    force = mass * acceleration + axes.acceleration @ DM(mass * com)
    moment = sum((ca.cross(axes.position[:, j], bent[:, j]) for j in range(3)), ca.cross(arm, acceleration))
    weight = ca.vertcat(0, 0, mass * gravity, gravity * arm[1], -gravity * arm[0], 0)
    return ca.horzcat(weight, ca.vertcat(force, moment))


def compute_leg_rates(
    hip_to_ankle: Motion, thigh: float, tibia: float, largest_cosine: float
) -> tuple[tuple[SX, ...], SX]:
    """Compute the rates of roll, pitch, knee, ankle pitch and ankle roll, and the squared distance of hip and ankle [m^2].

    From the motion (3,) of the ankle seen from the hip joint and the lengths of both links [m]; see ``make_leg_frames``.

    Source:
        Derivatives of Gupta, Pratihar, Deb (2023), eqs. (5)-(14), as in ``kinematics.leg_angles``.
    """
    (x, y, z), (xd, yd, zd), _ = (ca.vertsplit(order) for order in hip_to_ankle)
    length_squared = y * y + z * z
    length = ca.sqrt(length_squared)
    lengthd = (y * yd + z * zd) / length
    distance_squared = x * x + length_squared
    bent = ca.fmin(distance_squared, thigh**2 + tibia**2 + 2 * thigh * tibia * largest_cosine)
    cosine = knee_cosine(bent, thigh, tibia)
    knee = -(x * xd + y * yd + z * zd) / (thigh * tibia) / ca.sqrt(1 - cosine * cosine)
    roll, inverse = (y * zd - z * yd) / length_squared, 1 / bent
    turn, offset = (x * lengthd - length * xd) * inverse, (thigh**2 - tibia**2) / 2 * inverse
    return (roll, turn - (0.5 - offset) * knee, knee, -turn - (0.5 + offset) * knee, -roll), distance_squared
