"""Joints of NAO that its gaits move, and angles at which its arms are held."""

from __future__ import annotations

LEG_JOINTS = ("HipRoll", "HipPitch", "KneePitch", "AnklePitch", "AnkleRoll")
ARM_JOINTS = ("ShoulderPitch", "ShoulderRoll", "ElbowYaw", "ElbowRoll", "WristYaw")
YAW_PITCHES = ("LHipYawPitch", "RHipYawPitch")  # one motor turns both
# Joints that enter the power (eq. 32): both legs with the hip yaw-pitch, and both arms.
JOINTS = tuple(
    f"{side}{joint}" for part in (("HipYawPitch", *LEG_JOINTS), ARM_JOINTS) for side in "LR" for joint in part
)
PLANNED_JOINTS = tuple(f"{side}{joint}" for side in "LR" for joint in LEG_JOINTS)
KNEES = ("LKneePitch", "RKneePitch")
HELD_ARM_ANGLES = {  # section 3.1 [rad]
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
