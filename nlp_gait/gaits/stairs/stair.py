"""Definitions shared by the stair problems: the stair, governing parameters of a step, limits, rows of knees and stance foot."""

import math
from collections.abc import Sequence
from math import inf

import casadi as ca
from casadi import MX

from nlp_gait.formulation import Columns, Constraint, Point, Variable, make_parameters, make_vector_columns
from nlp_gait.formulation.assembly import make_labels
from nlp_gait.gaits.stairs.planar_biped import JOINTS, MOVING, load_toe_foot_biped
from nlp_gait.gaits.stairs.planned_motion import Stair, StepKind, list_shank_edges

PAPER_TIMES = (0.5, 1.4, 2.2, 3.5)  # t1, t2, t_bc, t3 [s], Table III
EDGE_WIDTH = 0.003  # of the sigmoid that replaces an edge of the stair [m]
SETBACK = 0.06  # distance of an edge behind the ankle that stands on the step [m]

# Absolute link angles [rad]: leg and foot clockwise from the forward axis, torso counter-clockwise.
ANGLE_LIMITS = {
    "HK": (0.2, 2.4),
    "KA": (0.3, 3.2),
    "HK'": (0.3, 2.4),
    "K'A'": (0.8, 2.8),
    "UH": (0.8, 1.75),
    "AS": (-0.6, 1.2),
    "ST": (-0.6, 1.2),
}
KNEE_LIMITS = (0.1, 2.5)  # [rad]
KNEES = {"knee": ("HK", "KA"), "knee'": ("HK'", "K'A'")}

# Time histories of the stair problems; the plane is sagittal.
COLUMNS = {
    "link_q": Columns(unit="rad", labels=MOVING),
    "link_qd": Columns(unit="rad/s", labels=MOVING),
    "link_qdd": Columns(unit="rad/s^2", labels=MOVING),
    "power": Columns(unit="W", labels=JOINTS),
    "reach": Columns(unit="1", labels=("swing knee", "stance knee")),
    "stance_force": make_vector_columns("N", "xz"),
    **{name: make_vector_columns("m", "x") for name in ("stance_pressure", "zmp")},
    **{name: make_vector_columns("m", "xz") for name in ("hip", "ankle", "stance_ankle")},
    "support": Columns(unit="m", labels=("rear", "front")),
}


STAIR_PARAMETERS = make_parameters(
    ("stair_length_m", "m", 0.508, "length of a double step: two treads (case 2 of Table IV)", 0.05, 2.0),
    ("rise_run_ratio", "1", 0.70, "rise over run", 0.01, 5.0),
)
# Row of a table of parameters.
LEAST_STANCE_FORCE = ("least_stance_force_N", "N", 20.0, "least load of the stance foot", 0.0, inf)


def clip_to_range(point: Point, variable: Variable) -> MX:
    """Return a variable clipped to its minimum and maximum, beyond which no bound may be set."""
    return ca.fmin(ca.fmax(point[variable.name], variable.minimum), variable.maximum)


def read_stair(point: Point) -> Stair[MX]:
    """Tread and rise of one step from the problem's parameters."""
    tread: MX = point["stair_length_m"] / 2
    return Stair(tread, point["rise_run_ratio"] * tread)


def make_rows(
    name: str,
    value: MX,
    of: Sequence[str],
    unit: str,
    scale: float,
    *,
    lower: MX | float | None = None,
    upper: MX | float | None = None,
    columns: Sequence[int] = (),
) -> Constraint:
    """Return rows for quantities ``of`` (r,) at instants ``columns`` (m,), by default from zero; the value is (r, m) [unit]."""
    labels = make_labels(of, columns or range(value.shape[1]))
    column = ca.vec(value)
    least, most = (None if bound is None else MX(bound) for bound in (lower, upper))
    return Constraint(
        name=name, labels=labels, unit=unit, scale=scale, value=column, lower=least, upper=most, over="instant"
    )


def limit_knees(name: str, q: MX) -> Constraint:
    """Return rows for the limits of both knees; q (7, m) are link angles [rad]."""
    knees = (q[MOVING.index(shank), :] - q[MOVING.index(thigh), :] for thigh, shank in KNEES.values())
    return make_rows(name, ca.vertcat(*knees), tuple(KNEES), "rad", 0.1, lower=KNEE_LIMITS[0], upper=KNEE_LIMITS[1])


def limit_grip(name: str, force: MX, friction: MX) -> Constraint:
    """Return |F_x| <= mu F_z of forces (2, m) [N], as two rows each."""
    limit = friction * force[1, :]
    both = ca.vertcat(limit - force[0, :], limit + force[0, :])
    return make_rows(name, both, ("forward", "backward"), "N", 100.0, lower=0.0)


def limit_stance_load(point: Point, force: MX) -> Constraint:
    """Return rows for the least load of the stance foot, with forces (2, m) [N]."""
    return make_rows("stance_load", force[1, :], ("z",), "N", 100.0, lower=point["least_stance_force_N"])


def limit_shanks(gaps: MX, kind: StepKind) -> Constraint:
    """Return rows that keep shanks outside the steps, with gaps (g, m) by ``compute_shank_gaps`` [m]."""
    edges = (f"{'stance' if mark else 'swing'}, step {level}" for mark, level in list_shank_edges(kind))
    return make_rows("shanks", gaps, tuple(edges), "m", 0.01, lower=0.0)


def limit_stance_zmp(point: Point, pressure: MX) -> Constraint:
    """Return rows for the centre of pressure (1, m) [m] within the stance foot, with the margin parameter."""
    margin = point["zmp_margin_m"]
    front = load_toe_foot_biped().foot_m - margin
    return make_rows("stance_zmp", pressure, ("x",), "m", 0.01, lower=margin, upper=front)


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
GIVEN_PARAMETERS = make_parameters(  # Table III
    ("t3_s", "s", 3.5, "t3, end of the step", 0.5, inf),
    ("sole_angle_rad", "rad", math.pi / 6, "theta_a, largest angle of the rear sole", 0.0, 1.2),
    ("toe_angle_rad", "rad", math.pi / 6, "theta_b, angle of the rear toe as it lifts", 0.0, 1.2),
    ("catch_angle_rad", "rad", 0.01, "Delta theta_c0, half of what the bridge covers on the cycloid", 1e-4, 0.5),
)
# Row of a table of parameters.
REACH_MARGIN = ("reach_margin", "1", 0.005, "knees keep 1 - cos(knee) above this: 0.1 rad", 1e-6, 0.5)
# In the order of StairPlan's fields.
GOVERNING = (*(variable.name for variable in GOVERNING_VARIABLES), *(parameter.name for parameter in GIVEN_PARAMETERS))


def collect_governing(point: Point) -> MX:
    """(14,) governing parameters in the order of GOVERNING, variables or parameters of the problem."""
    variables = (clip_to_range(point, variable) for variable in GOVERNING_VARIABLES)
    return ca.vertcat(*variables, *(point[parameter.name] for parameter in GIVEN_PARAMETERS))
