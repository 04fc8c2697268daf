"""The quick reproduction of the 12-joint walk, and its paper data."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from compare.papers.paper_runs import Runner
from compare.papers.walk12.walk12 import (
    LITERAL,
    RAISED,
    READINGS,
    REPRODUCTION,
    SECOND,
    TABLE_3,
    TABLE_4,
    Results,
    count_met,
    find_branch,
    list_ends,
    list_rod_changes,
)
from compare.study.record import read_record
from tests.compare.records import record


@pytest.fixture(scope="module")
def found(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, dict[str, Any]]:
    """Folder and record of the quick reproduction, in this process."""
    folder = tmp_path_factory.mktemp("walk12")
    return folder, REPRODUCTION.reproduce(Runner(folder=folder, jobs=1), REPRODUCTION.quick)


def test_f1_that_table_4_implies() -> None:
    assert [round(row.implied_f1) for row in TABLE_4] == [1139, 726, 277, 164]


def test_claims_hold_in_some_readings_only(found: tuple[Path, dict[str, Any]]) -> None:
    verdicts = found[1]["verdicts"]
    assert verdicts["f1-last"] == {name: "holds" if name == RAISED else "does not hold" for name in READINGS}
    assert verdicts["f1-over-time"] == {name: "holds" if name == SECOND else "does not hold" for name in READINGS}
    assert verdicts["time-steps"][LITERAL] == "holds"


def test_an_ankle_above_the_ground_meets_more_of_the_printed_f() -> None:
    assert [count_met(Results(name, {})) for name in (LITERAL, RAISED)] == [3, 5]


def test_moments_of_rods_are_small_and_2_misses_deeply_bent_legs_only() -> None:
    changes = list_rod_changes(Results(LITERAL, {}))
    assert (round(min(changes), 2), round(max(changes), 2)) == (0.04, 0.09)
    assert find_branch() == pytest.approx(0.1166, abs=1e-4)


def test_an_infeasible_run_has_no_rank() -> None:
    run = record("ga", 0, [(10, 0.9)])
    assert list_ends(Results(LITERAL, {("as-printed-0.2", "ga"): [run]}), ["0.2"], 2.0) == [[1.8]]


def test_tables_agree_with_the_records(found: tuple[Path, dict[str, Any]]) -> None:
    records = found[0] / "records"
    starts = [read_record(path) for path in (records / "as-printed-1").glob("ipopt-*.json")]
    assert len(starts) == REPRODUCTION.quick.starts
    (table,) = [part for part in found[1]["parts"] if part.get("caption", "").startswith("Table III")]
    shown = dict(zip(table["columns"], table["rows"][-1], strict=True))
    assert float(shown["IPOPT: f"]) == pytest.approx(max(run.verdict.objective for run in starts), rel=5e-4)
    assert float(shown["paper: f"]) == TABLE_3[-1].f
