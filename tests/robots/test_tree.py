"""Links as seen from any of them, locked joints, and point masses; Pinocchio is the witness."""

import casadi as ca
import numpy as np
import pytest
from casadi import SX

from nlp_gait.formulation import Array
from nlp_gait.robots import Robot, load_robot
from nlp_gait.robots.tree import make_point_masses, make_tree, weld
from nlp_gait.symbolic.kinematics import centre_of_mass, forward_kinematics
from tests.pinocchio_oracle import floating_model, inertia

pin = pytest.importorskip("pinocchio")  # needs NumPy 2

ROBOT = load_robot("nao-v5")
HEAD = ("HeadYaw", "HeadPitch")
# Products of a few rotations on lengths below 1 m.
TOLERANCE = 1e-12


def com_seen_from(robot: Robot, link: str, q: dict[str, float]) -> tuple[Array, dict[str, Array]]:
    """Centre of mass and link centres relative to a link's frame."""
    tree = make_tree(robot, link)
    poses = forward_kinematics(tree, {name: SX(angle) for name, angle in q.items()}, SX(3, 1))
    centres = {b.link.name: np.array(ca.DM(p.com)).ravel() for b, p in zip(tree, poses, strict=True)}
    return np.array(ca.DM(centre_of_mass(tree, poses))).ravel(), centres


def random_angles(robot: Robot, seed: int) -> dict[str, float]:
    rng = np.random.default_rng(seed)
    return {name: float(rng.uniform(*joint.limits_rad)) for name, joint in robot.joints.items()}


@pytest.mark.parametrize("link", ["torso", "l_ankle", "RThigh", "LElbow", "Head"])
@pytest.mark.parametrize("seed", [0, 1])
def test_every_link_seen_from_every_link_is_where_pinocchio_puts_it(link: str, seed: int) -> None:
    q = random_angles(ROBOT, seed)
    model = floating_model(ROBOT)
    data = model.createData()
    configuration = pin.neutral(model)
    for name, angle in q.items():
        configuration[model.joints[model.getJointId(name)].idx_q] = angle
    pin.centerOfMass(model, data, configuration)
    joints = {ROBOT.root: ROBOT.root, **{joint.child: name for name, joint in ROBOT.joints.items()}}
    frame = data.oMi[model.getJointId(joints[link])].inverse()
    com, centres = com_seen_from(ROBOT, link, q)
    if link != ROBOT.root:  # the fixed link's axes are the world's; Pinocchio's turn with the joints
        assert not np.allclose(frame.rotation, np.eye(3))
    np.testing.assert_allclose(com, frame * data.com[0], rtol=0, atol=TOLERANCE)
    for name, centre in centres.items():
        expected = frame * (data.oMi[model.getJointId(joints[name])] * np.array(ROBOT.links[name].com_m))
        np.testing.assert_allclose(centre, expected, rtol=0, atol=TOLERANCE)


def test_a_welded_head_is_pinocchios_sum_of_inertias() -> None:
    torso = weld(ROBOT, HEAD).links["torso"]
    total, offset = inertia(ROBOT.links["torso"]), np.zeros(3)
    for name in HEAD:
        offset = offset + np.array(ROBOT.joint(name).origin_m)
        total += pin.SE3(np.eye(3), offset).act(inertia(ROBOT.links[ROBOT.joint(name).child]))
    assert torso.mass_kg == pytest.approx(total.mass, abs=TOLERANCE)
    np.testing.assert_allclose(torso.com_m, total.lever, rtol=0, atol=TOLERANCE)
    np.testing.assert_allclose(torso.inertia_matrix, total.inertia, rtol=0, atol=TOLERANCE)


def test_welding_inner_joints_moves_no_mass() -> None:
    """The order of the names does not matter, nor that one welded joint hangs on another."""
    locked = ["LKneePitch", "LHipPitch", "LElbowRoll"]
    q = random_angles(ROBOT, 3) | dict.fromkeys(locked, 0.0)
    whole, _ = com_seen_from(ROBOT, "torso", q)
    for order in (locked, locked[::-1]):
        welded = weld(ROBOT, order)
        assert set(welded.joints) == set(ROBOT.joints) - set(locked)
        assert welded.mass_kg == pytest.approx(ROBOT.mass_kg)
        np.testing.assert_allclose(com_seen_from(welded, "torso", q)[0], whole, rtol=0, atol=TOLERANCE)


def test_point_masses_keep_mass_and_centre_and_lose_inertia() -> None:
    points = make_point_masses(ROBOT)
    for name, link in ROBOT.links.items():
        assert (points.links[name].mass_kg, points.links[name].com_m) == (link.mass_kg, link.com_m)
        assert not points.links[name].inertia_matrix.any()
