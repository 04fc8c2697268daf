"""Closed-form leg angles: inverse of the forward kinematics, right derivatives, finite everywhere."""

import casadi as ca
import numpy as np
import pytest
from casadi import SX
from hypothesis import assume, example, given
from hypothesis import strategies as st

from nlp_gait.formulation import Array
from nlp_gait.gaits.nao.body import LEG_JOINTS
from nlp_gait.robots import load_robot
from nlp_gait.robots.tree import make_tree
from nlp_gait.symbolic.kinematics import forward_kinematics, leg_angles
from nlp_gait.symbolic.nonsmooth import Exact, Lifted, Nonsmooth
from nlp_gait.symbolic.trajectories import Motion

THIGH, TIBIA, MARGIN = 0.1, 0.1029, 0.01
# Positions of 0.2 m through sines and an arc cosine whose slope is at most 1 / sqrt(2 * MARGIN) here.
POSITION_TOLERANCE_M = 1e-12


def ik(ops: Nonsmooth) -> ca.Function:
    motion = Motion(SX.sym("p", 3), SX.sym("v", 3), SX.sym("a", 3))
    leg = leg_angles(motion, THIGH, TIBIA, SX(MARGIN), ops)
    return ca.Function("ik", list(motion), [*leg.joints, leg.knee_cosine])


def leg_fk() -> ca.Function:
    """From the five angles of the left leg to the ankle from the hip joint, and to the foot's rotation."""
    robot = load_robot("nao-v5")
    names = [f"L{name}" for name in LEG_JOINTS]
    angles = SX.sym("q", 5)
    tree = make_tree(robot, robot.root, ["LHipYawPitch", *names])
    q = {"LHipYawPitch": SX(0), **{name: angles[i] for i, name in enumerate(names)}}
    foot = forward_kinematics(tree, q, SX(3, 1))[-1]
    hip_joint = ca.DM(robot.joint("LHipYawPitch").origin_m)
    return ca.Function("fk", [angles], [foot.position - hip_joint, foot.rotation])


EXACT, LIFTED, FK = ik(Exact()), ik(Lifted(ca.MX(1e-3))), leg_fk()
STILL = np.zeros(3)


def angles(function: ca.Function, *motion: Array) -> tuple[Array, Array, Array, float]:
    q, qd, qdd, reach = function(*motion)
    return np.array(q).ravel(), np.array(qd).ravel(), np.array(qdd).ravel(), float(reach)


@given(
    direction=st.tuples(*[st.floats(-1.0, 1.0)] * 3),
    knee=st.floats(np.arccos(1 - MARGIN), np.arccos(-1 + MARGIN)),
)
def test_forward_kinematics_after_inverse_kinematics_is_the_identity(
    direction: tuple[float, float, float], knee: float
) -> None:
    """For every direction of the ankle but the roll axis, and every bend of the knee within the reach margin."""
    distance = np.sqrt(THIGH**2 + TIBIA**2 + 2 * THIGH * TIBIA * np.cos(knee))
    assume(np.hypot(direction[1], direction[2]) > 0.01)
    ankle = distance * np.array(direction) / np.linalg.norm(direction)
    for function in (EXACT, LIFTED):
        q, _, _, reach = angles(function, ankle, STILL, STILL)
        position, rotation = FK(q)
        np.testing.assert_allclose(np.array(position).ravel(), ankle, rtol=0, atol=POSITION_TOLERANCE_M)
        np.testing.assert_allclose(np.array(rotation), np.eye(3), rtol=0, atol=1e-12)  # the sole is flat
        assert reach == pytest.approx(np.cos(knee), abs=1e-12)
        assert q[2] == pytest.approx(knee, abs=1e-12)  # the knee bends forward


wild = st.tuples(*[st.floats(-1e6, 1e6)] * 3)


@given(position=wild, velocity=wild, acceleration=wild)
@example(position=(0.0, 0.0, 0.0), velocity=(1.0, 1.0, 1.0), acceleration=(1.0, 1.0, 1.0))  # ankle in the hip joint
@example(position=(0.0, 1e-300, 0.0), velocity=(1e6, 1e6, 1e6), acceleration=(0.0, 0.0, 0.0))
@example(position=(0.1, 0.0, 0.0), velocity=(0.0, 1e6, 1e6), acceleration=(1e6, 1e6, 1e6))  # on the roll axis
@example(position=(0.0, 0.0, -0.2029), velocity=(1e6, 1e6, 1e6), acceleration=(1e6, 1e6, 1e6))  # stretched
@example(position=(0.0, 0.0, -0.0029), velocity=(1e6, 1e6, 1e6), acceleration=(1e6, 1e6, 1e6))  # folded
def test_every_finite_input_gives_finite_angles(
    position: tuple[float, ...], velocity: tuple[float, ...], acceleration: tuple[float, ...]
) -> None:
    for function in (EXACT, LIFTED):
        for values in angles(function, np.array(position), np.array(velocity), np.array(acceleration)):
            assert np.isfinite(values).all()


def test_an_unreachable_ankle_is_pointed_at_with_a_straight_and_still_knee() -> None:
    q, qd, qdd, reach = angles(EXACT, np.array([0.0, 0.0, -0.5]), np.ones(3), np.ones(3))
    assert reach > 1.0
    assert (q[2], qd[2], qdd[2]) == (0.0, 0.0, 0.0)
    assert q[1] == 0.0


def test_the_lifted_knee_falls_on_with_the_tangent_beyond_the_margin() -> None:
    """So a solver that stretched the leg too far is drawn back by the slope, instead of losing it."""
    near, far = (angles(LIFTED, np.array([0.0, 0.0, -z]), STILL, STILL)[0][2] for z in (0.25, 0.3))
    assert far < near < np.arccos(1 - MARGIN)


def test_rates_are_damped_within_a_tenth_of_a_millimetre_of_the_roll_axis_only() -> None:
    """Roll rate by hand for a lateral speed of 1 m/s: 1 / length outside, length / (0.1 mm)^2 within."""
    for length, rate in ((2e-4, 5e3), (1e-4, 1e4), (5e-5, 5e3)):
        _, qd, _, _ = angles(EXACT, np.array([0.15, 0.0, -length]), np.array([0.0, 1.0, 0.0]), STILL)
        assert qd[0] == pytest.approx(rate)


def test_a_nearly_folded_leg_of_equal_links_turns_as_a_whole() -> None:
    """Ankle and hip 3 mm apart, thigh and tibia equally long: the hip pitch goes with half the knee, as in any such leg."""
    motion = Motion(SX.sym("p", 3), SX.sym("v", 3), SX.sym("a", 3))
    leg = leg_angles(motion, THIGH, THIGH, SX(0.0), Exact())
    function = ca.Function("equal", list(motion), [*leg.joints, leg.knee_cosine])
    q, qd, _, _ = angles(function, np.array([0.0, 0.0, -3e-3]), np.array([0.0, 0.0, -0.01]), STILL)
    assert q[1] == pytest.approx(-q[2] / 2, abs=1e-12)
    assert qd[1] == pytest.approx(-qd[2] / 2, rel=1e-9)
    assert qd[2] < 0.0
