"""Data of the biped with toes: what is no such robot is refused."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from nlp_gait.errors import RobotDataError
from nlp_gait.gaits.stairs.planar_biped import DEFAULT_FILE, PlanarLink, load_toe_foot_biped


def test_the_papers_robot() -> None:
    robot = load_toe_foot_biped()
    assert robot.mass_kg == pytest.approx(51.7)  # Table I
    assert robot.foot_m == pytest.approx(0.17)
    assert robot.link("HK").inertia_kgm2 == pytest.approx(6.0 * 0.4**2 / 12)


@pytest.mark.parametrize("value", [0.0, -1.0, float("nan"), float("inf")])
def test_a_mass_that_no_link_can_have(value: float) -> None:
    with pytest.raises(RobotDataError, match="link 'HK': mass_kg must be (> 0|finite)"):
        PlanarLink(name="HK", length_m=0.4, mass_kg=value)


def changed(tmp_path: Path, index: int, **values: object) -> str:
    data = json.loads(DEFAULT_FILE.read_text(encoding="utf-8"))
    data["links"][index] |= values
    file = tmp_path / "robot.json"
    file.write_text(json.dumps(data), encoding="utf-8")
    return str(file)


def test_legs_that_differ(tmp_path: Path) -> None:
    with pytest.raises(RobotDataError, match="HK and HK' must be equal"):
        load_toe_foot_biped(changed(tmp_path, 0, mass_kg=7.0))


@pytest.mark.parametrize("value", ["6", True])
def test_a_mass_that_is_not_a_number(tmp_path: Path, value: object) -> None:
    with pytest.raises(RobotDataError, match=r"robot\.json': links\[0\]\.mass_kg must be a number, got"):
        load_toe_foot_biped(changed(tmp_path, 0, mass_kg=value))


def test_a_link_that_does_not_exist(tmp_path: Path) -> None:
    with pytest.raises(RobotDataError, match="links must be"):
        load_toe_foot_biped(changed(tmp_path, 0, name="tail"))


def test_a_file_that_cannot_be_read(tmp_path: Path) -> None:
    with pytest.raises(RobotDataError, match="cannot be read"):
        load_toe_foot_biped(str(tmp_path / "missing.json"))
