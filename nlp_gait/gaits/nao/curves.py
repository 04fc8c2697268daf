"""Curves of NAO's phases: those of hip and arms, and what limits the arms."""

from __future__ import annotations

from collections.abc import Callable, Mapping

import casadi as ca
from casadi import SX

from nlp_gait.formulation import InstantPoint
from nlp_gait.gaits.biped.curves import HIP_CURVES, Splines
from nlp_gait.gaits.biped.parts import AngleLimits
from nlp_gait.gaits.nao.body import arm_joints
from nlp_gait.robots import Robot
from nlp_gait.symbolic.trajectories import Motion, add_motions


def hip_and_arm_units(swing: Mapping[str, tuple[float, float]]) -> dict[str, str]:
    """Units of the curves that every phase has: the hip's and those of the arms' joints that swing."""
    return dict.fromkeys(HIP_CURVES, "m") | dict.fromkeys(swing, "rad")


def arm_motions(
    more: Mapping[str, Motion], swing: Mapping[str, tuple[float, float]], duration: SX, phase: SX
) -> dict[str, Motion]:
    """Motions of the arms' joints [rad]: the papers' (see ``body.arm_joints``), and what each curve adds."""
    arms = arm_joints(swing, duration, phase)
    return arms | {joint: add_motions(arms[joint], more[joint]) for joint in swing}


def arm_limits(
    robot: Robot, splines: Splines, swing: Mapping[str, tuple[float, float]], duration: Callable[[InstantPoint], SX]
) -> AngleLimits:
    """Limits of the arms' joints that swing, which a spline can break between the ends of a phase."""

    def angles(at: InstantPoint, phase: SX) -> SX:
        time = duration(at)
        arms = arm_motions(splines.motions(at, time, phase), swing, time, phase)
        return ca.vertcat(*(arms[joint].position for joint in swing))

    return AngleLimits("arm_angle", robot, tuple(swing), angles)
