"""Limits of a gait's phases that ship, and what your own are made of.

A limit is a class with ``add``, which returns rows. ``problem.with_limits(single_support=[FrictionCone()])`` adds one; so do
``load("nao-ssp", limits="FrictionCone")`` and, on the command line, ``--limit FrictionCone`` and ``--limit FILE.py:NAME``.
"""

import math
from collections.abc import Mapping

import casadi as ca
from casadi import MX

from nlp_gait.formulation import Constraint, Parameter, Point
from nlp_gait.formulation.assembly import make_parameters
from nlp_gait.gaits.biped.limits import Limit, RowsAndMetrics, make_rows, make_rows_at_samples
from nlp_gait.gaits.biped.samples import BOTH_FEET, CORNERS, Samples
from nlp_gait.symbolic.nonsmooth import Nonsmooth

SMOOTH_N = 1e-6  # [N]; smaller forces are rounding


class FrictionCone(Limit):
    """Tangential force of each standing sole within the friction coefficient times its normal force.

    The tangential force is sqrt(f_x^2 + f_y^2 + e^2) with e = 1e-6 N, which is smooth where the force vanishes. Metrics: the
    friction that the gait needs, its largest ratio of tangential to normal force.

    Source:
        Kajita, Hirukawa, Harada, Yokoi (2014), "Introduction to Humanoid Robotics", section 3.2: a foot does not slip while the
        ground's force is within the cone of Coulomb's friction.
    """

    reads = (Samples.wrench_left, Samples.wrench_right)
    parameters = make_parameters(("friction_coefficient", "1", 0.6, "of both soles on the ground", 0.0, math.inf))

    def add(self, point: Point, samples: Samples, ops: Nonsmooth) -> RowsAndMetrics:
        rows, ratios = [], []
        for side in samples.standing:
            force = samples.wrench(side)[:3, :]
            tangential = ca.sqrt(force[0, :] ** 2 + force[1, :] ** 2 + SMOOTH_N**2)
            slack = point["friction_coefficient"] * force[2, :] - tangential
            rows.append(make_rows_at_samples("friction", "N", slack, (BOTH_FEET[side],), MX(0.0)))
            ratios.append(ca.mmax(tangential / ca.fmax(force[2, :], SMOOTH_N)))
        return rows, {
            f"{BOTH_FEET[side]}_friction": ratio for side, ratio in zip(samples.standing, ratios, strict=True)
        }


class FootClearance(Limit):
    """Sole of the swinging foot above the ground by at least h(s) = 16 c s^2 (1 - s)^2, where s is the share of the swing's time.

    It vanishes with its slope at both ends, and is the clearance c in the middle. Heights are above the standing sole: of a flat
    sole, or of the four corners of one that may tilt. A phase in which both feet stand has no rows of it.

    Source:
        This package's own; c is a parameter. That toes need clearance in mid-swing: Winter (1992), "Foot trajectory in human
        gait", Physical Therapy 72(1).
    """

    reads = (Samples.swing_heights,)
    parameters = make_parameters(
        ("foot_clearance_m", "m", 0.01, "of the swinging sole in the middle of its swing", 0.0, math.inf)
    )

    def add(self, point: Point, samples: Samples, ops: Nonsmooth) -> RowsAndMetrics:
        if len(samples.standing) > 1:
            return [], {}
        s, heights = samples.progress[1:-1], samples.swing_heights[:, 1:-1]
        points = CORNERS if heights.shape[0] > 1 else ("sole",)
        needed = point["foot_clearance_m"] * 16 * s**2 * (1 - s) ** 2
        above = heights - ca.repmat(needed, len(points), 1)
        return [make_rows_at_samples("foot_clearance", "m", above, points, MX(0.0), first=1)], {
            "foot_clearance_m": ca.mmax(samples.swing_heights)
        }


# Those that ``--limit`` takes by name.
LIMITS: Mapping[str, type[Limit]] = {limit.__name__: limit for limit in (FrictionCone, FootClearance)}
__all__ = [
    "CORNERS",
    "Constraint",
    "Limit",
    "Nonsmooth",
    "Parameter",
    "Point",
    "RowsAndMetrics",
    "Samples",
    "make_parameters",
    "make_rows",
    "make_rows_at_samples",
    *LIMITS,
]
