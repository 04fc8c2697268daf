"""The generated model: masses, limits, shapes; and what is too large to be simulated."""

from xml.etree import ElementTree as Xml

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from nlp_gait import load
from nlp_gait.errors import InputError
from nlp_gait.formulation import Result, Signals
from nlp_gait.formulation.registry import LARGEST_COUNT
from nlp_gait.gaits.nao.body import GRAVITY
from nlp_gait.robots import Link, load_robot
from nlp_gait.robots.tree import TreeBody, list_moments, weld
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.mjcf import add_bodies, make_plan_model
from nlp_gait.simulation.plan import LONGEST_S as LONGEST_PLAYED_S
from nlp_gait.simulation.plan import MOST_STEPS, Plan, make_plan
from nlp_gait.simulation.shapes import Prism, make_shapes

HEAD_JOINTS = ("HeadYaw", "HeadPitch")
NAO = load_robot("nao-v5")


def test_soles_are_the_papers_rectangle():
    rectangle = make_shapes(NAO)["l_ankle"][-1]
    assert isinstance(rectangle, Prism) and rectangle.bottom == -0.04519
    assert sorted(rectangle.outline) == [(-0.05, -0.04), (-0.05, 0.04), (0.1, -0.04), (0.1, 0.04)]


def test_shapes_of_a_welded_head_move_to_the_torso():
    shapes = make_shapes(NAO, welded=HEAD_JOINTS)
    assert "Head" not in shapes and "Neck" not in shapes
    assert any(shape.start == shape.end and shape.start[2] > 0.15 for shape in shapes["torso"])


def test_the_engine_reads_our_masses_to_the_last_digit():
    engine = pytest.importorskip("mujoco")
    robot = weld(NAO, HEAD_JOINTS)
    signals = Signals(joints=tuple(robot.joints), arrays={}, columns={})
    plan = Plan(robot=robot, full_robot=NAO, signals=signals, heat_loss=0.0, gravity=GRAVITY)
    model = engine.MjModel.from_xml_string(make_plan_model(plan, Drive()))
    assert model.body_mass.sum() == pytest.approx(5.30535, abs=1e-12)
    for name, link in robot.links.items():
        body = model.body(name)
        assert body.mass[0] == link.mass_kg and tuple(body.ipos) == link.com_m
        ixx, iyy, izz, ixy, ixz, iyz = link.inertia_com_kgm2
        principal = np.linalg.eigvalsh([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])
        np.testing.assert_allclose(sorted(body.inertia), principal, rtol=1e-9)
    for name, joint in robot.joints.items():
        assert tuple(model.joint(name).range) == joint.limits_rad
    assert model.opt.gravity.tolist() == [0.0, 0.0, -9.8]


@pytest.mark.parametrize("name", ["nao-ssp", "nao-cycle"])
def test_a_grid_is_as_large_as_its_samples(name: str) -> None:
    with pytest.raises(InputError, match=f"at most {LARGEST_COUNT} intervals in all, got intervals "):
        load(name, intervals=LARGEST_COUNT // 10, samples_per_interval=12)
    with pytest.raises(InputError, match="samples_per_interval"):
        load(name, samples_per_interval=LARGEST_COUNT)  # with the intervals that it has by itself


def test_the_length_of_a_simulated_walk_is_limited() -> None:
    walk = load("nao-cycle", intervals=2)
    result, longest = Result(problem=walk, x=walk.upper), f"at most {LONGEST_PLAYED_S:g} s are simulated"
    for steps, words in (
        (60, rf"60 steps of this gait last 360 s, and {longest}"),
        (10**9, f"at most {MOST_STEPS} steps"),
    ):
        with pytest.raises(InputError, match=words):
            make_plan(result, steps)


def test_the_engine_accepts_rods_and_plates_in_any_axes() -> None:
    """Decomposed again, their largest moment may be above the sum of the others by rounding."""
    engine = pytest.importorskip("mujoco")
    for moments in ((3.2e-9, 1.47796e-3, 1.47796e-3 + 3.2e-9), (0.0, 2e-3, 2e-3), (1e-3, 2e-3, 3e-3)):
        for turn in Rotation.random(20, rng=0).as_matrix():
            tensor = list_moments(turn @ np.diag(moments) @ turn.T)
            link = Link(name="link", mass_kg=0.36, com_m=(0.0, 0.0, 0.0), inertia_com_kgm2=tensor)
            zero = (0.0, 0.0, 0.0)
            body = TreeBody(link=link, parent=-1, joint=None, direction=1, offset_m=zero, com_offset_m=zero)
            root = Xml.Element("mujoco")
            add_bodies(Xml.SubElement(root, "worldbody"), [body], {}, root="free")
            found = engine.MjModel.from_xml_string(Xml.tostring(root, encoding="unicode")).body("link").inertia
            np.testing.assert_allclose(np.sort(found), moments, atol=1e-6)
