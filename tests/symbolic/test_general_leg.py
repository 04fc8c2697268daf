"""A leg of any six turning joints: its foot is where it should be, its rates are right, and NAO's is the closed form's."""

from dataclasses import replace
from functools import cache

import casadi as ca
import numpy as np
import pytest
from casadi import DM, SX
from scipy.spatial.transform import Rotation

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array
from nlp_gait.gaits.humanoid.body import compute_residuals, count_newton_steps
from nlp_gait.gaits.nao.body import LEG_JOINTS, measure_leg
from nlp_gait.robots import Robot, load_robot
from nlp_gait.robots.biped import make_biped_model
from nlp_gait.robots.leg import Leg
from nlp_gait.robots.tree import make_tree
from nlp_gait.symbolic.general_leg import TorsoMotion, leg_motion, sample_flat_foot_poses
from nlp_gait.symbolic.kinematics import axis_rotation, forward_kinematics, leg_angles
from nlp_gait.symbolic.nonsmooth import Exact
from nlp_gait.symbolic.trajectories import Motion
from tests.robots.crooked import crooked

POSES = 50
# Legs of half a metre: rounding of some twenty rotations, and what Newton's last step leaves.
PLACE_TOLERANCE = 1e-13
# Central differences with a step of 1e-4 s: truncation 1e-8 on accelerations of some rad/s^2.
STEP_S, DIFFERENCE_TOLERANCE = 1e-4, 1e-5


@cache
def leg_function(
    robot: Robot, side: str, point_m: tuple[float, float, float] = (0.0, 0.0, 0.0)
) -> tuple[Leg, ca.Function]:
    """From a point of the torso over the foot's origin with derivatives, and roll and pitch likewise, to the leg's motion."""
    leg = make_biped_model(robot).legs[side]
    place = Motion(*(SX.sym(name, 3) for name in ("p", "v", "a")))
    roll, pitch = (Motion(*(SX.sym(f"{angle}{k}") for k in range(3))) for angle in ("roll", "pitch"))
    turn = axis_rotation((0, 1, 0), pitch.position)
    rotation = turn @ axis_rotation((1, 0, 0), roll.position)
    about, y = turn @ DM([1, 0, 0]), SX(DM([0, 1, 0]))
    spin = y * pitch.velocity + about * roll.velocity
    rate = y * pitch.acceleration + about * roll.acceleration + ca.cross(y, about) * pitch.velocity * roll.velocity
    torso = TorsoMotion(rotation, spin, rate, np.array(point_m), place)
    found = leg_motion(leg, count_newton_steps(leg), torso, SX(0.01), Exact(), held=True)
    return leg, ca.Function("leg", [*place, *roll, *pitch], [*found.joints, found.closure_error, found.knee_cosine])


@pytest.fixture(scope="module")
def robots(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Robot]:
    pytest.importorskip("lxml")
    return {
        "nao": load_robot("nao-v5"),
        "crooked": load_robot(crooked(tmp_path_factory.mktemp("crooked"))),
    }


def pose(leg: Leg, k: int) -> tuple[Array, float, float]:
    """Place of the torso's origin over the foot's [m], roll and pitch, of one of the poses."""
    column = sample_flat_foot_poses(leg, POSES)[:, k]
    rotation = column[3:].reshape(3, 3).T
    pitch, roll = float(np.arctan2(-rotation[2, 0], rotation[0, 0])), float(np.arctan2(-rotation[1, 2], rotation[1, 1]))
    return column[:3] - rotation @ leg.hip_m, roll, pitch


@pytest.mark.parametrize("name", ["nao", "crooked"])
@pytest.mark.parametrize("side", ["left", "right"])
def test_the_foot_is_flat_and_at_the_requested_place(robots: dict[str, Robot], name: str, side: str) -> None:
    """By forward kinematics of the whole robot, from the torso down."""
    robot = robots[name]
    leg, solve = leg_function(robot, side)
    model = make_biped_model(robot).model
    q, tree = SX.sym("q", 6), make_tree(model, model.root)
    angles = {joint: SX(0) for joint in model.joints} | {joint: q[i] for i, joint in enumerate(leg.joints)}
    found = forward_kinematics(tree, angles, SX.zeros(3))[[b.link.name for b in tree].index(model.feet[side].link)]
    ahead = ca.Function("ahead", [q], [found.rotation, found.position])
    for k in range(POSES):
        place, roll, pitch = pose(leg, k)
        solved = solve(place, np.zeros(3), np.zeros(3), roll, 0, 0, pitch, 0, 0)
        rotation, position = (np.array(part) for part in ahead(solved[0]))
        torso = Rotation.from_euler("YX", (pitch, roll)).as_matrix()
        np.testing.assert_allclose(torso @ rotation, np.eye(3), rtol=0, atol=PLACE_TOLERANCE)
        np.testing.assert_allclose(place + torso @ position.ravel(), 0.0, rtol=0, atol=PLACE_TOLERANCE)
        assert float(solved[3]) < PLACE_TOLERANCE


