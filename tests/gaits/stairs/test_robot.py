"""Data of the biped with toes."""

from __future__ import annotations

import pytest

from nlp_gait.gaits.stairs.planar_biped import LINKS, load_toe_foot_biped


def test_the_papers_robot() -> None:
    robot = load_toe_foot_biped()
    assert tuple(link.name for link in robot.links) == LINKS
    for swing in ("HK", "KA", "AS", "ST"):
        stance = robot.link("".join(f"{end}'" for end in swing).replace("H'", "H"))
        assert (stance.length_m, stance.mass_kg) == (robot.link(swing).length_m, robot.link(swing).mass_kg)
    assert robot.mass_kg == pytest.approx(51.7)  # Table I
    assert robot.foot_m == pytest.approx(0.17)
    assert robot.link("HK").inertia_kgm2 == pytest.approx(6.0 * 0.4**2 / 12)
