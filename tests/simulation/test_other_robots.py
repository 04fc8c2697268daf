"""Robots without a NAO's data in the engine's terms: same torques, same pressure, what touches what."""

import xml.etree.ElementTree as Xml
from pathlib import Path

import numpy as np
import pytest

import nlp_gait
from nlp_gait.formulation import Array, GaitProblem, Result
from nlp_gait.gaits.stairs.display import compute_ground_force, compute_joint_torques
from nlp_gait.gaits.stairs.planar_biped import MOVING, make_loads
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.joint_controller import GravityCompensation, JointController
from nlp_gait.simulation.mjcf import make_plan_model
from nlp_gait.simulation.plan import make_plan
from nlp_gait.simulation.shapes import Capsule, Prism, make_shapes
from nlp_gait.simulation.simulate import Conditions, SimulationRun, prepare
from tests.robots.crooked import crooked, crooked_urdf

pytest.importorskip("mujoco")

from tests.simulation.inverse_dynamics_oracle import standing_on  # noqa: E402

# Both are double precision; what remains is rounding, of torques of 100 Nm.
AGREEMENT_NM = 1e-9
# Optimum of stairs-plan for case 2, to four digits.
CLIMB = (0.6926, 0.0918, 0.2434, 0.0923, 0.709, 1.4, 0.5763, 0.7783, 1.3287, 0.3169, 0.2)


def result_of(problem: GaitProblem, x: tuple[float, ...] | Array) -> Result:
    return Result(problem=problem, x=problem.check_x(x))


@pytest.fixture(scope="module")
def climb() -> Result:
    return result_of(nlp_gait.load("stairs-plan"), CLIMB)


def test_the_planned_climb_needs_the_torques_of_the_engine(climb: Result) -> None:
    own = climb.problem.signals(climb.x)
    plan = make_plan(climb)
    rear = np.zeros((len(plan.signals.arrays["t"]), 3))
    t = own.arrays["t"]
    new = np.diff(t, prepend=-1.0) > 0.0
    whole = compute_ground_force(*(own.arrays[f"link_{name}"][new][:, : len(MOVING)] for name in ("q", "qd", "qdd")))
    force = whole - own.arrays["stance_force"][new]
    # The engine at the problem's own samples, which are among the dense ones.
    at = np.searchsorted(plan.signals.arrays["t"], t[new] - 1e-9)
    np.testing.assert_allclose(plan.signals.arrays["t"][at], t[new], atol=1e-9)
    rear[at] = np.column_stack([force[:, 0], np.zeros(len(force)), force[:, 1]])
    torques, _ = standing_on(plan.robot, plan.gravity, "left", plan.signals, {"right toe": rear})
    compared = [i for i, name in enumerate(plan.joints) if name != "LToe"]  # it lies still in the model
    planned = plan.signals.arrays["tau"][at][:, compared]
    assert np.abs(planned).max() > 50.0 and np.abs(rear).max() > 20.0
    np.testing.assert_allclose(torques[at][:, compared], planned, atol=AGREEMENT_NM)
    # These are the model's own torques, joint for joint but for the sense of the stance ankle.
    model = own.arrays["tau"][new]
    columns = [list(own.joints).index(name) for name in ("hip'", "knee'", "ankle'", "hip", "knee", "ankle", "toe")]
    senses = np.array([1, 1, -1, 1, 1, 1, 1])
    np.testing.assert_allclose(planned, senses * model[:, columns], atol=AGREEMENT_NM)


def test_the_stairs_are_two_boxes_and_the_root_stays_in_the_plane(climb: Result) -> None:
    root = Xml.fromstring(make_plan_model(make_plan(climb), Drive()))
    boxes = [geometry for geometry in root.findall("./worldbody/geom") if geometry.get("type") == "box"]
    tops = [float(box.get("pos").split()[2]) + float(box.get("size").split()[2]) for box in boxes]  # type: ignore[union-attr]
    rise = 0.508 / 2 * 0.70
    np.testing.assert_allclose(tops, [rise, 2 * rise])
    torso = root.find("./worldbody/body")
    assert torso is not None and not root.findall(".//freejoint")
    assert [joint.get("type") for joint in torso.findall("joint")] == ["slide", "slide", "hinge"]


