"""Link angles of a planned step by closed-form inverse kinematics."""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import casadi as ca
from casadi import SX

from nlp_gait.gaits.stairs.formulas.gait import Stair, StairPlan, ToeFoot, ankle, foot_angles, hip, in_time
from nlp_gait.gaits.stairs.formulas.planar_biped import Rod
from nlp_gait.symbolic.inverse_kinematics import leg_angles
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.symbolic.trajectories import Motion, add_motions, constant_motion, stack


class Posture(NamedTuple):
    """Planned motion of the whole robot at one instant, origin at the stance ankle.

    Attributes:
        q: (7,) absolute link angles in the order of ``loads.MOVING`` [rad], with rates and accelerations.
        reach: (2,) cosines of the swing and the stance knee: above 1 the ankle is out of reach.
        hip: (2,) [m].
        ankle: (2,) of the swing leg [m].
    """

    q: Motion
    reach: SX
    hip: Motion
    ankle: Motion


def posture(
    rods: Mapping[str, Rod],
    plan: StairPlan,
    stair: Stair[SX],
    gravity: float,
    s: SX,
    rates: SX,
    margin: SX,
    ops: Nonsmooth,
) -> Posture:
    """Posture at the fractions s (4,) of the phases, which pass at ``rates`` (4,) [1/s]; symbols s.

    Args:
        rods: of the robot.
        plan: governing parameters.
        stair: steps.
        gravity: [m/s^2].
        s: fractions of the phases, symbols.
        rates: 1 / duration of the phase that passes, 0 for the others.
        margin: reach margin on the cosine of a knee.
        ops: interpretation of acos.
    """
    stance = ca.vertcat(stair.tread, stair.rise)  # of the stance ankle from the rear one
    swing_foot = ToeFoot(rods["AS"].length, rods["ST"].length)
    at_hip = in_time(hip(plan, stair, gravity, s) - stance, s, rates)
    at_ankle = in_time(ankle(plan, stair, swing_foot, s) - stance, s, rates)
    swing, swing_reach = _leg(rods, at_hip, at_ankle, margin, ops)
    support, support_reach = _leg(rods, at_hip, Motion(SX(2, 1), SX(2, 1), SX(2, 1)), margin, ops)
    feet = in_time(ca.vertcat(*foot_angles(plan, s)), s, rates)
    torso = constant_motion(0.0)._replace(position=plan.torso_pitch)
    return Posture(stack(swing, support, torso, feet), ca.vertcat(swing_reach, support_reach), at_hip, at_ankle)


def _leg(rods: Mapping[str, Rod], at_hip: Motion, at_ankle: Motion, margin: SX, ops: Nonsmooth) -> tuple[Motion, SX]:
    """Absolute angles of thigh and shank, and the cosine of the knee."""
    forward_up = [ankle_part - hip_part for ankle_part, hip_part in zip(at_ankle, at_hip, strict=True)]
    leg = leg_angles(
        Motion(*(ca.vertcat(part[0], 0, part[1]) for part in forward_up)),
        rods["HK"].length,
        rods["KA"].length,
        margin,
        ops,
    )
    _, pitch, knee, _, _ = (Motion(*(part[i] for part in leg.joints)) for i in range(5))
    upright = constant_motion(ca.pi / 2)  # a leg that hangs down
    return stack(add_motions(pitch, upright), add_motions(add_motions(pitch, knee), upright)), leg.reach
