"""Data of the 12-joint biped."""

from __future__ import annotations

import pytest

from nlp_gait.gaits.walk12.walk12_model import load_point_mass_biped


def test_table_1() -> None:
    robot = load_point_mass_biped()
    masses = (robot.knee_mass_kg, robot.waist_mass_kg, robot.foot_mass_kg, robot.hip_mass_kg)
    assert masses == (0.07, 0.02, 0.14, 0.21)
    assert robot.leg_m == pytest.approx(0.34)
    assert "Table I" in robot.source
