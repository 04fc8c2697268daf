"""One quantum of time against the same balance of forces in NumPy."""

import casadi as ca
import numpy as np
import pytest
from casadi import SX

from nlp_gait.formulation import Array
from nlp_gait.symbolic.dynamics import EquationsOfMotion
from nlp_gait.symbolic.quantised import (
    Controller,
    Ground,
    QuantisedState,
    advance,
    implicit_quantum,
    solve_definite,
)

QUANTUM = 0.01
# Two links in numbers that have nothing in common.
M, C, G = np.array([[2.0, 0.3], [0.3, 1.5]]), np.array([[0.4, -1.1], [0.7, 0.2]]), np.array([5.0, -3.0])
Q, V, DISTURBANCE = np.array([0.1, -0.2]), np.array([30.0, 40.0]), np.array([0.6, -0.9])
AIM_Q, AIM_V, KP, KD, SHARE = (
    np.array([0.35, 0.05]),
    np.array([25.0, 43.0]),
    np.array([70.0, 90.0]),
    np.array([3.0, 4.0]),
    0.4,
)
JOINTS = np.array([[1.0, 0.0], [-1.0, 1.0]])  # the second angle is measured from the first link
MOTION = EquationsOfMotion(ca.SX(M), ca.SX(C), ca.SX(G))
STATE, AIM = QuantisedState(ca.SX(Q), ca.SX(V)), QuantisedState(ca.SX(AIM_Q), ca.SX(AIM_V))
CONTROL = Controller(ca.SX(KP), ca.SX(KD), ca.SX(SHARE), ca.DM(JOINTS))


def numbers(expression: SX) -> Array:
    return np.array(ca.evalf(expression)).ravel()


def driving(q: Array, v: Array) -> Array:
    """Controller, Coriolis, gravity and disturbance at a state."""
    torque = KP * (JOINTS @ (AIM_Q - q)) + KD * (JOINTS @ (AIM_V - v)) + DISTURBANCE
    return JOINTS.T @ torque + SHARE * G - C @ v - G


@pytest.mark.parametrize(("rate", "kept"), [(1.0, 1.0), (10.0, 1.0 - 1e-8), (100.0, 0.5), (1000.0, 1e-8)])
def test_a_free_link_keeps_its_rate_unless_it_turns_by_a_radian_in_a_quantum(rate: float, kept: float) -> None:
    motion = EquationsOfMotion(SX(0.3), SX(0.0), SX(0.0))
    nothing, ground = Controller(SX(0), SX(0), SX(0), ca.DM.eye(1)), Ground(SX(0), SX(0), SX(0))
    state = QuantisedState(SX(0.2), SX(rate))
    equations = implicit_quantum(motion, state, nothing, state, [], ground, SX(0), QUANTUM)
    following = advance(state, solve_definite(*equations), QUANTUM)
    assert float(ca.evalf(following.v)) / rate == pytest.approx(kept, rel=1e-6)


def test_all_forces_balance_at_the_end_of_the_quantum() -> None:
    ground = Ground(SX(0), SX(0), SX(0))
    equations = implicit_quantum(MOTION, STATE, CONTROL, AIM, [], ground, ca.SX(DISTURBANCE), QUANTUM)
    a = np.linalg.solve(np.array(ca.evalf(equations.mass)), numbers(equations.force))
    q, v = Q + V * QUANTUM + a * QUANTUM**2 / 2, V + a * QUANTUM
    brake = np.diag(M) * (QUANTUM * V) ** 8 * v / QUANTUM
    assert np.abs(brake).max() > 0.01
    assert M @ a == pytest.approx(driving(q, v) - brake, rel=1e-12)


def test_a_quantum_of_constant_acceleration() -> None:
    following = advance(STATE, ca.SX([200.0, -300.0]), QUANTUM)
    assert numbers(following.q) == pytest.approx(Q + V * 0.01 + np.array([0.01, -0.015]))
    assert numbers(following.v) == pytest.approx(V + np.array([2.0, -3.0]))
