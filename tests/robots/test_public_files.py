"""What public robot files have: each is read right, or one sentence says what to change."""

import re
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import casadi as ca
import mujoco
import numpy as np
import pytest
from casadi import DM, SX

from nlp_gait.backends.exact import build_exact_model
from nlp_gait.errors import InputError, RobotDataError
from nlp_gait.formulation import load
from nlp_gait.gaits.humanoid.body import list_joints, make_humanoid
from nlp_gait.robots import load_robot
from nlp_gait.robots.biped import Biped, make_biped_model
from nlp_gait.robots.robot import ANY_ANGLE
from nlp_gait.robots.tree import make_tree
from nlp_gait.simulation.mjcf import add_bodies
from nlp_gait.symbolic.dynamics import newton_euler
from tests.robots.crooked import TORSO_KG, crooked, crooked_urdf

Change = Callable[[str], str]
BOX = re.search(r"<box size=[^>]*>", crooked_urdf())[0]  # type: ignore[index]
BASE = TORSO_KG * 0.25**2 / 6.0  # moment of inertia of the torso
LIMIT = 'effort="60.0" velocity="6.0"/>'


def change(old: str, new: str, count: int = -1) -> Change:
    def changed(text: str) -> str:
        assert old in text
        return text.replace(old, new, count)

    return changed


def inside(joint: str, old: str, new: str) -> Change:
    """Change one joint of the URDF."""

    def changed(text: str) -> str:
        begin = text.index(f'<joint name="{joint}"')
        end = text.index("</joint>", begin) + len("</joint>")
        assert old in text[begin:end]
        return text[:begin] + text[begin:end].replace(old, new) + text[end:]

    return changed


def read(folder: Path, *changes: Change, name: str = "crooked.urdf") -> Biped:
    text = crooked_urdf()
    for apply in changes:
        text = apply(text)
    (folder / name).write_text(text, encoding="utf-8")
    return make_biped_model(load_robot(str(folder / name)))


@pytest.fixture(scope="module")
def plain(tmp_path_factory: pytest.TempPathFactory) -> Biped:
    return read(tmp_path_factory.mktemp("plain"))


@pytest.mark.parametrize("weak", ["A_ankle_pitch", "B_ankle_pitch"])
def test_both_sides_have_the_tighter_limits(tmp_path: Path, plain: Biped, weak: str) -> None:
    biped = read(
        tmp_path,
        inside(weak, "60.0", "25"),
        inside("B_hip_roll", 'upper="0.5"', 'upper="0.3"'),
        inside("A_knee", "6.0", "4"),
    )
    for side in "AB":
        assert biped.model.joint(f"{side}_ankle_pitch").torque_limit_Nm == 25.0
        assert biped.model.joint(f"{side}_knee").velocity_limit_rad_s == 4.0
    # The roll axes are mirrored: turning to one side is positive for one leg and negative for the other.
    assert biped.model.joint("A_hip_roll").planning_limits_rad == (-0.3, 0.5)
    assert biped.model.joint("B_hip_roll").planning_limits_rad == (-0.5, 0.3)
    assert biped.model.joint("A_hip_roll").limits_rad == (-0.5, 0.5)
    assert any("A_ankle_pitch and B_ankle_pitch have different limits of torque" in note for note in biped.full.notes)
    assert not biped.differences and not plain.differences


def test_the_table_of_joints_has_both_sides_where_they_differ(tmp_path: Path) -> None:
    read(tmp_path, inside("B_ankle_pitch", "60.0", "25"))
    rows = {row[0]: row for row in list_joints(make_humanoid(str(tmp_path / "crooked.urdf")))}
    assert rows["A_ankle_pitch"] == ("A_ankle_pitch", "-1.2", "0.9", "60 / 25", "6", "0", "0")
    assert rows["A_hip_roll"] == ("A_hip_roll", "-0.5", "0.5", "60", "6", "0", "0")


@pytest.mark.parametrize(
    ("heavier", "what"),
    [
        (
            lambda text: re.sub(
                r'(B_knee_link"><inertial><origin[^>]*>)<mass value="1.1"', r'\1<mass value="1.3"', text
            ),
            "masses",
        ),
        (
            lambda text: re.sub(r'(B_hip_pitch_link"><inertial><origin xyz=")0.002', r"\g<1>0.02", text),
            "centres of mass",
        ),
        (inside("B_hip_yaw", "0.01 -0.08 -0.05", "0.015 -0.08 -0.05"), "axes of A_hip_yaw and B_hip_yaw by 5.0 mm"),
    ],
)
def test_different_sides_are_planned_step_by_step(tmp_path: Path, heavier: Change, what: str) -> None:
    path, biped = str(tmp_path / "crooked.urdf"), read(tmp_path, heavier)
    assert what in " ".join(biped.differences)
    with pytest.raises(InputError, match=f"left and right differ: .*{what}.*set alike=true"):
        load("humanoid-cycle", robot=path)
    assert load("humanoid-walk", robot=path, steps=2, footholds="0.1,-0.1,0,0;0.1,0.1,0,0").variables


