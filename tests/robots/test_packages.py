"""Robots of installed packages, by name."""

import sys
from pathlib import Path
from types import SimpleNamespace

import pytest

from nlp_gait.errors import RobotDataError, UnknownNameError
from nlp_gait.robots import load_robot
from nlp_gait.robots.loading import hash_robot
from nlp_gait.robots.packages import find_robot_file
from tests.robots.crooked import crooked_urdf


def install(folder: Path, name: str, *files: str) -> None:
    """Make a package with these files importable and known to ``importlib.metadata``."""
    info = folder / f"{name.replace('-', '_')}-1.0.dist-info"
    info.mkdir()
    (info / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {name}\nVersion: 1.0\n", encoding="utf-8")
    (info / "RECORD").write_text("".join(f"{file},,\n" for file in files), encoding="utf-8")


def write(file: Path, text: str) -> Path:
    file.parent.mkdir(parents=True, exist_ok=True)
    file.write_text(text, encoding="utf-8")
    return file


@pytest.fixture
def packages(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A folder from which Python imports."""
    monkeypatch.syspath_prepend(tmp_path)
    return tmp_path


def test_a_robot_is_named_by_its_file_or_folder(packages: Path) -> None:
    files = ("one/crooked.urdf", "two/crooked.urdf", "one/lonely.urdf")
    for file in files:
        write(packages / file, crooked_urdf())
    install(packages, "some-robots", *files)
    whole = load_robot(str(packages / "one" / "lonely.urdf"))
    for name in ("some-robots:lonely", "some-robots:two", "some-robots:one"):
        assert load_robot(name).feet == whole.feet and hash_robot(name)
    with pytest.raises(UnknownNameError, match=r"unknown robot of 'some-robots' 'three'; known: lonely, one, two"):
        load_robot("some-robots:three")
    with pytest.raises(UnknownNameError, match=r"did you mean 'lonely'"):
        load_robot("some-robots:lonly")


def test_mjcf_files_are_robots_and_scenes_and_other_xml_files_are_not(packages: Path) -> None:
    write(packages / "m/robot.xml", "<!-- a robot --><mujoco/>")
    write(packages / "m/scene.xml", "<mujoco><include file='robot.xml'/></mujoco>")
    write(packages / "m/package.xml", "<package/>")
    install(packages, "mjcf-robots", "m/robot.xml", "m/scene.xml", "m/package.xml")
    with pytest.raises(UnknownNameError, match=r"known: robot(;|$)"):
        find_robot_file("mjcf-robots:none")


@pytest.mark.parametrize(
    ("name", "package"),
    [
        ("no-robots:one", "no-robots"),
        ("menagerie:g1", "mujoco-menagerie"),
    ],
)
def test_a_missing_package_is_named_with_the_command_that_installs_it(name: str, package: str) -> None:
    with pytest.raises(RobotDataError, match=rf"is not installed.*pip install {package}\b"):
        find_robot_file(name)


def test_the_menagerie_is_asked_for_a_robots_model(packages: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    def fetch(entry: str) -> Path:
        if entry == "far":
            raise OSError("no network")
        return packages / f"{entry}.xml"

    robots = [SimpleNamespace(name=name, default_model=name, xml=fetch) for name in ("near", "far")]
    monkeypatch.setitem(sys.modules, "mujoco_menagerie", SimpleNamespace(robots=lambda: robots))
    install(packages, "mujoco-menagerie")
    assert find_robot_file("menagerie:near") == find_robot_file("mujoco-menagerie:near") == str(packages / "near.xml")
    with pytest.raises(RobotDataError, match=r"does not provide it \(no network\); it downloads its robots"):
        find_robot_file("menagerie:far")
    with pytest.raises(UnknownNameError, match="did you mean 'near'"):
        find_robot_file("menagerie:neat")


def test_a_description_is_the_module_of_that_name(packages: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    for module in [name for name in sys.modules if name.partition(".")[0] == "robot_descriptions"]:
        monkeypatch.delitem(sys.modules, module)
    urdf = write(packages / "biped.urdf", crooked_urdf())
    write(packages / "robot_descriptions/__init__.py", "")
    write(packages / "robot_descriptions/_cache.py", "")
    write(packages / "robot_descriptions/biped_description.py", f"URDF_PATH = {str(urdf)!r}\n")
    write(packages / "robot_descriptions/xacro_description.py", "XACRO_PATH = 'biped.xacro'\n")
    install(packages, "robot-descriptions")
    with pytest.raises(UnknownNameError, match=r"known: biped, xacro(;|$)"):
        find_robot_file("robot_descriptions:none")
    for name in ("robot_descriptions:biped", "robot-descriptions:biped_description"):
        assert load_robot(name).name == "crooked"
    with pytest.raises(RobotDataError, match="neither a URDF nor an MJCF file"):
        find_robot_file("robot_descriptions:xacro")
    for module in [name for name in sys.modules if name.partition(".")[0] == "robot_descriptions"]:
        monkeypatch.delitem(sys.modules, module)
