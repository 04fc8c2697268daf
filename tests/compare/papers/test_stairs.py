"""The stairs paper's equations as printed, computed by hand."""

import math

import pytest

from compare.papers.stairs import stairs
from compare.papers.stairs.printed import TABLE_4, measure_dynamics, measure_equations


def test_misses_of_the_printed_equations() -> None:
    misses = {name: list(values.values()) for name, values in measure_equations(TABLE_4[2]).items()}
    jump, _, toe = misses["foot-angles"]
    u = 0.5 / 0.9
    assert jump == pytest.approx(30 * (-4 + 12 * u - 9 * u**2 + 2 * u**3) - 30, abs=1e-3)
    u = 1.4 / 0.9
    assert toe == pytest.approx(30 * (-5 + 12 * u - 9 * u**2 + 2 * u**3), abs=1e-3)
    # Circle through both ends of the hip's path, level at the first: (0, R), so X^2 + (Z - R)^2 = R^2.
    assert misses["arc"] == [pytest.approx((0.254**2 + 0.1778**2) / (2 * 0.1778))]
    assert min(misses["bezier"]) > 0.0
    # The cubic of (13): with these values at both ends its slope changes sign twice.
    caught, least = misses["cubic"]
    assert least < caught < math.pi


def test_the_mass_matrix_is_definite_and_its_rate_less_2_c_is_skew() -> None:
    least, skew = measure_dynamics()
    assert least > 1e-6 and skew < 1e-12


def test_leads_are_those_of_cases_1_and_3_over_case_2() -> None:
    assert stairs.list_leads([12.0, 10.0, 9.0]) == pytest.approx([20.0, -10.0])
    assert stairs.list_jerk_terms()[:2] == pytest.approx([22.15, 14.77], abs=0.01)
