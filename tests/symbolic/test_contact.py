"""Contacts: what is dropped comes to rest, what slides is slowed by mu m g, nothing blows up."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from casadi import SX

from nlp_gait.symbolic.contact import (
    CREEP_SPEED,
    YIELD_DEPTH,
    Contact,
    Equations,
    Ground,
    implicit_equations,
    solve_definite,
)

QUANTUM, GRAVITY = 0.01, 9.81
STIFFNESS, DAMPING, FRICTION = 5e4, 500.0, 0.6


def flight(mass: float, height: float, speed: float, steps: int) -> np.ndarray:
    """States (x, z, xd, zd) of a mass thrown forward above the ground."""
    state = SX.sym("state", 4)
    position, velocity = state[:2], state[2:]
    contact = Contact(position[1], SX([0, 1]), SX([1, 0]))
    ground = Ground(SX(STIFFNESS), SX(DAMPING), SX(FRICTION))
    motion = Equations(mass * SX.eye(2), SX([0, -mass * GRAVITY]))
    a = solve_definite(*implicit_equations(motion, velocity, [contact], ground, QUANTUM))
    after = ca.vertcat(position + velocity * QUANTUM + a * QUANTUM**2 / 2, velocity + a * QUANTUM)
    step = ca.Function("step", [state], [after]).mapaccum(steps)
    return np.array(step([0.0, height, speed, 0.0]))


@pytest.mark.parametrize("mass", [0.15, 0.7, 4.0, 30.0, 51.7])
def test_a_dropped_mass_comes_to_rest_on_its_spring(mass: float) -> None:
    path = flight(mass, 0.05, 0.0, 400)
    assert np.abs(path[2:, -50:]).max() < 1e-6
    yielding = YIELD_DEPTH * np.arctanh(mass * GRAVITY / STIFFNESS / YIELD_DEPTH)
    assert path[1, -1] == pytest.approx(-yielding, abs=1e-4)


def test_friction_slows_a_sliding_mass_and_holds_it() -> None:
    path = flight(5.0, -5.0 * GRAVITY / STIFFNESS, 1.0, 300)
    slowing = np.diff(path[2, 5:15]) / QUANTUM
    assert slowing == pytest.approx(np.full(9, -FRICTION * GRAVITY), rel=0.04)
    assert abs(path[2, -1]) < 0.01 * CREEP_SPEED
    assert 1.0 / (2 * FRICTION * GRAVITY) == pytest.approx(path[0, -1], rel=0.05)


def test_a_lifted_contact_does_not_pull() -> None:
    path = flight(1.0, 0.0, 0.0, 300)
    up = flight(1.0, 1.0, 0.0, 10)
    assert np.diff(up[3]) / QUANTUM == pytest.approx(np.full(9, -GRAVITY))
    assert path[1].max() < 1e-3


def test_solve_of_a_matrix_that_is_not_symmetric() -> None:
    rng = np.random.default_rng(0)
    root = rng.standard_normal((6, 6))
    A, b = root @ root.T + np.eye(6) + root - root.T, rng.standard_normal(6)
    x = np.array(ca.DM(solve_definite(SX(ca.DM(A)), SX(ca.DM(b))))).ravel()
    assert x == pytest.approx(np.linalg.solve(A, b), abs=1e-12)
