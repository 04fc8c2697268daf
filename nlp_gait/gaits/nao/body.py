"""What the NAO problems share: the robot, its joints, and the motion of hip, legs and arms."""

from __future__ import annotations

from collections.abc import Mapping

from casadi import DM, SX, vertcat

from nlp_gait.errors import InputError, UnknownNameError
from nlp_gait.gaits.biped.instant import PlannedInstant
from nlp_gait.gaits.nao.legs import LEG_JOINTS, leg_geometry
from nlp_gait.robots import Robot, load_robot
from nlp_gait.robots.tree import point_masses, weld
from nlp_gait.symbolic.inverse_kinematics import leg_angles
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.symbolic.trajectories import Motion, constant_motion, cubic

GRAVITY = 9.8  # [m/s^2], as in the paper, eq. (27)

ARM_JOINTS = ("ShoulderPitch", "ShoulderRoll", "ElbowYaw", "ElbowRoll", "WristYaw")
# Joints that enter the power (eq. 32): both legs with the hip yaw-pitch, and both arms.
JOINTS = tuple(
    f"{side}{joint}" for part in (("HipYawPitch", *LEG_JOINTS), ARM_JOINTS) for side in "LR" for joint in part
)
PLANNED_JOINTS = tuple(f"{side}{joint}" for side in "LR" for joint in LEG_JOINTS)
HELD_ARM_ANGLES = {  # section 3.1 [rad]
    "LShoulderRoll": 0.26,
    "RShoulderRoll": -0.26,
    "LElbowYaw": -1.5,
    "RElbowYaw": 1.5,
    "LWristYaw": 0.0,
    "RWristYaw": 0.0,
}


def nao(robot: str, rotational_inertia: bool) -> Robot:
    """Robot of a NAO problem: joints that no gait moves are locked at zero, links are point masses if asked for.

    Of NAO these are the head and the neck, which become one with the torso; another robot may have fingers, or no neck.

    Raises:
        InputError: the robot has not the joints that the gait moves, or its legs are of another kind.
    """
    loaded = load_robot(robot)
    try:
        for joint in JOINTS:
            loaded.joint(joint)
    except UnknownNameError as error:
        raise InputError(f"robot {loaded.name!r} does not suit the NAO problems: {error}") from error
    welded = weld(loaded, [joint for joint in loaded.joints if joint not in JOINTS])
    for side in "LR":
        leg_geometry(welded, side)
    return welded if rotational_inertia else point_masses(welded)


def upright_links(robot: Robot) -> frozenset[str]:
    """Links that keep the world's axes: an upright torso, flat soles, and hips whose yaw-pitch joint is held at zero."""
    hips = (robot.joint(f"{side}HipYawPitch").child for side in "LR")
    return frozenset((robot.root, *hips, *(foot.link for foot in robot.feet.values())))


def upright_plan(
    robot: Robot, hip: Motion, ankles: Mapping[str, Motion], arms: Mapping[str, Motion], margin: SX, ops: Nonsmooth
) -> PlannedInstant:
    """Motion of the whole robot under an upright torso: legs in closed form between the hip and both ankles by side."""
    joints: dict[str, Motion] = {}
    reach = []
    for side, ankle in ankles.items():
        geometry = leg_geometry(robot, side)
        hip_to_ankle = Motion(
            ankle.position - hip.position - DM(geometry.hip_m),
            ankle.velocity - hip.velocity,
            ankle.acceleration - hip.acceleration,
        )
        leg = leg_angles(hip_to_ankle, geometry.thigh_m, geometry.tibia_m, margin, ops)
        rows = (Motion(*(part[i] for part in leg.joints)) for i in range(len(LEG_JOINTS)))
        joints |= {f"{side}HipYawPitch": constant_motion(0.0)}
        joints |= {f"{side}{name}": row for name, row in zip(LEG_JOINTS, rows, strict=True)}
        reach.append(leg.reach)
    return PlannedInstant(
        joints={**joints, **arms},
        hip=hip.position,
        ankles={side: ankle.position for side, ankle in ankles.items()},
        reach=vertcat(*reach),
    )


def arm_joints(swing: Mapping[str, tuple[float, float]], duration: SX, phase: SX) -> dict[str, Motion]:
    """Joint motions of both arms: those named in ``swing`` as cubics from rest to rest [rad], the others held."""
    still = SX(0)
    moved = {name: cubic(SX(a), SX(b), still, still, duration, phase) for name, (a, b) in swing.items()}
    return {name: constant_motion(angle) for name, angle in HELD_ARM_ANGLES.items()} | moved