def test_feet_begin_on_their_treads_and_toes_are_part_of_them(climb: Result) -> None:
    plan = make_plan(climb)
    start = {side: plan.at(f"{side}_foot", np.zeros(1))[0] for side in ("left", "right")}
    for foot in start.values():
        assert foot[2] == pytest.approx(float(plan.level(foot[:1])[0]), abs=1e-9)
    assert start["left"][2] > start["right"][2] == pytest.approx(0.0, abs=1e-9)
    shapes = make_shapes(plan.full_robot)
    assert all(isinstance(shapes[f"{side} {part}"][-1], Prism) for side in start for part in ("sole", "toe"))
    (shank,) = shapes["left shank"]
    assert isinstance(shank, Capsule) and shank.end[2] == pytest.approx(-0.36)  # its round end stays above the ground


def test_a_lean_that_changes_gives_the_torso_a_spin() -> None:
    problem = nlp_gait.load("stairs-track")
    plan = make_plan(result_of(problem, (60.0, 60.0, 1.4)))
    lean = 2 * np.arctan2(*plan.signals.arrays["attitude"][:3, [2, 0]].T)
    rate = np.diff(lean) / np.diff(plan.signals.arrays["t"][:3])
    assert plan.spin_at_start[1] == pytest.approx(1.5 * rate[0] - 0.5 * rate[1], rel=1e-3)
    assert abs(plan.spin_at_start[1]) > 1e-3
    np.testing.assert_allclose(plan.torso_axis(np.zeros(1))[0], [np.sin(lean[0]), 0.0, np.cos(lean[0])], atol=1e-12)


def test_gravity_is_compensated_by_the_torques_that_hold_the_posture_over_the_foremost_foot(climb: Result) -> None:
    plan, controller = make_plan(climb), JointController(kp=100.0, kd=10.0, gravity_compensation=0.5)
    model, data = prepare(plan, Conditions(), Drive(controller=controller))
    compensation = GravityCompensation(controller, plan, model)
    links = climb.problem.signals(climb.x).arrays["link_q"][:1].T
    still, nothing = np.zeros((len(MOVING), 1)), np.zeros((2, 1))
    held = np.array(make_loads("T", "S")(links, still, still, nothing, nothing)[0]).T
    expected = compute_joint_torques(held, np.zeros(1))[0]
    joints = [i for i, name in enumerate(plan.joints) if name != "LToe"]  # which carries no weight behind the foot
    np.testing.assert_allclose(compensation.hold(data)[joints], expected[joints], atol=1e-6)
    shift, steps = compensation.correct(np.zeros(len(plan.joints)), data, 0)
    assert steps == 1
    np.testing.assert_allclose(shift[joints], 0.5 * expected[joints] / 100.0, atol=1e-8)


def test_a_root_on_the_ground_that_is_named_world_is_the_same_robot(tmp_path: Path) -> None:
    """As in ROS: the file's root is the ground, fixed to the base."""
    base = (
        '<link name="world"/><joint name="to_base" type="fixed"><origin xyz="0 0 0.9"/><parent link="world"/>'
        '<child link="base"/></joint></robot>'
    )
    traces = []
    for text in (crooked_urdf(), crooked_urdf().replace("</robot>", base)):
        problem = nlp_gait.load("humanoid-ssp", robot=crooked(tmp_path, text), intervals=2)
        plan = make_plan(result_of(problem, problem.start_point(np.random.default_rng(0))))
        run = SimulationRun(plan)
        assert run.advance(0.05) and run.fell_at_s is None
        traces.append(run.data.qpos.copy())
    assert plan.robot.root == "world_link"
    np.testing.assert_allclose(traces[1][7:], traces[0][7:], atol=1e-6)  # angles; origins of the roots differ
