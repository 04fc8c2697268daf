"""Start of ``stairs-ideal``: link angles of a planned step by inverse kinematics."""

from __future__ import annotations

from functools import cache

import casadi as ca
import numpy as np
from casadi import SX

from nlp_gait.problem import Array
from nlp_gait.problems.stairs.formulas.gait import StairPlan
from nlp_gait.problems.stairs.formulas.posture import posture
from nlp_gait.problems.stairs.formulas.profile import Stair
from nlp_gait.problems.stairs.robot import toe_foot_biped
from nlp_gait.problems.stairs.stair import GRAVITY, PAPER_TIMES
from nlp_gait.symbolic.nonsmooth import Exact

# A plan whose legs reach on common stairs; it need be neither optimal nor balanced.
HIP_HEIGHT, ZMP_START, ZMP_END, END_RATE, TORSO_PITCH = 0.66, 0.18, 0.05, 2.0, 1.35
HIP_BEHIND = 0.08  # the hip starts so far behind the middle of the rear tread [m]
REACH_MARGIN = 0.02  # on the cosine of a knee, which keeps a start off the stretched leg


def planned_angles(tread: float, rise: float, intervals: int) -> Array:
    """(7, intervals + 1) link angles of a plausible step at equidistant times [rad].

    Args:
        tread: of one step [m].
        rise: of one step [m].
        intervals: equal parts of the step.
    """
    ends = np.array([0.0, *PAPER_TIMES])
    times = np.linspace(0.0, ends[-1], intervals + 1)
    fractions = np.clip((times - ends[:-1, None]) / np.diff(ends)[:, None], 0.0, 1.0)
    return np.array(_angles().map(intervals + 1)(np.tile([[tread], [rise]], intervals + 1), fractions))


@cache
def _angles() -> ca.Function:
    """Function (tread and rise (2,), fractions of the phases (4,)) to link angles (7,)."""
    size, s = SX.sym("size", 2), SX.sym("s", 4)
    t1, t2, t_bc, t3 = PAPER_TIMES
    plan = StairPlan(
        hip_height=SX(HIP_HEIGHT),
        hip_start=size[0] / 2 - HIP_BEHIND,
        zmp_start=SX(ZMP_START),
        zmp_end=SX(ZMP_END),
        end_rate=SX(END_RATE),
        torso_pitch=SX(TORSO_PITCH),
        t1=SX(t1),
        t2=SX(t2),
        t_bc=SX(t_bc),
        foot_pitch=SX(0),
        t3=SX(t3),
        sole_angle=SX(np.pi / 6),
        toe_angle=SX(np.pi / 6),
        catch_angle=SX(0.01),
    )
    found = posture(
        toe_foot_biped().rods, plan, Stair(size[0], size[1]), GRAVITY, s, SX(4, 1), SX(REACH_MARGIN), Exact()
    )
    return ca.Function("angles", [size, s], [found.q.position])
