"""Robots from a URDF alone: inferred feet, soles, forward and sides; warnings and errors."""

import json
import logging
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from nlp_gait.errors import InputError, RobotDataError, warn_once
from nlp_gait.robots import Robot, load_robot
from nlp_gait.robots.biped import make_biped_model
from nlp_gait.robots.leg import make_leg
from nlp_gait.robots.meshes import find_mesh
from nlp_gait.robots.tree import find_partner, find_partners
from tests.robots.crooked import (
    ANKLE_M,
    ARM_KG,
    LEG,
    MASSES,
    SOLE_AHEAD_M,
    SOLE_M,
    TORSO_KG,
    crooked,
    crooked_urdf,
)

HAND_KG = 0.1


@pytest.fixture(scope="module")
def robot(tmp_path_factory: pytest.TempPathFactory) -> Robot:
    return load_robot(crooked(tmp_path_factory.mktemp("crooked")))


def override(path: str, **record: object) -> str:
    """Write the robot file next to a URDF."""
    Path(path).with_suffix(".json").write_text(json.dumps(record), encoding="utf-8")
    return path


def name_feet(joint: str) -> dict[str, object]:
    """Soles on the links behind a joint of each leg."""
    extents = {"ankle_height_m": 0.05, "front_m": 0.1, "back_m": 0.05, "left_m": 0.04, "right_m": 0.04}
    return {side: {"link": f"{x}_{joint}_link", **extents} for side, x in (("left", "A"), ("right", "B"))}


def test_feet_soles_and_sides_are_found_by_geometry(robot: Robot) -> None:
    left, right = robot.feet["left"], robot.feet["right"]
    assert (left.link, right.link) == ("A_ankle_roll_link", "B_ankle_roll_link")
    half, ahead = SOLE_M[0] / 2, SOLE_AHEAD_M + LEG["ankle_roll"][0][0]  # from where the last two axes are nearest
    for foot in (left, right):
        assert foot.ankle_height_m == ANKLE_M
        assert (foot.front_m, foot.back_m) == pytest.approx((half + ahead, half - ahead))
    assert (left.left_m, left.right_m) == (right.right_m, right.left_m) == pytest.approx((0.048, 0.042))


def test_a_biped_is_its_legs_and_one_body_in_a_posture(robot: Robot) -> None:
    """Arms are held at the nearest limit, 0.2 rad; the finger without mass and the hand with a bad tensor are part of them."""
    biped = make_biped_model(robot)
    assert biped.joints == tuple(f"{prefix}_{name}" for prefix in "AB" for name in LEG)
    assert biped.posture_rad == {"A_shoulder": 0.2, "B_shoulder": 0.2}
    assert len(biped.model.links) == 13
    assert biped.model.mass_kg == pytest.approx(TORSO_KG + 2 * (ARM_KG + HAND_KG + sum(MASSES)))
    arm = np.array([0.0, 0.2, 0.3]) + np.array([-np.sin(0.2), 0.0, -np.cos(0.2)]) * (0.15 * ARM_KG + 0.3 * HAND_KG) / (
        ARM_KG + HAND_KG
    )
    base = biped.model.links["base"]
    expected = (TORSO_KG * 0.15 + 2 * (ARM_KG + HAND_KG) * arm[2]) / base.mass_kg
    assert base.com_m[2] == pytest.approx(expected)
    assert base.com_m[0] == pytest.approx(2 * (ARM_KG + HAND_KG) * arm[0] / base.mass_kg)


def test_what_is_ignored_is_reported(tmp_path: Path, caplog: pytest.LogCaptureFixture) -> None:
    text = crooked_urdf().replace('<joint name="A_knee"', '<joint dont_collapse="true" name="A_knee"')
    warn_once.cache_clear()
    with caplog.at_level(logging.WARNING, logger="nlp_gait"):
        found = load_robot(crooked(tmp_path, text))
    assert "dont_collapse" in caplog.text
    assert any("'A_finger' is welded to its parent 'A_arm'" in note for note in found.notes)
    assert any("'B_hand' is welded to its parent 'B_arm'" in note for note in found.notes)
    assert "(and 4 more); see nlp-gait list --robot FILE" in caplog.text


def test_images_are_found_where_names_mislead(robot: Robot) -> None:
    images = find_partners(robot)
    assert images["A_knee"] == "B_knee" and images["B_hip_yaw"] == "A_hip_yaw"
    assert find_partner("A_knee") == "A_knee"
    nao = load_robot("nao-v6")
    assert find_partners(nao) == {name: find_partner(name) for name in nao.joints}


