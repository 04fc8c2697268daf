"""Robots from URDF files: the same robot as from JSON in any frames, and a message for each fault."""

import sys
from collections.abc import Callable
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from nlp_gait.errors import MissingExtraError, RobotDataError
from nlp_gait.robots import load_robot
from nlp_gait.robots.urdf import read_urdf
from tests.robots.custom import about_joints, as_urdf, assert_same, humanoid, nao, partner, written

SET_EULER = {"LThigh": Rotation.from_euler("xyz", (0.3, -1.1, 2.0)), "LTibia": Rotation.from_euler("x", 1.5)}


def stored(folder: Path, tree: ElementTree.Element | str, robot: object = None) -> str:
    """Path of a URDF, with its robot file next to it."""
    path = folder / "robot.urdf"
    path.write_text(tree if isinstance(tree, str) else ElementTree.tostring(tree, encoding="unicode"), encoding="utf-8")
    written(folder, partner(nao(), "robot.urdf") if robot is None else robot)
    return str(path)


@settings(max_examples=25)  # each writes and reads two files
@given(angles=st.lists(st.tuples(*[st.floats(-3.0, 3.0)] * 3), min_size=24, max_size=24))
def test_the_axes_in_which_a_urdf_is_written_do_not_matter(
    tmp_path_factory: pytest.TempPathFactory, angles: list[tuple[float, float, float]]
) -> None:
    raw = humanoid()
    folder = tmp_path_factory.mktemp("urdf")
    links = [name for name in raw["links"] if name != raw["root"]]
    turned = {name: Rotation.from_euler("xyz", triple) for name, triple in zip(links, angles, strict=True)}
    json_path = folder / "json"
    json_path.mkdir()
    assert_same(load_robot(stored(folder, as_urdf(raw, turned))), load_robot(written(json_path, raw)))


def test_the_robot_file_and_its_urdf_name_the_same_robot(tmp_path: Path) -> None:
    path = stored(tmp_path, as_urdf(nao()), partner(nao(), "robot.urdf", name="mine"))
    by_urdf, by_json = load_robot(path), load_robot(str(tmp_path / "robot.json"))
    assert by_urdf.name == by_json.name == "mine"
    plain = load_robot("nao-v5")
    assert by_urdf.feet == plain.feet
    assert {name: joint.velocity_limit_rad_s for name, joint in by_urdf.joints.items()} == {
        name: joint.velocity_limit_rad_s for name, joint in plain.joints.items()
    }
    assert_same(by_urdf, by_json)


def test_links_behind_joints_that_do_not_turn_become_one_with_those_before(tmp_path: Path) -> None:
    """A camera of 0.2 kg on the head, a base without mass above the torso, and a gripper that slides, at zero."""
    tree = as_urdf(nao())
    for parent, child, kind, mass in (
        ("base_link", "torso", "fixed", None),
        ("Head", "camera", "fixed", "0.2"),
        ("l_wrist", "grip", "prismatic", "0.1"),
    ):
        link = ElementTree.SubElement(tree, "link", name=parent if child == "torso" else child)
        if mass:
            inertial = ElementTree.SubElement(link, "inertial")
            ElementTree.SubElement(inertial, "mass", value=mass)
            ElementTree.SubElement(inertial, "inertia", dict.fromkeys(("ixx", "iyy", "izz", "ixy", "ixz", "iyz"), "0"))
        joint = ElementTree.SubElement(tree, "joint", name=f"to_{child}", type=kind)
        ElementTree.SubElement(joint, "parent", link=parent)
        ElementTree.SubElement(joint, "child", link=child)
        if child != "torso":
            ElementTree.SubElement(joint, "origin", xyz="0.1 0 0")
    robot, plain = load_robot(stored(tmp_path, tree)), load_robot("nao-v5")
    assert robot.root == "base_link"
    assert set(robot.links) == (set(plain.links) - {"torso"}) | {"base_link"}
    head, before = robot.links["Head"], plain.links["Head"]
    assert head.mass_kg == pytest.approx(before.mass_kg + 0.2)
    assert head.com_m[0] == pytest.approx((before.mass_kg * before.com_m[0] + 0.2 * 0.1) / head.mass_kg)
    between = before.mass_kg * 0.2 / head.mass_kg * ((0.1 - before.com_m[0]) ** 2 + before.com_m[2] ** 2)
    assert head.inertia_matrix[1, 1] == pytest.approx(before.inertia_matrix[1, 1] + between)
    assert robot.links["l_wrist"].mass_kg == pytest.approx(plain.links["l_wrist"].mass_kg + 0.1)
    assert robot.links["base_link"].com_m == pytest.approx(plain.links["torso"].com_m)


