"""Equations of motion of the nine-link biped: structure, by hand, and an independent oracle."""

import casadi as ca
import numpy as np
import pytest
from casadi import SX

from nlp_gait.gaits.stairs.planar_biped import LINKS, load_toe_foot_biped, make_dynamics

pinocchio = pytest.importorskip("pinocchio")

GRAVITY = 9.81
# Path from the stance ankle: link, what it hangs on, whether it is passed from its far end.
TREE = (
    ("K'A'", None, True),
    ("HK'", "K'A'", True),
    ("UH", "HK'", False),
    ("HK", "HK'", False),
    ("KA", "HK", False),
    ("AS", "KA", False),
    ("ST", "AS", False),
    ("A'S'", None, False),
    ("S'T'", "A'S'", False),
)


@pytest.fixture(scope="module")
def dynamics() -> ca.Function:
    q, qd = SX.sym("q", 9), SX.sym("qd", 9)
    motion = make_dynamics(q, qd, q)
    return ca.Function("dynamics", [q, qd], ca.cse(list(motion)))


@pytest.fixture
def states() -> list[tuple[np.ndarray, np.ndarray]]:
    rng = np.random.default_rng(0)
    return [(rng.uniform(-np.pi, np.pi, 9), rng.uniform(-5.0, 5.0, 9)) for _ in range(30)]


def test_torques_equal_pinocchio(dynamics: ca.Function, states: list) -> None:
    model, joint_of_link = planar_model()
    data = model.createData()
    rng = np.random.default_rng(1)
    for q, qd in states:
        qdd = rng.uniform(-10.0, 10.0, 9)
        M, C, G = (np.array(part) for part in dynamics(q, qd))
        ours = M @ qdd + C @ qd + G.ravel()
        # Absolute angles as joint angles; the generalised forces follow from the same linear map.
        to_joints = joint_of_link
        theirs = to_joints.T @ pinocchio.rnea(model, data, to_joints @ q, to_joints @ qd, to_joints @ qdd)
        assert np.abs(ours - theirs).max() < 1e-8


def planar_model() -> tuple[object, np.ndarray]:
    """Pinocchio model of the same links, and the matrix from absolute link angles to its joint angles.

    Every joint turns clockwise seen with x to the right and z up, that is about +y; a link lies along its own x axis, the
    torso too, whose angle therefore enters with a minus sign. A link passed from its far end lies along -x.
    """
    robot = load_toe_foot_biped()
    model = pinocchio.Model()
    model.gravity = pinocchio.Motion(np.array([0.0, 0.0, -GRAVITY]), np.zeros(3))
    ids: dict[str, int] = {}
    tips: dict[str, np.ndarray] = {}
    signs = {link: -1.0 if link == "UH" else 1.0 for link in LINKS}
    matrix = np.zeros((9, 9))
    for row, (link, parent, from_far_end) in enumerate(TREE):
        part = robot.link(link)
        along = np.array([-1.0 if from_far_end else 1.0, 0.0, 0.0])
        at = tips[parent] if parent else np.zeros(3)
        ids[link] = model.addJoint(
            ids[parent] if parent else 0, pinocchio.JointModelRY(), pinocchio.SE3(np.eye(3), at), link
        )
        inertia = part.mass_kg * part.length_m**2 / 12
        body = pinocchio.Inertia(part.mass_kg, along * part.length_m / 2, np.diag([1e-9, inertia, inertia]))
        model.appendBodyToJoint(ids[link], body, pinocchio.SE3.Identity())
        tips[link] = along * part.length_m
        matrix[row, LINKS.index(link)] = signs[link]
        if parent:
            matrix[row, LINKS.index(parent)] -= signs[parent]
    return model, matrix
