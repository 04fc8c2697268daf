"""The robot of the 12-joint walk, links without mass and actuators as point masses; its motion over one step, and its ZMP.

The stance ankle is the origin, x forward, y to the left, z up; the swing leg is the right one, at y = -w. The step begins and
ends in double support, with the swing foot half a step behind and then half a step ahead.

Source:
    Goswami, Vadakkepat, Phung (2008), sections 3, 4 and 6 and the appendix.
"""

import json
import math
from collections.abc import Callable
from dataclasses import dataclass
from functools import cache
from importlib import resources
from typing import Literal, NamedTuple, TypeAlias

import casadi as ca
from casadi import DM, SX

from nlp_gait.decoding import decode
from nlp_gait.symbolic.dynamics import zmp_of_point_masses
from nlp_gait.symbolic.kinematics import axis_rotation, knee_cosine, leg_angles
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.symbolic.trajectories import Motion, constant_motion, map_motion, stack

GRAVITY = 9.81  # [m/s^2]
FILE = resources.files("nlp_gait.gaits.walk12") / "point_mass_biped.json"


@dataclass(frozen=True, slots=True, kw_only=True)
class PointMassBiped:
    """Two legs of a thigh and a shank each, with point masses at knees, hips, waist and feet.

    Source:
        Goswami, Vadakkepat, Phung (2008), section 2.
    """

    name: str  # of the robot
    description: str  # one line
    source: str  # of the numbers
    knee_mass_kg: float  # m1, at each knee
    waist_mass_kg: float  # m2, in the middle between the hips
    foot_mass_kg: float  # m3, at each foot
    hip_mass_kg: float  # m4, at each hip
    thigh_m: float  # d1, hip to knee
    shank_m: float  # d2, knee to ankle
    hip_distance_m: float  # w, between the hips
    foot_com_height_m: float  # L, from the ankle up the shank to the foot's mass
    foot_back_m: float  # Fx1, from the ankle to the rear edge of the sole
    foot_front_m: float  # Fx2, from the ankle to the front edge
    foot_width_m: float  # Fy; the ankle is in the middle

    @property
    def leg_m(self) -> float:
        """Length of a stretched leg, d1 + d2."""
        return self.thigh_m + self.shank_m


@cache
def load_point_mass_biped() -> PointMassBiped:
    """Return the paper's robot."""
    return decode(PointMassBiped, json.loads(FILE.read_text(encoding="utf-8")))


# Definition of the ZMP: (14) with exact forward kinematics; the same with the appendix's approximate positions, misprints
# corrected or (A1) as printed; (14) on a ground below the ankle, whose height the paper does not print; or the point about which
# the moment of gravity and inertia vanishes.
Zmp = Literal["exact", "appendix", "appendix-as-printed", "raised-ankle", "moment-free"]
ANKLE_HEIGHT_M = 0.025  # of "raised-ankle"; with 20 to 25 mm most of the paper's f are met


class Walk12Leg(NamedTuple):
    """One leg."""

    ankle: Motion  # (3,) [m]
    hip: Motion  # (3,) [m]
    # (5,) ankle roll, ankle pitch, knee, hip pitch, hip roll in the paper's signs [rad]: theta 1, 2, 3, 5, 6 of the stance leg
    # and 12, 11, 10, 8, 7 of the swing leg
    joints: Motion
    heading: SX  # (3, 3) rotation of the leg's axes, about z


# From a leg and heights (1, k) above the ankle to (3, k) points of the shank, relative to the ankle and in the leg's axes [m].
Shank: TypeAlias = Callable[[Walk12Leg, DM], Motion]