def test_wheels_and_missing_axes_get_the_defaults_of_the_format(tmp_path: Path) -> None:
    tree = as_urdf(nao())
    yaw_joint = "joint[@name='HeadYaw']"
    for edit in (change(yaw_joint, "type", "continuous"), change(f"{yaw_joint}/axis"), change(f"{yaw_joint}/origin")):
        edit(tree)
    yaw = load_robot(stored(tmp_path, tree)).joint("HeadYaw")
    assert (yaw.axis, yaw.origin_m) == ((1.0, 0.0, 0.0), (0.0, 0.0, 0.0))
    assert yaw.limits_rad == (-np.pi, np.pi)


@pytest.mark.parametrize("about_com_too", [False, True])
def test_tensors_about_the_joints_are_shifted_if_the_file_says_so(tmp_path: Path, about_com_too: bool) -> None:
    """Also for links in other axes than the root's, and for a link that the robot file adds."""
    raw = about_joints(nao())
    path = stored(tmp_path, as_urdf(raw, SET_EULER), partner(nao(), "robot.urdf", inertia_about="joint"))
    if about_com_too:
        wrong = {"LThigh": raw["links"]["LThigh"]}
        path = stored(
            tmp_path, as_urdf(raw, SET_EULER), partner(nao(), "robot.urdf", inertia_about="joint", links=wrong)
        )
    assert_same(load_robot(path), load_robot("nao-v5"))


def change(path: str, key: str | None = None, value: str | None = None) -> Callable[[ElementTree.Element], None]:
    """Set an attribute of an element; without a value remove it, without a key the whole element."""

    def apply(tree: ElementTree.Element) -> None:
        element, parent = tree.find(path), tree.find(f"{path}/..")
        assert element is not None and parent is not None
        if key is None:
            parent.remove(element)
        elif value is None:
            del element.attrib[key]
        else:
            element.set(key, value)

    return apply


KNEE = "joint[@name='LKneePitch']"
DAMAGES = [
    (
        change("link[@name='LThigh']/inertial/inertia", "izz", None),
        r"link 'LThigh': <inertia> needs the attribute 'izz'",
    ),
    (
        change(f"{KNEE}/origin", "xyz", "nan 0 0"),
        r"joint 'LKneePitch': xyz of <origin> must be 3 finite .* 'nan 0 0'",
    ),
    (change(f"{KNEE}/child", "link", "torso"), r"exactly one link must have no parent, got LTibia|ring|none"),
    (change(KNEE, "name", "RKneePitch"), r"joint 'RKneePitch' appears twice"),
    (change(KNEE, "type", "hinge"), r"joint 'LKneePitch': type must be one of revolute, .*, got 'hinge'"),
]


@pytest.mark.parametrize(("damage", "message"), DAMAGES, ids=[message[:40] for _, message in DAMAGES])
def test_what_is_wrong_with_a_urdf_is_reported(
    tmp_path: Path, damage: Callable[[ElementTree.Element], None], message: str
) -> None:
    tree = as_urdf(nao())
    damage(tree)
    with pytest.raises(RobotDataError, match=message):
        load_robot(stored(tmp_path, tree))


LAUGHS = "".join(f'<!ENTITY l{k} "{f"&l{k - 1};" * 10}">' for k in range(1, 12))
ENTITIES = {
    "another file": ('<!ENTITY e SYSTEM "secret.txt">', "&e;"),
    "another file in an attribute": ('<!ENTITY e SYSTEM "secret.txt">', "<link name='&e;'/>"),
    "own": ('<!ENTITY e "1.0">', "<link name='&e;'/>"),
    "definitions from elsewhere": ('<!ENTITY % e SYSTEM "evil.dtd"> %e;', ""),
    "a billion laughs": (f'<!ENTITY l0 "ha">{LAUGHS}', "<link name='&l11;'/>"),
}


@pytest.mark.parametrize(("definition", "use"), ENTITIES.values(), ids=ENTITIES.keys())
def test_entities_are_refused_unread(tmp_path: Path, definition: str, use: str) -> None:
    (tmp_path / "secret.txt").write_text("hunter2")
    text = ElementTree.tostring(as_urdf(nao()), encoding="unicode").replace("</robot>", f"{use}</robot>")
    with pytest.raises(
        RobotDataError, match="must not have a DOCTYPE or entities|is not valid XML: .*[Ee]ntit"
    ) as error:
        load_robot(stored(tmp_path, f"<!DOCTYPE robot [{definition}]>{text}"))
    assert "hunter2" not in str(error.value)


def test_the_robot_file_next_to_a_urdf_must_extend_it(tmp_path: Path) -> None:
    path = stored(tmp_path, as_urdf(nao()), partner(nao(), "other.urdf"))
    with pytest.raises(RobotDataError, match=r"robot\.json': 'extends' must be 'robot\.urdf', the file next to it"):
        load_robot(path)


def test_without_the_extra_its_name_is_given(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "lxml", None)
    with pytest.raises(MissingExtraError, match=r"need the package lxml.*pip install 'nlp-gait\[urdf\]'"):
        read_urdf(stored(tmp_path, as_urdf(nao())))
