"""Quanta of time against a balance of forces in NumPy; what is dropped comes to rest, what slides is slowed by mu m g."""

import casadi as ca
import numpy as np
import pytest
from casadi import SX

from nlp_gait.formulation import Array
from nlp_gait.gaits.stairs.planar_biped import LINKS, load_toe_foot_biped, locate_centres, locate_points
from nlp_gait.symbolic.dynamics import EquationsOfMotion, equations_of_motion
from nlp_gait.symbolic.quantised import (
    CREEP_SPEED,
    YIELD_DEPTH,
    Contact,
    Controller,
    Equations,
    Ground,
    QuantisedState,
    advance,
    implicit_equations,
    implicit_quantum,
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


HELD = np.array([1.2, 1.9, 1.2, 1.9, 1.4, 0.0, 0.0, 0.0, 0.0])  # both feet side by side, flat
TOUCHING = ("T", "S", "A", "T'", "S'", "A'")  # toe, sole and ankle of both feet
DROP_M, HOLD = 0.05, (2000.0, 200.0)  # how high above the ground, gains that hold every link's angle
AT_REST = 1e-6  # [m/s], [rad/s]
WEIGHT_TOLERANCE = 1e-5  # a contact 1.3 mm deep has faded in but for 1e-6 of its force


@pytest.mark.parametrize("names", [*((name,) for name in TOUCHING), TOUCHING], ids="".join)
def test_the_robot_dropped_on_its_feet_comes_to_rest(names: tuple[str, ...]) -> None:
    """On each contact point alone, and on all six; its weight is what the springs then carry."""
    q, v = SX.sym("q", 11), SX.sym("v", 11)  # stance ankle and nine angles: nothing is fixed
    found = locate_points(q[2:], q[:2])
    middles = locate_centres(found)
    kinetic, potential = SX(0), SX(0)
    for i, link in enumerate(LINKS):
        rod = load_toe_foot_biped().link(link)
        kinetic += (rod.mass_kg * ca.sumsqr(ca.jtimes(middles[link], q, v)) + rod.inertia_kgm2 * v[2 + i] ** 2) / 2
        potential += rod.mass_kg * GRAVITY * middles[link][1]
    motion = equations_of_motion(kinetic, potential, q, v)
    contacts = [
        Contact(found[name][1], ca.jacobian(found[name][1], q).T, ca.jacobian(found[name][0], q).T) for name in names
    ]
    kp, kd = (SX([0.0, 0.0, *[gain] * 9]) for gain in HOLD)
    control = Controller(kp, kd, SX(0), ca.DM.eye(11))
    aim = QuantisedState(SX([0.0, 0.0, *HELD]), SX(11, 1))
    ground = Ground(SX(STIFFNESS), SX(DAMPING), SX(FRICTION))
    equations = implicit_quantum(motion, QuantisedState(q, v), control, aim, contacts, ground, SX(11, 1), QUANTUM)
    following = advance(QuantisedState(q, v), solve_definite(*equations), QUANTUM)
    step = ca.Function("step", [ca.vertcat(q, v)], [ca.cse(ca.vertcat(*following))])
    heights = ca.Function("heights", [q], [ca.vertcat(*(contact.height for contact in contacts))])
    start = np.concatenate([[0.0, DROP_M], HELD, np.zeros(11)])
    path = np.array(step.mapaccum(600)(start))
    assert np.abs(path[11:, -50:]).max() < AT_REST
    depth = -np.array(heights(path[:11, -1])).ravel()
    carried = STIFFNESS * YIELD_DEPTH * np.tanh(np.maximum(depth, 0.0) / YIELD_DEPTH)
    assert carried.sum() == pytest.approx(load_toe_foot_biped().mass_kg * GRAVITY, rel=WEIGHT_TOLERANCE)


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
