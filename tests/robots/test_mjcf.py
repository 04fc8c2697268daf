"""Robots from MJCF: MuJoCo's own translation of a URDF is the same robot, and a message for what cannot be read."""

import re
import sys
from contextlib import nullcontext
from pathlib import Path

import mujoco
import pytest

from nlp_gait.errors import MissingExtraError, RobotDataError
from nlp_gait.robots import load_robot, mjcf
from nlp_gait.robots.biped import make_biped_model
from tests.robots.crooked import crooked, crooked_urdf
from tests.robots.custom import assert_same

DIGITS = 1e-5  # MuJoCo writes six


def plain_urdf() -> str:
    """The robot without its oddities, which MuJoCo refuses."""
    text = re.sub(r'<joint name="[AB]_(grip|wrist)".*?</joint>', "", crooked_urdf())
    text = re.sub(r'<link name="[AB]_finger"/>', "", text)
    text = re.sub(r'<link name="[AB]_hand">.*?</link>', "", text)
    kept = '<mujoco><compiler fusestatic="false"/></mujoco>'  # else the base would become the world
    return text.replace('<robot name="crooked">', f'<robot name="crooked">{kept}')


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> str:
    folder = tmp_path_factory.mktemp("mjcf")
    model = mujoco.MjModel.from_xml_path(crooked(folder, plain_urdf()))
    mujoco.mj_saveLastXML(str(folder / "crooked.xml"), model)
    return str(folder / "crooked.xml")


def test_mujocos_translation_of_a_urdf_is_the_same_robot(path: str) -> None:
    found, wanted = (
        make_biped_model(load_robot(path)),
        make_biped_model(load_robot(str(Path(path).with_suffix(".urdf")))),
    )
    assert found.joints == wanted.joints
    assert found.posture_rad == pytest.approx(wanted.posture_rad, abs=DIGITS)
    for side in ("left", "right"):
        for name in ("ankle_height_m", "front_m", "back_m", "left_m", "right_m"):
            foot, other = found.model.feet[side], wanted.model.feet[side]
            assert getattr(foot, name) == pytest.approx(getattr(other, name), abs=DIGITS)
    assert_same(found.model, wanted.model, DIGITS)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("<worldbody>", "<wordbody>", "is not read by MuJoCo"),
        (
            "<worldbody>",
            '<option><flag sensornoise="enable"/></option><worldbody>',
            "'sensornoise' .* such attribute: remove",
        ),
        (
            "<worldbody>",
            '<asset><mesh file="no.stl"/></asset><worldbody>',
            "no.stl'; meshes must be where the file names",
        ),
        (
            "<worldbody>",
            '<contact><pair geom1="a" geom2="b"/></contact><worldbody>',
            "includes this one, such as a scene",
        ),
    ],
)
def test_what_is_wrong_with_an_mjcf_is_reported(path: str, tmp_path: Path, old: str, new: str, message: str) -> None:
    text = Path(path).read_text(encoding="utf-8")
    assert old in text
    (tmp_path / "robot.xml").write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(RobotDataError, match=message):
        load_robot(str(tmp_path / "robot.xml"))


def test_a_body_with_two_hinges_is_two_bodies(path: str, tmp_path: Path) -> None:
    text = Path(path).read_text(encoding="utf-8")
    twist = '<joint name="twist" axis="0 0 1" range="-1 1"/>'
    mass = f'<inertial pos="0 0 0" mass="{mjcf.LIGHT_KG}" diaginertia="1e-12 1e-12 1e-12"/>'
    begin = text.index('<body name="A_arm"')
    place, end = text.index(">", begin) + 1, text.index("</body>", begin)
    pos = text[begin:place].removeprefix('<body name="A_arm"')
    variants = {
        "one": text.replace('<joint name="A_shoulder"', f'{twist}<joint name="A_shoulder"'),
        "two": f'{text[:begin]}<body name="x"{pos}{mass}{twist}<body name="A_arm">{text[place:end]}</body>{text[end:]}',
    }
    for name, variant in variants.items():
        (tmp_path / f"{name}.xml").write_text(variant, encoding="utf-8")
    found, wanted = (load_robot(str(tmp_path / f"{name}.xml")) for name in variants)
    assert [joint.name for joint in found.path_to_root("A_arm")] == ["A_shoulder", "twist"]
    for name, joint in wanted.joints.items():
        assert found.joints[name].axis == joint.axis and found.joints[name].origin_m == joint.origin_m
        assert found.links[found.joints[name].child].mass_kg == wanted.links[joint.child].mass_kg


def test_without_mujoco_its_extra_is_named(path: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "mujoco", None)
    with pytest.raises(MissingExtraError, match=r"MJCF files need MuJoCo.*pip install 'nlp-gait\[sim\]'"):
        load_robot(path)


@pytest.mark.parametrize("spoilt", [False, True])
def test_the_engines_warnings_go_where_they_went_before(path: str, tmp_path: Path, spoilt: bool) -> None:
    """Else later ones would be written to a file in the user's folder."""
    robot = tmp_path / "robot.xml"
    robot.write_text("<mujoco><worldbody/>" if spoilt else Path(path).read_text(encoding="utf-8"), encoding="utf-8")
    texts: list[str] = []
    mujoco.set_mju_user_warning(texts.append)
    try:
        with nullcontext() if not spoilt else pytest.raises(RobotDataError):
            load_robot(str(robot))
        assert mujoco.get_mju_user_warning() == texts.append
    finally:
        mujoco.set_mju_user_warning(None)
