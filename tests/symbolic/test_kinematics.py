"""Forward kinematics by hand, on a leg of two links."""

import math

import casadi as ca
import numpy as np
import pytest
from casadi import DM, SX
from hypothesis import given
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from nlp_gait.robots import load_robot
from nlp_gait.robots.tree import make_tree
from nlp_gait.symbolic.kinematics import centre_of_mass, forward_kinematics, relative_rotation
from nlp_gait.symbolic.rotations import axis_rotation

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


def test_a_rotation_about_a_coordinate_axis_costs_a_sine_and_a_cosine() -> None:
    entries = ca.vertsplit(ca.vec(axis_rotation((0.0, 0.0, 1.0), SX.sym("q"))))
    assert sum(not entry.is_constant() for entry in entries) == 4


@pytest.mark.parametrize(("start", "direction"), [("LThigh", 1), ("LTibia", -1)])
def test_a_joint_passed_upwards_turns_the_other_way(start: str, direction: int) -> None:
    first, second = make_tree(ROBOT, start, KNEE)
    assert second.direction == direction
    rotation = np.array(DM(relative_rotation(second, {"LKneePitch": SX(0.3)})))
    expected = Rotation.from_rotvec([0.0, direction * 0.3, 0.0]).as_matrix()
    np.testing.assert_allclose(rotation, expected, rtol=0, atol=ROUNDING)
    np.testing.assert_array_equal(np.array(DM(relative_rotation(first, {}))), np.eye(3))


def test_a_bent_knee_by_hand() -> None:
    """The knee 0.1 m below the thigh's frame at (1, 2, 3), bent by a right angle: the shin points backwards."""
    tree = make_tree(ROBOT, "LThigh", KNEE)
    poses = forward_kinematics(tree, {"LKneePitch": SX(math.pi / 2)}, SX(DM([1, 2, 3])))
    thigh, tibia = (ROBOT.links[name] for name in ("LThigh", "LTibia"))
    (tx, ty, tz), (sx, sy, sz) = thigh.com_m, tibia.com_m
    coms = [np.array([1 + tx, 2 + ty, 3 + tz]), np.array([1 + sz, 2 + sy, 2.9 - sx])]
    for pose, position, com in zip(poses, ([1, 2, 3], [1, 2, 2.9]), coms, strict=True):
        np.testing.assert_allclose(np.array(DM(pose.position)).ravel(), position, rtol=0, atol=ROUNDING)
        np.testing.assert_allclose(np.array(DM(pose.com)).ravel(), com, rtol=0, atol=ROUNDING)
    mean = (thigh.mass_kg * coms[0] + tibia.mass_kg * coms[1]) / (thigh.mass_kg + tibia.mass_kg)
    np.testing.assert_allclose(np.array(DM(centre_of_mass(tree, poses))).ravel(), mean, rtol=0, atol=ROUNDING)


def test_poses_of_another_tree_are_refused() -> None:
    tree = make_tree(ROBOT, "LThigh", KNEE)
    poses = forward_kinematics(tree, {"LKneePitch": SX(0.0)}, SX(3, 1))
    with pytest.raises(ValueError, match="shorter"):
        centre_of_mass(tree, poses[:1])