@pytest.mark.parametrize("turn", [90, 180, 270])
def test_a_root_that_looks_elsewhere_is_turned(tmp_path: Path, robot: Robot, turn: int) -> None:
    """A base above the torso, turned about z: the result is the same robot."""
    angle = float(np.radians(turn))
    text = crooked_urdf().replace(
        "</robot>",
        f'<link name="odd"/><joint name="on" type="fixed"><origin rpy="0 0 {angle!r}"/><parent link="odd"/>'
        '<child link="base"/></joint></robot>',
    )
    found = load_robot(crooked(tmp_path, text))
    assert found.feet == robot.feet
    for name, joint in robot.joints.items():
        np.testing.assert_allclose(found.joints[name].origin_m, joint.origin_m, atol=1e-12)
        np.testing.assert_allclose(found.joints[name].axis, joint.axis, atol=1e-12)
    for name in set(robot.links) - {"base"}:
        np.testing.assert_allclose(found.links[name].inertia_matrix, robot.links[name].inertia_matrix, atol=1e-12)


def test_the_robot_file_overrides_the_urdf(tmp_path: Path) -> None:
    path = override(
        crooked(tmp_path),
        feet={"left": {"link": "A_ankle_roll_link", "front_m": 0.2}, "right": {"link": "B_ankle_roll_link"}},
        posture_rad={"A_shoulder": 1.0},
        heat_loss_W_per_Nm2=0.001,
    )
    biped = make_biped_model(load_robot(path))
    assert biped.model.feet["left"].front_m == 0.2 and biped.model.feet["right"].front_m == pytest.approx(0.109)
    assert biped.posture_rad == {"A_shoulder": 1.0, "B_shoulder": 0.2}
    assert biped.heat_W_per_Nm2 == 0.001 and biped.heat_source == "from the robot's file"


def test_a_mesh_is_needed_only_where_a_sole_comes_from_it(tmp_path: Path) -> None:
    text = crooked_urdf().replace("<box size", '<mesh filename="package://feet/sole.stl" size')
    path = crooked(tmp_path, text)
    with pytest.raises(
        RobotDataError, match=r"mesh 'package://feet/sole\.stl', which does not exist; put it there, name its"
    ):
        load_robot(path)
    corners = [(x, y, z) for x in (-0.1, 0.1) for y in (-0.05, 0.05) for z in (0.0, 0.01)]
    folder = tmp_path / "feet"
    folder.mkdir()
    (folder / "sole.stl").write_text("\n".join(f"vertex {x} {y} {z}" for x, y, z in corners))
    foot = load_robot(path).feet["left"]
    assert foot.front_m + foot.back_m == pytest.approx(0.2)
    (folder / "sole.stl").unlink()
    assert load_robot(override(path, feet=name_feet("ankle_roll"))).feet["right"].back_m == 0.05


@pytest.mark.parametrize("folder", ["feet", "feet-main", "models"])  # a clone, an archive of GitHub, another name
def test_a_mesh_is_found_in_the_folder_of_its_package_and_above_the_file(tmp_path: Path, folder: str) -> None:
    (tmp_path / folder / "urdf").mkdir(parents=True)
    mesh = tmp_path / folder / "sole.stl"
    mesh.write_text("")
    model = tmp_path / folder / "urdf" / "robot.urdf"
    assert find_mesh("package://feet/sole.stl", model) == find_mesh("sole.stl", model) == mesh
    assert find_mesh("package://feet/toe.stl", model) is find_mesh("package://../sole.stl", model) is None
    assert find_mesh("sole.stl", model.parent / "more" / "robot.urdf") is None  # two folders above


def change(old: str, new: str) -> Callable[[str], str]:
    def changed(text: str) -> str:
        assert old in text
        return text.replace(old, new)

    return changed


