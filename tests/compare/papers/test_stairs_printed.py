"""The stairs paper's equations as printed: by how much they miss, computed by hand."""

from __future__ import annotations

import math

import numpy as np
import pytest

from compare.papers.stairs.stairs_paper import TABLE_4, measure_printed_equations, measure_slide


def test_misses_of_the_printed_equations() -> None:
    found = measure_printed_equations(TABLE_4[2], np.array([[0.0, 0.01]]))
    u = 0.5 / 0.9
    assert found["sole_jump_deg"] == pytest.approx(30 * (-4 + 12 * u - 9 * u**2 + 2 * u**3) - 30, abs=1e-3)
    assert found["toe_end_deg"] == pytest.approx(
        30 * (-5 + 12 * 14 / 9 - 9 * (14 / 9) ** 2 + 2 * (14 / 9) ** 3), abs=1e-3
    )
    assert found["end_rate_rad_s"] == pytest.approx(math.sqrt(9.81 / 0.1778))
    assert found["landing_m_s"] == pytest.approx(2 * math.sqrt(9.81 * 0.1778))
    assert found["landing_mm"] == pytest.approx(50 * (1 - math.cos(math.pi / 6)), abs=1e-3)
    # Circle through both ends of the hip's path, level at the first: (0, R), so X^2 + (Z - R)^2 = R^2.
    assert found["arc_m"] == pytest.approx((0.254**2 + 0.1778**2) / (2 * 0.1778))
    # The toe is below an ankle 1 cm above the stance ankle's step by half of its length.
    assert found["toe_depth_mm"] == pytest.approx(25.0 - 10.0, abs=1e-3)
    assert found["bridge_mm"] > 0.0 and found["lift_off_m_s"] > 0.0


def test_the_printed_path_slides_into_the_edge_of_flat_stairs_only() -> None:
    # Along the floor, 25 mm high, to 0.6 - 0.1 pi = 0.286 m, past the edge at 0.24 m of a step of 0.1 m.
    assert measure_slide(0.30, 0.10) == pytest.approx(100.0 - 25.0, abs=1e-3)
    assert measure_slide(0.254, 0.1778) == 0.0
