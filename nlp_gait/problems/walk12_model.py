"""Motion of the 12-joint walk over one step, and its zero-moment point.

The stance ankle is the origin, x forward, y to the left, z up; the swing leg stands to the right, at y = -w. A step begins and ends in
double support, with the swing foot half a step behind and then half a step ahead.

Source:
    Goswami, Vadakkepat, Phung (2008), sections 3, 4 and 6 and the appendix.
"""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

import casadi as ca
from casadi import DM, SX

from nlp_gait.problems.walk12_robot import PointMassBiped
from nlp_gait.symbolic.balance import zmp_of_point_masses
from nlp_gait.symbolic.inverse_kinematics import knee_cosine, leg_angles
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.symbolic.trajectories import Motion, constant, stack, through

GRAVITY = 9.81  # [m/s^2]

Zmp = Literal["exact", "appendix", "appendix-as-printed"]
ZMPS: tuple[Zmp, ...] = ("exact", "appendix", "appendix-as-printed")


class LegMotion(NamedTuple):
    """One leg.

    Attributes:
        ankle: (3,) [m].
        hip: (3,) [m].
        joints: (5,) ankle roll, ankle pitch, knee, hip pitch, hip roll in the paper's signs [rad]: theta 1, 2, 3, 5, 6 of the stance
            leg and 12, 11, 10, 8, 7 of the swing leg.
        reach: cosine of the knee angle.
    """

    ankle: Motion
    hip: Motion
    joints: Motion
    reach: SX


def ankle_and_hip(x: SX, time: Motion, step_time: SX, robot: PointMassBiped) -> tuple[Motion, Motion]:
    """Positions of the swing ankle P12 and of the stance hip P6 over a step [m].

    Args:
        x: (4,) step length s, frontal shift n, foot lift H, bending height h [m].
        time: t in [0, T] [s].
        step_time: T [s].
        robot: lengths.

    Source:
        Eqs. (4), (6). The printed (4) lifts the foot of the second step below the ground; the sign of the first step is taken for both.
    """
    s, n, lift, bend = ca.vertsplit(x)

    def swing_ankle(t: SX) -> SX:
        forward = s / 2 * ca.sin(math.pi / step_time * (t - step_time / 2))
        return ca.vertcat(forward, -robot.hip_distance_m, lift * ca.sin(math.pi * (forward / s + 0.5)))  # (eq. 4)

    def stance_hip(t: SX) -> SX:
        forward = s / 4 * ca.sin(math.pi / step_time * (t - step_time / 2))
        swell = ca.sin(math.pi / 2 * (ca.sin(t * math.pi / (2 * step_time)) + 1))
        return ca.vertcat(forward, n * swell * ca.sin(math.pi * t / step_time), robot.leg_m - bend)  # (eq. 6)

    return through(swing_ankle, time), through(stance_hip, time)


def legs(x: SX, phase: SX, step_time: SX, margin: SX, robot: PointMassBiped, ops: Nonsmooth) -> tuple[LegMotion, LegMotion]:
    """Stance leg and swing leg at a phase t/T in [0, 1]; margin is that of the reach, see ``Nonsmooth.acos``."""
    time = Motion(phase * step_time, SX(1), SX(0))
    swing_ankle, hip = ankle_and_hip(x, time, step_time, robot)
    stance_ankle = stack(*(constant(0.0) for _ in range(3)))
    across = DM([0.0, -robot.hip_distance_m, 0.0])
    swing_hip = hip._replace(position=hip.position + across)
    return _leg(stance_ankle, hip, margin, robot, ops), _leg(swing_ankle, swing_hip, margin, robot, ops)


def _leg(ankle: Motion, hip: Motion, margin: SX, robot: PointMassBiped, ops: Nonsmooth) -> LegMotion:
    """Joint angles (2), (3), from the same closed form as NAO's legs, which is also right for a deeply bent knee."""
    down = Motion(*(to - fro for to, fro in zip(ankle, hip, strict=True)))
    leg = leg_angles(down, robot.thigh_m, robot.shank_m, margin, ops)
    # From hip roll, hip pitch, knee, ankle pitch, ankle roll.
    paper = DM([[0, 0, 0, 0, 1], [0, 0, 0, -1, 0], [0, 0, 1, 0, 0], [0, -1, 0, 0, 0], [1, 0, 0, 0, 0]])
    return LegMotion(ankle, hip, Motion(*(paper @ part for part in leg.joints)), leg.reach)


def reaches(x: SX, phase: SX, robot: PointMassBiped) -> SX:
    """(2,) cosines of the stance and the swing knee, without the angles: cheap rows for a constraint."""
    ankle, hip = ankle_and_hip(x, Motion(phase, SX(1), SX(0)), SX(1), robot)
    swing = ankle.position - hip.position + DM([0.0, robot.hip_distance_m, 0.0])
    return ca.vertcat(*(knee_cosine(ca.sumsqr(v), robot.thigh_m, robot.shank_m) for v in (hip.position, swing)))


def point_masses(stance: LegMotion, swing: LegMotion, robot: PointMassBiped) -> tuple[DM, Motion]:
    """Masses (7,) [kg] and their motion (3, 7) [m] by exact forward kinematics.

    In order: stance foot, stance knee, stance hip, waist, swing hip, swing knee, swing foot.
    """
    return _masses(robot), _side_by_side(stance, swing, [_up_the_leg(leg, robot) for leg in (stance, swing)])


def _masses(robot: PointMassBiped) -> DM:
    foot, knee, hip = robot.foot_mass_kg, robot.knee_mass_kg, robot.hip_mass_kg
    return DM([foot, knee, hip, robot.waist_mass_kg, hip, knee, foot])


def _up_the_leg(leg: LegMotion, robot: PointMassBiped) -> Motion:
    """(3, 2) foot mass and knee of a leg."""

    def shank(angles: SX) -> SX:
        roll, pitch = angles[0], angles[1]
        up = ca.vertcat(ca.sin(pitch), ca.cos(pitch) * ca.sin(roll), ca.cos(pitch) * ca.cos(roll))
        return up @ DM([robot.foot_com_height_m, robot.shank_m]).T

    return _from_ankle(leg, through(shank, Motion(*(part[:2] for part in leg.joints))))


def _from_ankle(leg: LegMotion, offsets: Motion) -> Motion:
    return Motion(*(ca.repmat(ankle, 1, 2) + offset for ankle, offset in zip(leg.ankle, offsets, strict=True)))


def _side_by_side(stance: LegMotion, swing: LegMotion, shanks: list[Motion]) -> Motion:
    waist = [(a + b) / 2 for a, b in zip(stance.hip, swing.hip, strict=True)]
    orders = zip(shanks[0], stance.hip, waist, swing.hip, shanks[1], strict=True)
    return Motion(*(ca.horzcat(a, hip, w, other, b[:, [1, 0]]) for a, hip, w, other, b in orders))


def zmp(stance: LegMotion, swing: LegMotion, robot: PointMassBiped) -> SX:
    """(2,) zero-moment point relative to the stance ankle [m]."""
    masses, motion = point_masses(stance, swing, robot)
    return zmp_of_point_masses(masses, motion.position, motion.acceleration, GRAVITY)