def test_collada_points_are_taken_as_they_are(tmp_path: Path, plain: Biped) -> None:
    corners = " ".join(f"{x} {y} {z}" for x in (-0.085, 0.085) for y in (-0.045, 0.045) for z in (-0.01, 0.01))
    for up in ("<up_axis>Y_UP</up_axis>", "<up_axis>Z_UP</up_axis>", ""):
        (tmp_path / "sole.dae").write_text(
            f'<COLLADA xmlns="http://www.collada.org/2005/11/COLLADASchema"><asset>{up}</asset><library_geometries>'
            f'<geometry id="g"><mesh><source id="s"><float_array>{corners}</float_array></source><vertices>'
            '<input semantic="POSITION" source="#s"/></vertices></mesh></geometry></library_geometries></COLLADA>'
        )
        assert read(tmp_path, change(BOX, '<mesh filename="sole.dae"/>')).model.feet == plain.model.feet


def test_the_place_of_an_origin_on_its_axis_does_not_matter(tmp_path: Path, plain: Biped) -> None:
    """The roll axis is given 8 cm ahead of the ankle, and the pitch axis of one hip 1 cm further out."""
    biped = read(
        tmp_path,
        lambda text: re.sub(r'(_ankle_roll" type="revolute"><origin xyz=")0.004', r"\g<1>0.084", text),
        lambda text: re.sub(r'(_ankle_roll_link"><inertial><origin xyz=")0.002', r"\g<1>-0.078", text),
        change('<collision><origin xyz="0.02', '<collision><origin xyz="-0.06'),
        inside("B_hip_pitch", "0.005 -0.01", "0.005 -0.02"),
        inside("B_knee", "0.01 -0.003", "0.01 0.007"),
        lambda text: re.sub(r'(B_hip_pitch_link"><inertial><origin xyz="0.002 )-0.004', r"\g<1>0.006", text),
    )
    assert not biped.differences
    for side in ("left", "right"):
        for edge in ("ankle_height_m", "front_m", "back_m", "left_m", "right_m"):
            assert getattr(biped.model.feet[side], edge) == pytest.approx(getattr(plain.model.feet[side], edge))
        assert biped.legs[side].ankle_m == pytest.approx(plain.legs[side].ankle_m)
        assert biped.legs[side].foot_m == pytest.approx(plain.legs[side].foot_m)


def test_a_root_beside_the_plane_of_symmetry_is_moved_into_it(tmp_path: Path, plain: Biped) -> None:
    base = '<link name="odd"/><joint name="on" type="fixed"><origin xyz="0 0.005 0"/><parent link="odd"/><child link="base"/>'
    biped = read(tmp_path, change("</robot>", f"{base}</joint></robot>"))
    assert any("5.0 mm from the plane of symmetry" in note for note in biped.full.notes)
    assert biped.legs["left"].hip_m == pytest.approx(plain.legs["left"].hip_m)
    assert biped.model.links["odd"].com_m == pytest.approx(plain.model.links["base"].com_m)


def test_what_is_not_read_is_listed_and_what_is_tighter_is_used(tmp_path: Path) -> None:
    biped = read(
        tmp_path,
        inside("A_shoulder", "</joint>", '<mimic joint="A_knee"/></joint>'),
        inside(
            "A_knee",
            "</joint>",
            '<safety_controller soft_upper_limit="1.9"/><dynamics damping="0.4" friction="0.2" armature="0.1"/></joint>',
        ),
        change("<inertial>", '<inertial name="i">', 1),
        change('<robot name="crooked">', '<robot name="crooked" xmlns="http://www.ros.org"><transmission/>'),
    )
    assert any(
        note == "ignored: <mimic> (1), <transmission> (1), attribute 'name' of <inertial> (1)"
        for note in biped.full.notes
    )
    knee = biped.model.joint("A_knee")
    assert (knee.damping_Nms_rad, knee.friction_Nm, knee.armature_kgm2) == (0.4, 0.2, 0.1)
    assert knee.planning_limits_rad[1] == 1.9