def compute_ankle_and_hip(x: SX, time: Motion, step_time: SX, robot: PointMassBiped) -> tuple[Motion, Motion]:
    """Return swing ankle P12 and stance hip P6 (3,) [m] over the first step of T [s], for the variables x: s, n, H and h [m]."""
    s, n, lift, bend = ca.vertsplit(x)

    def swing_ankle(t: SX) -> SX:
        share = ca.sin(math.pi / step_time * (t - step_time / 2)) / 2  # P12x / s
        return ca.vertcat(s * share, -robot.hip_distance_m, lift * ca.sin(math.pi * (share + 0.5)))  # (eq. 4)

    def stance_hip(t: SX) -> SX:
        forward = s / 4 * ca.sin(math.pi / step_time * (t - step_time / 2))
        swell = ca.sin(math.pi / 2 * (ca.sin(t * math.pi / (2 * step_time)) + 1))
        return ca.vertcat(forward, n * swell * ca.sin(math.pi * t / step_time), robot.leg_m - bend)  # (eq. 6)

    return map_motion(swing_ankle, time), map_motion(stance_hip, time)


def compute_legs(
    x: SX, phase: SX, step_time: SX, turn: SX, margin: SX, robot: PointMassBiped, ops: Nonsmooth
) -> tuple[Walk12Leg, Walk12Leg]:
    """Return stance and swing leg at a phase t / T, the swing leg yawed at its hip by ``turn``, K [rad], positive to the left."""
    swing_ankle, hip = compute_ankle_and_hip(x, Motion(phase * step_time, SX(1), SX(0)), step_time, robot)
    stance_ankle = stack(constant_motion(0.0), constant_motion(0.0), constant_motion(0.0))
    swing_hip = hip._replace(position=hip.position + _measure_across(robot))
    stance = _solve_leg(stance_ankle, hip, margin, robot, ops)
    swing = _solve_leg(swing_ankle, swing_hip, margin, robot, ops)
    heading = axis_rotation((0.0, 0.0, 1.0), turn)
    ankle = Motion(*(hip + heading @ (ankle - hip) for hip, ankle in zip(swing.hip, swing.ankle, strict=True)))
    return stance, swing._replace(ankle=ankle, heading=heading)


def compute_knee_cosines(x: SX, phase: SX, robot: PointMassBiped) -> SX:
    """Return (2,) cosines of the stance and the swing knee, without the angles: cheap rows for a constraint."""
    ankle, hip = compute_ankle_and_hip(x, Motion(phase, SX(1), SX(0)), SX(1), robot)
    swing = ankle.position - hip.position - _measure_across(robot)
    return ca.vertcat(*(knee_cosine(ca.sumsqr(v), robot.thigh_m, robot.shank_m) for v in (hip.position, swing)))


def list_masses(robot: PointMassBiped) -> DM:
    """Return (7,) masses [kg]: stance foot, stance knee, stance hip, waist, swing hip, swing knee, swing foot."""
    foot, knee, hip = robot.foot_mass_kg, robot.knee_mass_kg, robot.hip_mass_kg
    return DM([foot, knee, hip, robot.waist_mass_kg, hip, knee, foot])


def compute_mass_motion(
    stance: Walk12Leg, swing: Walk12Leg, robot: PointMassBiped, shank: Shank | None = None
) -> Motion:
    """Return (3, 7) the motion of the masses [m], in the order of ``list_masses``; by default with exact forward kinematics."""
    heights = DM([robot.foot_com_height_m, robot.shank_m]).T
    near, far = (_shift_to_ankle(leg, (shank or place_on_exact_shank)(leg, heights)) for leg in (stance, swing))
    orders = zip(near, stance.hip, swing.hip, far, strict=True)
    return Motion(
        *(ca.horzcat(a, p6, (p6 + swing_hip) / 2, swing_hip, b[:, 1], b[:, 0]) for a, p6, swing_hip, b in orders)
    )


def place_on_exact_shank(leg: Walk12Leg, heights: DM) -> Motion:
    """Return points of the shank by forward kinematics; see ``Shank``."""

    def points(angles: SX) -> SX:
        roll, pitch = angles[0], angles[1]
        return ca.vertcat(ca.sin(pitch), ca.cos(pitch) * ca.sin(roll), ca.cos(pitch) * ca.cos(roll)) @ heights

    return map_motion(points, _compute_ankle_angles(leg))


