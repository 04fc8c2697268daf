"""Loads of the stance leg and angles of the moving foot, against the balance of moments and by hand."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from casadi import SX

from nlp_gait.formulation import Array
from nlp_gait.gaits.stairs.planar_biped import (
    ENDS,
    LINKS,
    compute_loads,
    link_angles,
    load_toe_foot_biped,
    locate_points,
)
from nlp_gait.gaits.stairs.planned_motion import StairPlan, compute_foot_angles

GRAVITY, STEP = 9.81, 1e-4
# Differences of positions along a parabola: the third derivative and rounding remain.
TOLERANCE = 1e-5


def positions() -> ca.Function:
    q = SX.sym("q", 7)
    found = locate_points(link_angles(q), SX(2, 1))
    return ca.Function("ends", [q], [ca.horzcat(*(ca.horzcat(found[a], found[b]) for a, b in ENDS.values()))])


def momenta(ends: ca.Function, q: Array, v: Array) -> tuple[Array, float, float]:
    """Momentum (2,), angular momentum about the ankle, and the moment of gravity about it, anticlockwise."""
    before, now, later = (np.array(ends(q + sign * STEP * v)) for sign in (-1, 0, 1))
    momentum, spin, weight = np.zeros(2), 0.0, 0.0
    for k, link in enumerate(ENDS):
        rod = load_toe_foot_biped().link(link)
        middles = [(at[:, 2 * k] + at[:, 2 * k + 1]) / 2 for at in (before, now, later)]
        angles = [np.arctan2(*(at[:, 2 * k + 1] - at[:, 2 * k])[::-1]) for at in (before, later)]
        rate = (middles[2] - middles[0]) / (2 * STEP)
        turn = (angles[1] - angles[0] + np.pi) % (2 * np.pi) - np.pi
        momentum += rod.mass_kg * rate
        spin += rod.mass_kg * (middles[1][0] * rate[1] - middles[1][1] * rate[0]) + rod.inertia_kgm2 * turn / (2 * STEP)
        weight -= rod.mass_kg * GRAVITY * middles[1][0]
    return momentum, spin, weight


@pytest.mark.parametrize("moving", [0.0, 1.0])
def test_force_and_pressure_balance_all_momenta(moving: float) -> None:
    rng = np.random.default_rng(3)
    q = np.array([1.4, 1.9, 1.5, 1.4, 1.2, 0.1, 0.2])[: len(LINKS) - 2] + rng.uniform(-0.1, 0.1, 7)
    v, a = moving * rng.uniform(-1, 1, 7), moving * rng.uniform(-1, 1, 7)
    symbols = [SX.sym(name, 7) for name in ("q", "v", "a")]
    found = compute_loads(*symbols, {})
    force, pressure = map(np.array, ca.Function("loads", symbols, [found.stance_force, found.stance_pressure])(q, v, a))
    ends, mass = positions(), load_toe_foot_biped().mass_kg
    early, late = (momenta(ends, q + sign * STEP * v + a * STEP**2 / 2, v + sign * STEP * a) for sign in (-1, 1))
    _, _, weight = momenta(ends, q, v)
    assert force.ravel() == pytest.approx(
        (late[0] - early[0]) / (2 * STEP) + [0.0, mass * GRAVITY], rel=TOLERANCE, abs=1e-4
    )
    moment = (late[1] - early[1]) / (2 * STEP) - weight
    assert pressure.item() * force[1, 0] == pytest.approx(moment, rel=TOLERANCE, abs=1e-4)


def test_the_foot_lifts_its_sole_then_its_toe_straightens_and_lands_as_it_left() -> None:
    names = ("sole_angle", "toe_angle", "foot_pitch")
    plan = StairPlan(
        **{**dict.fromkeys(StairPlan._fields, SX(1)), **dict(zip(names, map(SX, (0.5, 0.7, 0.2)), strict=True))}
    )
    angles = {
        (0, 0, 0, 0): (0.0, 0.0),
        (1, 0, 0, 0): (0.5, 0.0),
        (1, 1, 0, 0): (0.0, 0.7),
        (1, 1, 1, 0): (-0.2, -0.2),
        (1, 1, 1, 1): (0.0, 0.7),
    }
    for shares, expected in angles.items():
        found = [float(ca.evalf(angle)) for angle in compute_foot_angles(plan, ca.SX(shares))]
        assert found == pytest.approx(expected, abs=1e-12)
