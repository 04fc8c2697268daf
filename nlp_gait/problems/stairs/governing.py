"""Governing parameters of a planned step, by name: variables of ``stairs-plan``, parameters of ``stairs-track``."""

from __future__ import annotations

import math

import casadi as ca
from casadi import MX, SX

from nlp_gait.problem import Parameter, Point, Variable
from nlp_gait.problems.stairs.formulas.gait import StairPlan
from nlp_gait.problems.stairs.stair import within

# Beyond minimum and maximum a plan is none, and its numbers may overflow.
GOVERNING_VARIABLES = (
    Variable(
        name="hip_height_m",
        unit="m",
        lower=0.5,
        upper=0.8,
        description="z_Ci, above the rear ankle at the start",
        minimum=0.1,
        maximum=2.0,
    ),
    Variable(
        name="hip_start_m",
        unit="m",
        lower=-0.1,
        upper=0.25,
        description="hip ahead of the rear ankle at the start",
        minimum=-2.0,
        maximum=2.0,
    ),
    Variable(
        name="zmp_start_m",
        unit="m",
        lower=-0.1,
        upper=0.4,
        description="planned ZMP ahead of the rear ankle",
        minimum=-2.0,
        maximum=2.0,
    ),
    Variable(
        name="zmp_end_m",
        unit="m",
        lower=-0.3,
        upper=0.4,
        description="planned ZMP ahead of the stance ankle",
        minimum=-2.0,
        maximum=2.0,
    ),
    Variable(
        name="end_rate_rad_s",
        unit="rad/s",
        lower=0.0,
        upper=3.0,
        description="rate of the cycloid's angle at t3",
        minimum=-20.0,
        maximum=20.0,
    ),
    Variable(
        name="torso_pitch_rad",
        unit="rad",
        lower=0.8,
        upper=1.75,
        description="q5, from the forward axis",
        minimum=-3.2,
        maximum=3.2,
    ),
    Variable(
        name="t1_s",
        unit="s",
        lower=0.2,
        upper=1.0,
        description="t1, end of the heel's rise",
        minimum=0.0,
        maximum=20.0,
    ),
    Variable(
        name="t2_s",
        unit="s",
        lower=0.6,
        upper=2.0,
        description="t2, end of the double support",
        minimum=0.0,
        maximum=20.0,
    ),
    Variable(
        name="t_bc_s",
        unit="s",
        lower=1.0,
        upper=3.2,
        description="t_bc, the cycloid is caught",
        minimum=0.0,
        maximum=20.0,
    ),
    Variable(
        name="foot_pitch_rad",
        unit="rad",
        lower=0.0,
        upper=0.6,
        description="upward pitch of the foot in the air",
        minimum=-1.6,
        maximum=1.6,
    ),
)
GIVEN_PARAMETERS = (  # Table III
    Parameter(name="t3_s", unit="s", default=3.5, description="t3, end of the step", minimum=0.5),
    Parameter(
        name="sole_angle_rad",
        unit="rad",
        default=math.pi / 6,
        description="theta_a, largest angle of the rear sole",
        minimum=0.0,
        maximum=1.2,
    ),
    Parameter(
        name="toe_angle_rad",
        unit="rad",
        default=math.pi / 6,
        description="theta_b, angle of the rear toe as it lifts",
        minimum=0.0,
        maximum=1.2,
    ),
    Parameter(
        name="catch_angle_rad",
        unit="rad",
        default=0.01,
        description="Delta theta_c0, half of what the bridge covers on the cycloid",
        minimum=1e-4,
        maximum=0.5,
    ),
)
REACH_MARGIN = Parameter(
    name="reach_margin",
    unit="1",
    default=0.005,
    description="knees keep 1 - cos(knee) above this: 0.1 rad",
    minimum=1e-6,
    maximum=0.5,
)
# In the order of StairPlan's fields.
GOVERNING = (*(variable.name for variable in GOVERNING_VARIABLES), *(parameter.name for parameter in GIVEN_PARAMETERS))


def governing(point: Point) -> MX:
    """(14,) governing parameters in the order of GOVERNING, whatever each is in the problem."""
    variables = (within(point, variable) for variable in GOVERNING_VARIABLES)
    return ca.vertcat(*variables, *(point[parameter.name] for parameter in GIVEN_PARAMETERS))


def plan_of(values: SX) -> StairPlan:
    """Plan from its governing parameters (14,)."""
    return StairPlan(*ca.vertsplit(values))
