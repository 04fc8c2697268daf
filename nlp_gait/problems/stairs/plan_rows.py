"""Constraints of ``stairs-plan``."""

from __future__ import annotations

import casadi as ca
from casadi import DM, MX

from nlp_gait.problem import Constraint, Point
from nlp_gait.problem.blocks import labels
from nlp_gait.problems.stairs.formulas.gait import PHASES
from nlp_gait.problems.stairs.formulas.loads import MOVING
from nlp_gait.problems.stairs.plan_samples import PlannedStep, Samples
from nlp_gait.problems.stairs.robot import toe_foot_biped
from nlp_gait.problems.stairs.stair import ANGLE_LIMITS, KNEE_LIMITS, KNEES, knee_angles
from nlp_gait.symbolic.nonsmooth import Nonsmooth

# Between samples an edge may come nearer than at them, by what falls with the square of their distance: this over the
# square of the intervals in a phase is kept in reserve [m]; a millimetre on the usual grid.
SAMPLING_RESERVE = 0.1


def posture_rows(point: Point, samples: Samples) -> tuple[Constraint, ...]:
    """Reach, link angles, knees and accelerations at every sample."""
    instants = range(samples.q.shape[1])
    m = samples.q.shape[1]
    lower, upper = (MX(DM([ANGLE_LIMITS[link][i] for link in MOVING] * m)) for i in range(2))
    return (
        Constraint(
            name="reach",
            labels=labels(("swing", "stance"), instants),
            unit="1",
            scale=0.1,
            value=ca.vec(samples.reach),
            upper=1 - point["reach_margin"],
        ),
        Constraint(
            name="link_angle",
            labels=labels(MOVING, instants),
            unit="rad",
            scale=0.1,
            value=ca.vec(samples.q),
            lower=lower,
            upper=upper,
        ),
        Constraint(
            name="knee_angle",
            labels=labels(tuple(KNEES), instants),
            unit="rad",
            scale=0.1,
            value=ca.vec(knee_angles(samples.q)),
            lower=MX(KNEE_LIMITS[0]),
            upper=MX(KNEE_LIMITS[1]),
        ),
        Constraint(
            name="link_acceleration",
            labels=labels(MOVING, instants),
            unit="rad/s^2",
            scale=10.0,
            value=ca.vec(samples.qdd),
            lower=-point["acceleration_limit_rad_s2"],
            upper=point["acceleration_limit_rad_s2"],
        ),
    )


def ground_rows(point: Point, samples: Samples) -> tuple[Constraint, ...]:
    """Load, friction and centre of pressure of the stance foot; the rear toe's force has the same direction."""
    instants = range(samples.q.shape[1])
    force, margin = samples.stance_force, point["zmp_margin_m"]
    grip = point["friction"] * force[1, :]
    return (
        Constraint(
            name="stance_load",
            labels=labels(("z",), instants),
            unit="N",
            scale=100.0,
            value=force[1, :].T,
            lower=point["least_stance_force_N"],
        ),
        Constraint(
            name="friction",
            labels=labels(("forward", "backward"), instants),
            unit="N",
            scale=100.0,
            value=ca.vec(ca.vertcat(grip - force[0, :], grip + force[0, :])),
            lower=MX(0),
        ),
        Constraint(
            name="stance_zmp",
            labels=labels(("x",), instants),
            unit="m",
            scale=0.01,
            value=samples.stance_pressure.T,
            lower=margin,
            upper=toe_foot_biped().foot_m - margin,
        ),
    )


def clearance_rows(point: Point, step: PlannedStep, ops: Nonsmooth) -> Constraint:
    """Toe, sole and ankle of the swing foot above the stair while it is in the air."""
    heights = step.clearances(point, ops)
    reserve = SAMPLING_RESERVE / step.per_phase**2
    return Constraint(
        name="clearance",
        labels=labels(("toe", "sole", "ankle"), range(heights.shape[1])),
        unit="m",
        scale=0.01,
        value=ca.vec(heights),
        lower=point["clearance_m"] + reserve,
    )


def phase_rows(point: Point) -> Constraint:
    """Every phase takes time."""
    ends = ca.vertcat(0, *(point[name] for name in ("t1_s", "t2_s", "t_bc_s", "t3_s")))
    return Constraint(
        name="phase_duration",
        labels=PHASES,
        unit="s",
        scale=0.1,
        value=ends[1:] - ends[:-1],
        lower=point["least_phase_s"],
    )
