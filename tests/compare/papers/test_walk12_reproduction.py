"""Rules and data of the 12-joint walk's paper."""

import pytest

from compare.papers.walk12.page import count_met
from compare.papers.walk12.results import LITERAL, RAISED, TABLE_4, Results
from compare.papers.walk12.walk12 import find_branch, list_rod_changes
from tests.compare.records import record


def test_f1_that_table_4_implies() -> None:
    assert [round(row.implied_f1) for row in TABLE_4] == [1139, 726, 277, 164]


def test_an_ankle_above_the_ground_meets_more_of_the_printed_f() -> None:
    assert [count_met(Results(name, {})) for name in (LITERAL, RAISED)] == [3, 5]


def test_moments_of_rods_are_small_and_2_misses_deeply_bent_legs_only() -> None:
    changes = list_rod_changes(Results(LITERAL, {}))
    assert (round(min(changes), 2), round(max(changes), 2)) == (0.04, 0.09)
    assert find_branch() == pytest.approx(0.1166, abs=1e-4)


def test_an_infeasible_run_has_no_rank() -> None:
    run = record("ga", 0, [(10, 0.9)])
    assert Results(LITERAL, {("as-printed-0.2", "ga"): [run]}).list_ends("0.2", 2.0) == [1.8]
