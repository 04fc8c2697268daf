"""Joints of NAO that its gaits move, angles at which its arms are held, and the geometry of its legs."""

import math
from typing import NamedTuple

from nlp_gait.errors import InputError
from nlp_gait.robots import Joint, Robot
from nlp_gait.robots.robot import Vector
from nlp_gait.symbolic.rotations import FORWARD, TO_THE_LEFT

LEG_JOINTS = ("HipRoll", "HipPitch", "KneePitch", "AnklePitch", "AnkleRoll")
ARM_JOINTS = ("ShoulderPitch", "ShoulderRoll", "ElbowYaw", "ElbowRoll", "WristYaw")
YAW_PITCHES = ("LHipYawPitch", "RHipYawPitch")  # one motor turns both
# Joints that enter the power (eq. 32): both legs with the hip yaw-pitch, and both arms.
JOINTS = tuple(
    f"{side}{joint}" for names in (("HipYawPitch", *LEG_JOINTS), ARM_JOINTS) for side in "LR" for joint in names
)
PLANNED_JOINTS = tuple(f"{side}{joint}" for side in "LR" for joint in LEG_JOINTS)
KNEES = ("LKneePitch", "RKneePitch")
# Section 3.1 [rad].
HELD_ARM_ANGLES = {
    "LShoulderRoll": 0.26,
    "RShoulderRoll": -0.26,
    "LElbowYaw": -1.5,
    "RElbowYaw": 1.5,
    "LWristYaw": 0.0,
    "RWristYaw": 0.0,
}
# All joints of arms that do not swing: in the middle of Table 3.
RESTING_ARM_ANGLES = HELD_ARM_ANGLES | {
    "LShoulderPitch": 1.5,
    "RShoulderPitch": 1.5,
    "LElbowRoll": -0.53,
    "RElbowRoll": 0.53,
}

# The axis about which each joint must turn.
AXES = dict(zip(LEG_JOINTS, (FORWARD, TO_THE_LEFT, TO_THE_LEFT, TO_THE_LEFT, FORWARD), strict=True))

# Published axes and origins are rounded: 1e-3 rad and 0.1 mm move a foot by less than the 4 mm by which margins reproduce.
AXIS_TOLERANCE, ORIGIN_TOLERANCE_M = 1e-3, 1e-4


class LegGeometry(NamedTuple):
    """Lengths of one leg."""

    hip_m: Vector  # (3,) centre of the hip joints from the torso's origin
    thigh_m: float  # hip to knee
    tibia_m: float  # knee to ankle
    ankle_height_m: float  # ankle above the ground


def measure_leg(robot: Robot, side: str) -> LegGeometry:
    """Measure the leg on side ``"L"`` or ``"R"``; raises InputError if the closed form does not solve it, or UnknownNameError."""
    yaw = robot.joint(f"{side}HipYawPitch")
    roll, pitch, knee, ankle, ankle_roll = (robot.joint(f"{side}{name}") for name in LEG_JOINTS)
    _check_chain(robot, (yaw, roll, pitch, knee, ankle, ankle_roll))
    for joint, name in zip((roll, pitch, knee, ankle, ankle_roll), LEG_JOINTS, strict=True):
        if math.dist(joint.axis, AXES[name]) > AXIS_TOLERANCE:
            raise InputError(
                f"robot {robot.name!r}, joint {joint.name!r}: its axis must be {list(AXES[name])} (x forward, y left, z up, "
                f"at zero angles), got {list(joint.axis)}"
            )
    for joint, above in ((pitch, roll), (ankle_roll, ankle)):
        if math.hypot(*joint.origin_m) > ORIGIN_TOLERANCE_M:
            raise InputError(
                f"robot {robot.name!r}, joint {joint.name!r}: its axis must cross that of {above.name!r}, origin_m "
                f"[0, 0, 0]; got {list(joint.origin_m)}. The closed-form legs have no offset there"
            )
    for joint in (knee, ankle):
        x, y, z = joint.origin_m
        if math.hypot(x, y) > ORIGIN_TOLERANCE_M or not z < 0.0:
            raise InputError(
                f"robot {robot.name!r}, joint {joint.name!r}: at zero angles it must be straight below the joint before it, "
                f"origin_m [0, 0, -length]; got {list(joint.origin_m)}. The closed-form legs have no offset there"
            )
    name = "left" if side == "L" else "right"
    foot = robot.feet[name]
    if foot.link != ankle_roll.child:
        raise InputError(
            f"robot {robot.name!r}, foot {name!r}: its link must be {ankle_roll.child!r}, which joint "
            f"{ankle_roll.name!r} carries, got {foot.link!r}"
        )
    hip = tuple(a + b for a, b in zip(yaw.origin_m, roll.origin_m, strict=True))
    return LegGeometry(hip, -knee.origin_m[2], -ankle.origin_m[2], foot.ankle_height_m)  # type: ignore[arg-type]


def _check_chain(robot: Robot, joints: tuple[Joint, ...]) -> None:
    above = robot.root
    for joint in joints:
        if joint.parent != above:
            raise InputError(
                f"robot {robot.name!r}, joint {joint.name!r}: its parent must be link {above!r}, got {joint.parent!r}; a leg is "
                f"the chain {' - '.join(j.name for j in joints)} from the torso"
            )
        above = joint.child