def place_on_appendix_shank(leg: Walk12Leg, heights: DM) -> Motion:
    """Return points of the shank by (A3)-(A6), which take the line from ankle to hip as vertical; see ``Shank``."""
    upward = Motion(*(hip - ankle for hip, ankle in zip(leg.hip, leg.ankle, strict=True)))
    lean = map_motion(lambda v: ca.atan2(v[0], ca.sqrt(v[1] ** 2 + v[2] ** 2)), upward)

    def points(angles: SX) -> SX:
        roll, pitch, bend = angles[0], angles[1], angles[1] - angles[2]  # bend = pi/2 - theta_B
        forward, side = ca.sin(bend) * ca.cos(roll), ca.cos(bend) * ca.sin(roll)
        return ca.vertcat(forward, side, ca.cos(roll) * ca.cos(pitch)) @ heights  # (eqs. A3-A6)

    return map_motion(points, stack(_compute_ankle_angles(leg), lean))


def compute_zmp(stance: Walk12Leg, swing: Walk12Leg, robot: PointMassBiped, reading: Zmp) -> SX:
    """Return (2,) the zero-moment point relative to the stance ankle, on the height of that ankle or as ``reading`` says [m].

    Source:
        Eqs. (12)-(14), (A1)-(A6). As printed, (A1) sums the swing leg with the angles of the stance leg, from x_r.
    """
    m = list_masses(robot)
    motion = compute_mass_motion(
        stance, swing, robot, place_on_appendix_shank if reading.startswith("appendix") else place_on_exact_shank
    )
    static_load = reading != "moment-free"
    above = DM([0.0, 0.0, ANKLE_HEIGHT_M]) if reading == "raised-ankle" else DM.zeros(3)
    position = motion.position if above.is_zero() else motion.position + above
    zmp = zmp_of_point_masses(m, position, motion.acceleration, GRAVITY, static_load=static_load)
    if reading != "appendix-as-printed":
        return zmp
    foot, knee, *hips_and_waist = ca.horzsplit(motion.position[:2, :])[:5]
    x_r = swing.ankle.position[0] - swing.hip.position[0]
    swing_knee, swing_foot = (ca.vertcat(x_r + p[0], -robot.hip_distance_m - p[1]) for p in (knee, foot))
    printed = ca.horzcat(foot, knee, *hips_and_waist, swing_knee, swing_foot)  # (eq. A1)
    return zmp + (printed - motion.position[:2, :]) @ m / float(ca.sum1(m))


def _measure_across(robot: PointMassBiped) -> DM:
    return DM([0.0, -robot.hip_distance_m, 0.0])


def _solve_leg(ankle: Motion, hip: Motion, margin: SX, robot: PointMassBiped, ops: Nonsmooth) -> Walk12Leg:
    """Solve joint angles (2), (3) by the closed form of NAO's legs; unlike (2), it is valid for a folded knee."""
    hip_to_ankle = Motion(*(to - origin for to, origin in zip(ankle, hip, strict=True)))
    angles = leg_angles(hip_to_ankle, robot.thigh_m, robot.shank_m, margin, ops).joints
    # From hip roll, hip pitch, knee, ankle pitch, ankle roll, turning about x and y of the upper link's axes.
    signs = DM([1, -1, 1, -1, 1])
    return Walk12Leg(ankle, hip, Motion(*((signs * order)[::-1] for order in angles)), SX.eye(3))


def _shift_to_ankle(leg: Walk12Leg, points: Motion) -> Motion:
    pairs = zip(leg.ankle, points, strict=True)
    return Motion(*(ca.repmat(ankle, 1, 2) + leg.heading @ offsets for ankle, offsets in pairs))


def _compute_ankle_angles(leg: Walk12Leg) -> Motion:
    return Motion(*(order[:2] for order in leg.joints))
