"""Objective, constraints and indexes of ``stairs-track``."""

from __future__ import annotations

import casadi as ca
import numpy as np
from casadi import DM, MX

from nlp_gait.problem import Assembly, Constraint, Point
from nlp_gait.problem.blocks import labels
from nlp_gait.problems.stairs.closed_loop import QUANTUM, N, Rollout
from nlp_gait.problems.stairs.formulas.planar_biped import LINKS
from nlp_gait.problems.stairs.robot import toe_foot_biped
from nlp_gait.symbolic.nonsmooth import Exact, Nonsmooth

LARGEST_STATE = 1e3  # a rollout beyond this [rad, rad/s] has diverged


def track_rows(point: Point, loop: Rollout, ops: Nonsmooth) -> Assembly:
    """Mean of (53) over all quanta, and how far the ZMP leaves the supporting polygon."""
    quanta = loop.state.shape[1]
    errors = loop.state - loop.desired
    power = loop.torque * loop.state[N:, :]
    below, above = _beyond(point, loop.zmp)
    tolerance = point["tracking_tolerance_rad"]
    exact = Exact()
    tracking, effort = (ca.sum1(ops.abs(ca.vec(part))) / quanta for part in (errors, power))
    outside = ca.sum1(_positive(below, ops) + _positive(above, ops)) / quanta
    finite = exact.abs(ca.sum1(loop.state)) < LARGEST_STATE
    return Assembly(
        objective=tracking + effort + point["zmp_weight"] * outside,
        constraints=(
            Constraint(
                name="tracking",
                labels=labels(LINKS, range(1, quanta + 1)),
                unit="rad",
                scale=0.1,
                value=ca.vec(errors[:N, :]),
                lower=-tolerance,
                upper=tolerance,
            ),
        ),
        indexes={
            "tracking_cost": ca.sum1(exact.abs(ca.vec(errors))) / quanta,
            "energy_J": ca.sum1(exact.abs(ca.vec(power))) * QUANTUM,
            "largest_error_rad": exact.largest(ca.vec(errors[:N, :])),
            "peak_torque_Nm": exact.largest(ca.vec(loop.torque)),
            "zmp_margin_min_m": -ca.mmax(ca.fmax(below, above)),
            "quanta_before_divergence": ca.sum2(finite),
        },
    )


def _beyond(point: Point, zmp: MX) -> tuple[MX, MX]:
    """Distance by which the ZMP lies behind and ahead of the supporting polygon, (m, 1) each [m]; negative inside.

    It reaches from the rear toe in double support, and from the stance ankle in single support, to the stance toe.
    """
    foot = toe_foot_biped().foot_m
    times = DM(np.arange(1, zmp.shape[1] + 1) * QUANTUM)
    rear = (times < point["t2_s"]) * (foot - point["stair_length_m"] / 2)
    return rear - zmp.T, zmp.T - foot


def _positive(v: MX, ops: Nonsmooth) -> MX:
    """Elementwise max(v, 0)."""
    return (v + ops.abs(v)) / 2
