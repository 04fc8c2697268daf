"""Data of the 12-joint biped."""

from __future__ import annotations

import json
from dataclasses import asdict
from pathlib import Path

import pytest

from nlp_gait.errors import RobotDataError
from nlp_gait.gaits.walk12.walk12_model import load_point_mass_biped


def test_table_1() -> None:
    robot = load_point_mass_biped()
    masses = (robot.knee_mass_kg, robot.waist_mass_kg, robot.foot_mass_kg, robot.hip_mass_kg)
    assert masses == (0.07, 0.02, 0.14, 0.21)
    assert robot.leg_m == pytest.approx(0.34)
    assert "Table I" in robot.source


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"thigh_m": 0.0}, "thigh_m must be > 0, got 0.0"),
        ({"thigh_m": "long"}, "thigh_m must be a number, got 'long'"),
        ({"foot_mass_kg": True}, "foot_mass_kg must be a number, got True"),
        ({"source": 1}, "source must be a text, got 1"),
        ({"tail_m": 1.0}, "unknown key 'tail_m'"),
    ],
)
def test_damaged_data(tmp_path: Path, change: dict[str, object], message: str) -> None:
    file = tmp_path / "robot.json"
    file.write_text(json.dumps(asdict(load_point_mass_biped()) | change))
    with pytest.raises(RobotDataError, match=message):
        load_point_mass_biped(str(file))


def test_a_file_that_cannot_be_read(tmp_path: Path) -> None:
    file = tmp_path / "robot.json"
    file.write_text("{")
    for path in (file, tmp_path / "none.json"):
        with pytest.raises(RobotDataError, match="cannot be read|is not valid JSON"):
            load_point_mass_biped(str(path))