@pytest.mark.parametrize(
    ("damage", "message"),
    [
        (
            inside("A_knee", "</joint>", '<mimic joint="A_hip_pitch"/></joint>'),
            "'A_knee' of a leg mimics joint 'A_hip_pitch'",
        ),
        (
            inside("A_knee", 'effort="60.0"', 'effort="0"'),
            "'A_knee' of a leg has effort 0 in its <limit>: it is not driven",
        ),
        (
            inside("A_hip_pitch", "0.005 0.01", "0.025 0.01"),
            "is not mirrored: the axes of 'A_hip_pitch' and .* are 20.0 mm and",
        ),
        (change(BOX, '<mesh filename="big.stl"/>'), 'would be 170 m by 90 m, and its leg is .* scale="0.001'),
        (change(BOX, '<mesh filename="pointer.stl"/>'), "is a Git LFS pointer, not its content; run: git lfs pull"),
        (change(BOX, "<ellipsoid/>"), "has only shapes that are not flat, ellipsoid for its sole"),
        (
            change('<collision><origin xyz="0.02 ', '<collision><origin xyz="0.12 '),
            "begins .* mm beside the point below its ankle",
        ),
        (change(f'ixx="{BASE}" iyy="{BASE}"', 'ixx="900" iyy="900"'), "the tensor of 'base' spreads 9 kg by"),
    ],
)
def test_one_sentence_says_what_to_change(tmp_path: Path, damage: Change, message: str) -> None:
    corners = [(x, y, z) for x in (-85, 85) for y in (-45, 45) for z in (0.0, 10)]
    (tmp_path / "big.stl").write_text("\n".join(f"vertex {x} {y} {z}" for x, y, z in corners))
    (tmp_path / "pointer.stl").write_text("version https://git-lfs.github.com/spec/v1\n")
    with pytest.raises((RobotDataError, InputError), match=message):
        read(tmp_path, damage)


def test_no_limit_is_no_limit(tmp_path: Path) -> None:
    wheel = inside("A_knee", 'type="revolute"', 'type="continuous"')
    free = read(tmp_path, wheel, inside("A_knee", f'<limit lower="-0.1" upper="2.3" {LIMIT}', ""))
    assert free.full.joint("A_knee").torque_limit_Nm == np.inf
    assert free.model.joint("A_knee").torque_limit_Nm == 60.0  # of the other side
    unranged = read(tmp_path, inside("A_knee", 'lower="-0.1" upper="2.3" ', ""))
    assert unranged.full.joint("A_knee").limits_rad == ANY_ANGLE and "no limit of angle: A_knee" in unranged.full.notes
    assert unranged.model.joint("A_knee").planning_limits_rad == (-0.1, 2.3)  # of the other side
    unstated = read(tmp_path, change(LIMIT, 'effort="0" velocity="0"/>'))
    assert "effort of every joint is 0: it is taken as not stated" in unstated.full.notes
    assert "no limit of torque: all joints of the legs" in unstated.full.notes
    knee = unstated.model.joint("A_knee")
    assert knee.torque_limit_Nm == knee.velocity_limit_rad_s == np.inf and 0.0 < knee.nominal_torque_Nm < 100.0
    names = build_exact_model(load("humanoid-ssp", robot=str(tmp_path / "crooked.urdf"))).row_names
    assert not any(name.startswith(("effort", "joint_speed")) for name in names)


def test_a_file_is_known_by_its_first_tag(tmp_path: Path, plain: Biped) -> None:
    for name in ("ROBOT.URDF", "robot.xml", "robot.urdf.xacro"):
        assert read(tmp_path, name=name).model.feet == plain.model.feet


@pytest.fixture(scope="module")
def mjcf(tmp_path_factory: pytest.TempPathFactory) -> str:
    """MuJoCo's translation of the robot without its faulty hands, with an actuator for every joint."""
    text = re.sub(r'<joint name="[AB]_(grip|wrist)".*?</joint>', "", crooked_urdf())
    text = re.sub(r'<link name="[AB]_(finger"/>|hand">.*?</link>)', "", text)
    kept = '<robot name="crooked"><mujoco><compiler fusestatic="false"/></mujoco>'
    folder = tmp_path_factory.mktemp("mjcf")
    model = mujoco.MjModel.from_xml_path(crooked(folder, text.replace('<robot name="crooked">', kept)))
    mujoco.mj_saveLastXML(str(folder / "crooked.xml"), model)
    xml = (folder / "crooked.xml").read_text(encoding="utf-8").replace(' actuatorfrcrange="-60 60"', "")
    motors = "".join(f'<motor joint="{name}"/>' for name in re.findall(r'<joint name="([^"]*)"', xml))
    return xml.replace("</mujoco>", f"<actuator>{motors}</actuator></mujoco>")


