"""What the papers on stairs and on the 12-joint walk print, computed by hand."""

import math

import pytest

from compare.papers.stairs import stairs
from compare.papers.stairs.printed import TABLE_4, measure_dynamics, measure_equations
from compare.papers.walk12 import results
from compare.papers.walk12.page import count_met
from compare.papers.walk12.results import LITERAL, RAISED, Results
from compare.papers.walk12.walk12 import find_branch, list_rod_changes
from tests.compare.records import record


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


def test_f1_that_table_4_implies() -> None:
    assert [round(row.implied_f1) for row in results.TABLE_4] == [1139, 726, 277, 164]


def test_an_ankle_above_the_ground_meets_more_of_the_printed_f() -> None:
    assert [count_met(Results(name, {})) for name in (LITERAL, RAISED)] == [3, 5]


def test_moments_of_rods_are_small_and_2_misses_deeply_bent_legs_only() -> None:
    changes = list_rod_changes(Results(LITERAL, {}))
    assert (round(min(changes), 2), round(max(changes), 2)) == (0.04, 0.09)
    assert find_branch() == pytest.approx(0.1166, abs=1e-4)


def test_an_infeasible_run_has_no_rank() -> None:
    run = record("ga", 0, [(10, 0.9)])
    assert Results(LITERAL, {("as-printed-0.2", "ga"): [run]}).list_ends("0.2", 2.0) == [1.8]
