"""Robots from MJCF: MuJoCo's own translation of a URDF is the same robot, and a message for what cannot be read."""

import re
import sys
from contextlib import nullcontext
from pathlib import Path

import mujoco
import pytest

from nlp_gait.errors import MissingExtraError, RobotDataError
from nlp_gait.robots import load_robot
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
        ('<joint name="A_knee"', '<joint name="extra"/><joint name="A_knee"', "has 2 hinges; give each its own body"),
    ],
)
def test_what_is_wrong_with_an_mjcf_is_reported(path: str, tmp_path: Path, old: str, new: str, message: str) -> None:
    text = Path(path).read_text(encoding="utf-8")
    assert old in text
    (tmp_path / "robot.xml").write_text(text.replace(old, new), encoding="utf-8")
    with pytest.raises(RobotDataError, match=message):
        load_robot(str(tmp_path / "robot.xml"))


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