INCOMPLETE = [
    (change("<collision>", "<visual>"), r"is not valid XML"),
    (
        lambda text: crooked_urdf(sole=False),
        r"'A_ankle_roll_link' has no shape .* write its sole into the JSON",
    ),
    (
        change('size="0.17 0.09 0.02"', 'size="0.17 0.001 0.02"'),
        r"no flat sole. If it is tilted .* turn an origin .*; else write its sole",
    ),
    (
        lambda text: change(f'xyz="{SOLE_AHEAD_M} ', 'xyz="0.04 ')(text).replace(
            'lower="-0.1" upper="2.3"', 'lower="-2.3" upper="0.1"'
        ),
        r"knees .* contradict each other; write the forward direction",
    ),
    (
        lambda text: re.sub(
            r'(name="A_knee".*?)lower="-0.1" upper="2.3"', r'\1lower="-2.3" upper="0.1"', text, flags=re.DOTALL
        ),
        r"knees bend in opposite directions, 'A_knee_link' by -2\.3 to 0\.1 rad about .* 'B_knee_link' by -0\.1",
    ),
    (change('<joint name="A_knee" type="revolute">', '<joint name="A_knee" type="fixed">'), r"no feet found"),
    (
        change('<origin xyz="0.0 0.0 0.15"/>', '<origin xyz="0.0 0.0 -0.9"/>'),
        r"no feet found: .*'A_ankle_roll_link' and 'B_ankle_roll_link', belongs to arms: they begin above",
    ),
    (
        change(
            "</robot>",
            '<link name="low"/><joint name="lie" type="fixed"><origin rpy="1.5707963 0 0"/><parent link="low"/>'
            '<child link="base"/></joint></robot>',
        ),
        r"no feet found: .* points along y at zero angles, and z must be up: turn the root",
    ),
    (
        change('<mass value="1.1"/>', '<mass value="1.1e5"/>'),
        r"'A_knee_link' has 1\.1e\+05 kg, root and joints span .* is it in g",
    ),
    (
        change('<mass value="1.1"/>', '<mass value="0"/>'),
        r"mass_kg must be > 0, got 0\.0\. It moves in every gait.*write the link into the JSON",
    ),
]


@pytest.mark.parametrize(("damage", "message"), INCOMPLETE, ids=[message[:30] for _, message in INCOMPLETE])
def test_what_cannot_be_inferred_is_an_error(tmp_path: Path, damage: Callable[[str], str], message: str) -> None:
    with pytest.raises(RobotDataError, match=message):
        load_robot(crooked(tmp_path, damage(crooked_urdf())))


def test_a_link_that_matters_is_taken_from_the_robot_file(tmp_path: Path) -> None:
    text = crooked_urdf().replace('<mass value="1.1"/>', '<mass value="0"/>')
    shin = {"mass_kg": 1.1, "com_m": [0.0, 0.0, -0.1], "inertia_com_kgm2": [0.01, 0.01, 0.01, 0, 0, 0]}
    robot = load_robot(override(crooked(tmp_path, text), links={"A_knee_link": shin, "B_knee_link": shin}))
    assert robot.links["A_knee_link"].mass_kg == 1.1


def test_a_foot_behind_a_fixed_joint_is_found(tmp_path: Path) -> None:
    soles = ""
    for x in "AB":
        ends = f'<parent link="{x}_ankle_roll_link"/><child link="{x}_sole"/>'
        soles += f'<link name="{x}_sole"/><joint name="{x}_weld" type="fixed">{ends}</joint>'
    text = crooked_urdf().replace("</robot>", soles + "</robot>")
    named = override(crooked(tmp_path, text), feet={"left": {"link": "A_sole"}, "right": {"link": "B_sole"}})
    assert load_robot(named).feet["left"].link == "A_ankle_roll_link"


def test_knees_without_a_clear_range_bend_forward(tmp_path: Path, robot: Robot) -> None:
    free = load_robot(crooked(tmp_path, crooked_urdf().replace('lower="-0.1" upper="2.3"', 'lower="-2.3" upper="2.3"')))
    for side in ("left", "right"):
        assert free.feet[side] == robot.feet[side]
        assert make_leg(free, side).bend == make_leg(robot, side).bend


def test_exchanged_feet_are_refused(tmp_path: Path) -> None:
    feet = {"left": {"link": "B_ankle_roll_link"}, "right": {"link": "A_ankle_roll_link"}}
    with pytest.raises(RobotDataError, match=r"named the left foot, but it is to the right"):
        load_robot(override(crooked(tmp_path), feet=feet))


@pytest.mark.parametrize(
    ("posture", "message"),
    [
        ({"A_shoulder": 3.0}, r"posture_rad of 'A_shoulder' must be within \[0\.2, 2\] rad, got 3"),
        ({"A_knee": 0.1}, r"names 'A_knee', which is a joint of a leg"),
        ({"tail": 0.1}, r"names 'tail', which is not a joint"),
    ],
)
def test_an_impossible_posture_is_refused(tmp_path: Path, posture: dict[str, float], message: str) -> None:
    with pytest.raises(InputError, match=message):
        make_biped_model(load_robot(override(crooked(tmp_path), posture_rad=posture)))
