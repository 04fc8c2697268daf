"""Governing parameters of a planned step, by name: variables of ``stairs-plan``, parameters of ``stairs-track``."""

from __future__ import annotations

import math
from math import inf

import casadi as ca
from casadi import MX, SX

from nlp_gait.formulation import Point, Variable, parameters
from nlp_gait.gaits.stairs.formulas.gait import StairPlan
from nlp_gait.gaits.stairs.stair import within

# Name, unit, description; bounds; minimum and maximum, beyond which no plan makes sense and numbers may overflow.
_TABLE = (
    ("hip_height_m", "m", "z_Ci, above the rear ankle at the start", (0.5, 0.8), (0.1, 2.0)),
    ("hip_start_m", "m", "hip ahead of the rear ankle at the start", (-0.1, 0.25), (-2.0, 2.0)),
    ("zmp_start_m", "m", "planned ZMP ahead of the rear ankle", (-0.1, 0.4), (-2.0, 2.0)),
    ("zmp_end_m", "m", "planned ZMP ahead of the stance ankle", (-0.3, 0.4), (-2.0, 2.0)),
    ("end_rate_rad_s", "rad/s", "rate of the cycloid's angle at t3", (0.0, 3.0), (-20.0, 20.0)),
    ("torso_pitch_rad", "rad", "q5, from the forward axis", (0.8, 1.75), (-3.2, 3.2)),
    ("t1_s", "s", "t1, end of the heel's rise", (0.2, 1.0), (0.0, 20.0)),
    ("t2_s", "s", "t2, end of the double support", (0.6, 2.0), (0.0, 20.0)),
    ("t_bc_s", "s", "t_bc, the cycloid is caught", (1.0, 3.2), (0.0, 20.0)),
    ("foot_pitch_rad", "rad", "upward pitch of the foot in the air", (0.0, 0.6), (-1.6, 1.6)),
)
GOVERNING_VARIABLES = tuple(
    Variable(name=name, unit=unit, lower=lower, upper=upper, description=text, minimum=minimum, maximum=maximum)
    for name, unit, text, (lower, upper), (minimum, maximum) in _TABLE
)
GIVEN_PARAMETERS = parameters(  # Table III
    ("t3_s", "s", 3.5, "t3, end of the step", 0.5, inf),
    ("sole_angle_rad", "rad", math.pi / 6, "theta_a, largest angle of the rear sole", 0.0, 1.2),
    ("toe_angle_rad", "rad", math.pi / 6, "theta_b, angle of the rear toe as it lifts", 0.0, 1.2),
    ("catch_angle_rad", "rad", 0.01, "Delta theta_c0, half of what the bridge covers on the cycloid", 1e-4, 0.5),
)
# Row of a table of parameters.
REACH_MARGIN = ("reach_margin", "1", 0.005, "knees keep 1 - cos(knee) above this: 0.1 rad", 1e-6, 0.5)
# In the order of StairPlan's fields.
GOVERNING = (*(variable.name for variable in GOVERNING_VARIABLES), *(parameter.name for parameter in GIVEN_PARAMETERS))


def governing(point: Point) -> MX:
    """(14,) governing parameters in the order of GOVERNING, whatever each is in the problem."""
    variables = (within(point, variable) for variable in GOVERNING_VARIABLES)
    return ca.vertcat(*variables, *(point[parameter.name] for parameter in GIVEN_PARAMETERS))


def stair_plan(values: SX) -> StairPlan:
    """Plan from its governing parameters (14,)."""
    return StairPlan(*ca.vertsplit(values))
