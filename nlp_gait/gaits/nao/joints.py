"""Joints of NAO that its gaits move, angles at which its arms are held, and the geometry of its legs."""

import math
from typing import NamedTuple

from nlp_gait.errors import InputError
from nlp_gait.robots import Joint, Robot
from nlp_gait.robots.robot import Vector
from nlp_gait.symbolic.kinematics import FORWARD, TO_THE_LEFT

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
CROSSING = ("HipPitch", "AnkleRoll")  # joints whose axis crosses that of the joint before them
BELOW = ("KneePitch", "AnklePitch")  # joints that are straight below the one before them

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
    joints = {name: robot.joint(f"{side}{name}") for name in ("HipYawPitch", *LEG_JOINTS)}
    above = robot.root
    for name, joint in joints.items():
        if (wrong := _find_misfit(name, joint, above)) is not None:
            raise InputError(
                f"robot {robot.name!r}, joint {joint.name!r}: its {wrong}. The legs that are solved in closed form are chains "
                f"{' - '.join(joints)} from the torso, whose hips and ankles have no offsets"
            )
        above = joint.child
    name = "left" if side == "L" else "right"
    foot = robot.feet[name]
    if foot.link != above:
        raise InputError(f"robot {robot.name!r}, foot {name!r}: its link must be {above!r}, got {foot.link!r}")
    yaw, roll, _, knee, ankle, _ = (joint.origin_m for joint in joints.values())
    hip = yaw[0] + roll[0], yaw[1] + roll[1], yaw[2] + roll[2]
    return LegGeometry(hip, -knee[2], -ankle[2], foot.ankle_height_m)


def _find_misfit(name: str, joint: Joint, above: str) -> str | None:
    """Return what is wrong with a joint of a leg that is carried by link ``above``; None if nothing is."""
    x, y, z = joint.origin_m
    if joint.parent != above:
        return f"parent must be link {above!r}, got {joint.parent!r}"
    if name in AXES and math.dist(joint.axis, AXES[name]) > AXIS_TOLERANCE:
        return f"axis must be {list(AXES[name])} (x forward, y left, z up, at zero angles), got {list(joint.axis)}"
    if name in CROSSING and math.hypot(x, y, z) > ORIGIN_TOLERANCE_M:
        return f"axis must cross that of the joint before it, origin_m [0, 0, 0]; got {[x, y, z]}"
    if name in BELOW and (math.hypot(x, y) > ORIGIN_TOLERANCE_M or not z < 0.0):
        return f"place must be straight below the joint before it, origin_m [0, 0, -length]; got {[x, y, z]}"
    return None