def compile_mjcf(folder: Path, text: str) -> Biped:
    (folder / "robot.mjcf").write_text(text, encoding="utf-8")
    return make_biped_model(load_robot(str(folder / "robot.mjcf")))


def test_all_motors_of_a_joint_and_its_own_range_count(tmp_path: Path, mjcf: str) -> None:
    unlimited = compile_mjcf(tmp_path, mjcf)
    assert unlimited.model.joint("A_knee").torque_limit_Nm == np.inf
    knees = mjcf
    for side in "AB":
        motor = f'<motor joint="{side}_knee" gear="2" forcerange="-30 20"/>'
        assert f'<motor joint="{side}_knee"/>' in knees
        knees = knees.replace(f'<motor joint="{side}_knee"/>', 2 * motor)
    assert compile_mjcf(tmp_path, knees).model.joint("A_knee").torque_limit_Nm == 80.0
    capped = re.sub(r'<joint name="(._knee)"', r'<joint name="\1" actuatorfrcrange="-10 150"', knees)
    assert compile_mjcf(tmp_path, capped).model.joint("A_knee").torque_limit_Nm == 10.0


def test_what_mujoco_moves_and_this_does_not_is_listed_or_refused(tmp_path: Path, mjcf: str) -> None:
    shoulder = mjcf.replace('<joint name="A_shoulder"', '<joint stiffness="3" name="A_shoulder"')
    notes = compile_mjcf(tmp_path, shoulder.replace('<body name="A_arm"', '<body gravcomp="1" name="A_arm"')).full.notes
    assert "ignored: stiffness of A_shoulder, gravcomp of A_arm" in notes
    equality = '<equality><joint joint1="A_knee" joint2="A_hip_pitch"/></equality></mujoco>'
    with pytest.raises(InputError, match="'A_(hip_pitch|knee)' of a leg is coupled by the equality 'joint'"):
        compile_mjcf(tmp_path, mjcf.replace("</mujoco>", equality))
    with pytest.raises(InputError, match="'A_knee' of a leg has no actuator: it is not driven"):
        compile_mjcf(tmp_path, mjcf.replace('<motor joint="A_knee"/>', ""))
    box = '<body name="box"><freejoint/><geom size="1" mass="900"/></body></worldbody>'
    biped = compile_mjcf(tmp_path, mjcf.replace("</worldbody>", box))
    assert any(note.endswith("ignored: 'box' (900 kg)") for note in biped.full.notes)


def test_rotors_damping_and_friction_are_mujocos(tmp_path: Path, mjcf: str) -> None:
    """The model's torques are those of MuJoCo's inverse dynamics, and its model of the robot has all three."""
    text = re.sub(r'<joint name="(._knee)"', r'<joint name="\1" armature="0.3" damping="2" frictionloss="0.1"', mjcf)
    robot = compile_mjcf(tmp_path, text).model
    assert robot.joint("A_knee").armature_kgm2 == 0.3
    tree = make_tree(robot, robot.root)
    world = ElementTree.Element("worldbody")
    add_bodies(world, tree, {}, root="fixed")
    root = ElementTree.Element("mujoco")
    root.append(world)
    engine = mujoco.MjModel.from_xml_string(ElementTree.tostring(root, encoding="unicode"))
    assert engine.joint("A_knee").frictionloss[0] == 0.1
    engine.dof_frictionloss[:] = 0.0
    data, rng = mujoco.MjData(engine), np.random.default_rng(0)
    data.qpos, data.qvel, data.qacc = rng.uniform(-1.0, 1.0, (3, engine.nq))
    engine.opt.disableflags |= int(mujoco.mjtDisableBit.mjDSBL_CONSTRAINT)
    mujoco.mj_inverse(engine, data)
    names = [engine.joint(i).name for i in range(engine.njnt)]
    q, qd, qdd = (dict(zip(names, map(SX, row), strict=True)) for row in (data.qpos, data.qvel, data.qacc))
    torques, _ = newton_euler(tree, q, qd, qdd, (0.0, 0.0, -9.81))
    found = [float(DM(ca.evalf(torques[name]))) for name in names]
    np.testing.assert_allclose(found, data.qfrc_inverse, rtol=0, atol=1e-9)
