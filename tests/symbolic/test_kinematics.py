"""Forward kinematics by hand, on a leg of two links."""

import math

import numpy as np
import pytest
from casadi import DM, SX
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from nlp_gait.robots import load_robot
from nlp_gait.robots.tree import make_tree
from nlp_gait.symbolic.kinematics import axis_rotation, relative_rotation

# Products of sines and cosines.
ROUNDING = 1e-12
ROBOT = load_robot("nao-v5")
KNEE = ["LKneePitch"]


@given(
    axis=st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda axis: math.hypot(*axis) > 1e-3),
    angle=st.floats(-10.0, 10.0),
)
def test_a_rotation_is_that_of_scipy(axis: tuple[float, float, float], angle: float) -> None:
    unit = np.array(axis) / np.linalg.norm(axis)
    expected = Rotation.from_rotvec(angle * unit).as_matrix()
    np.testing.assert_allclose(np.array(DM(axis_rotation(unit.tolist(), SX(angle)))), expected, rtol=0, atol=ROUNDING)


@pytest.mark.parametrize(("start", "direction"), [("LThigh", 1), ("LTibia", -1)])
def test_a_joint_passed_upwards_turns_the_other_way(start: str, direction: int) -> None:
    first, second = make_tree(ROBOT, start, KNEE)
    assert second.direction == direction
    rotation = np.array(DM(relative_rotation(second, {"LKneePitch": SX(0.3)})))
    expected = Rotation.from_rotvec([0.0, direction * 0.3, 0.0]).as_matrix()
    np.testing.assert_allclose(rotation, expected, rtol=0, atol=ROUNDING)
    np.testing.assert_array_equal(np.array(DM(relative_rotation(first, {}))), np.eye(3))