@pytest.mark.parametrize("side", ["left", "right"])
def test_the_guess_is_exact_where_hip_and_ankle_axes_meet(robots: dict[str, Robot], side: str) -> None:
    """Also with axes askew, of which none are parallel or at right angles, and which reach most poses, not all."""
    leg = make_biped_model(robots["crooked"]).legs[side]
    meeting = np.array([*[leg.hip_m] * 3, leg.points[3], *[leg.ankle_m] * 2])
    turns = Rotation.from_rotvec(0.2 * np.random.default_rng(3).standard_normal((6, 3)))
    skew = replace(leg, points=meeting, axes=turns.apply(leg.axes))
    left = compute_residuals(skew, 0, sample_flat_foot_poses(skew, POSES))
    assert np.mean(left < PLACE_TOLERANCE) > 0.6


@pytest.mark.parametrize("name", ["nao", "crooked"])
def test_rates_are_the_derivatives_of_the_angles(robots: dict[str, Robot], name: str) -> None:
    leg, solve = leg_function(robots[name], "left")
    rng = np.random.default_rng(0)
    for k in range(3):
        place, roll, pitch = pose(leg, k)
        v, a = 0.2 * rng.standard_normal(3), rng.standard_normal(3)
        (dr, ddr), (dp, ddp) = 0.3 * rng.standard_normal((2, 2))

        def at(t: float) -> list[Array]:
            h = t * t / 2
            turned = (roll + dr * t + ddr * h, dr + ddr * t, ddr, pitch + dp * t + ddp * h, dp + ddp * t, ddp)  # noqa: B023
            found = solve(place + v * t + a * h, v + a * t, a, *turned)  # noqa: B023
            return [np.array(part).ravel() for part in found]

        before, now, after = at(-STEP_S), at(0.0), at(STEP_S)
        for order in (0, 1):
            slope = (after[order] - before[order]) / (2 * STEP_S)
            np.testing.assert_allclose(now[order + 1], slope, rtol=DIFFERENCE_TOLERANCE, atol=DIFFERENCE_TOLERANCE)


def test_naos_leg_is_the_closed_forms() -> None:
    """To 5e-15 rad in angles; accelerations to the rounding of a system of six equations."""
    robot = load_robot("nao-v5")
    leg, solve = leg_function(robot, "left")
    geometry = measure_leg(robot, "L")
    motion = Motion(*(SX.sym(name, 3) for name in ("p", "v", "a")))
    closed = leg_angles(motion, geometry.thigh_m, geometry.tibia_m, SX(0.01), Exact())
    form = ca.Function("form", list(motion), list(closed.joints))
    rng = np.random.default_rng(1)
    for k in range(POSES):
        place, _, _ = pose(leg, k)
        v, a = 0.1 * rng.standard_normal((2, 3))
        general = solve(place, v, a, *[0.0] * 6)
        expected = form(-place - np.array(geometry.hip_m), -v, -a)
        if not float(general[4]) < 0.99:  # lean and hip offset have moved this pose out of reach
            continue
        for order, tolerance in ((0, 5e-15), (1, 1e-12), (2, 5e-12)):
            found = np.array(general[order]).ravel()
            assert found[0] == pytest.approx(0.0, abs=tolerance)  # the yaw-pitch joint
            np.testing.assert_allclose(found[1:], np.array(expected[order]).ravel(), rtol=0, atol=tolerance)
    assert leg.joints[1:] == tuple(f"L{name}" for name in LEG_JOINTS)


def test_what_is_not_a_leg_is_refused(robots: dict[str, Robot]) -> None:
    leg = make_biped_model(robots["crooked"]).legs["left"]
    parallel = leg.axes.copy()
    parallel[5] = parallel[4]
    flat = leg.axes.copy()
    flat[2] = flat[0]
    for axes, message in ((parallel, "last two must not be parallel"), (flat, "must not lie in one plane")):
        with pytest.raises(InputError, match=message):
            Leg(joints=leg.joints, axes=axes, points=leg.points, foot_m=leg.foot_m, limits_rad=leg.limits_rad)


def test_a_few_poses_may_stay_open_but_not_many() -> None:
    """Right leg of Alexander (example-robot-data 6.0.0), whose hip axes pass each other by 0.16 m."""
    leg = Leg(
        joints=tuple(f"joint_{k}" for k in range(6)),
        axes=np.array([[1, 0, 0], [0, 0, 1], [0, 1, 0], [0, 1, 0], [0, 1, 0], [1, 0, 0]], dtype=float),
        points=np.array(
            [
                (-0.162, -0.0595, -0.015),
                (-0.102, -0.1595, -0.095),
                (0.0025, -0.1022, -0.1475),
                *((0.0025, -0.1202, z) for z in (-0.4675, -0.8775, -0.8895)),
            ]
        ),
        foot_m=np.array([0.0025, -0.1202, -0.8895]),
        limits_rad=np.array([(-0.87, 0.35), (-1.05, 0.35), (-2.62, 0.79), (0.0, 2.45), (-1.05, 0.52), (-0.44, 0.44)]),
    )
    assert count_newton_steps(leg) == 5
    apart = leg.points + np.array([(0.0, 0.0, 0.5), (0.5, 0.0, 0.0), *np.zeros((4, 3))])
    with pytest.raises(InputError, match=r"is not solved in 8 Newton steps: its hip axes pass each other too far"):
        count_newton_steps(replace(leg, points=apart))
