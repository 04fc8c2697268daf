"""Rows of the baseline's table have all that rankings need."""

import math
from dataclasses import replace
from pathlib import Path

import pytest

from benchmarks.gaitbench.baseline import make_rows, write_table
from compare.analysis.comparison import compare_problems
from compare.analysis.record_statistics import ECDF_TARGETS, TARGETS
from compare.bench import leaderboard
from compare.study.record import RunRecord
from compare.study.study import Study, run_study
from nlp_gait.errors import InputError

ID = "walk12-w015"


@pytest.fixture(scope="module")
def runs() -> list[RunRecord]:
    """A few runs of three solvers, the last of which finds nothing."""
    planned = leaderboard.plan_bench_runs([ID], dict.fromkeys(("pso", "ipopt", "random"), ""), runs=3, evaluations=1000)
    records = run_study(Study(runs=planned))
    infeasible = [
        replace(r, objective=math.nan, violation=1.0, feasible=False) for r in records if r.solver == "random"
    ]
    return [r for r in records if r.solver != "random"] + infeasible


def test_a_table_gives_the_same_rankings_as_the_records(
    runs: list[RunRecord], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Running times to all targets are equal; equal rows give an equal file."""
    rows, path = make_rows(runs), tmp_path / "table.csv.xz"
    write_table(rows, path)
    first = path.read_bytes()
    write_table(rows, path)
    assert path.read_bytes() == first and repr(leaderboard.load_table(path)[ID]) == repr(tuple(rows))
    monkeypatch.setattr(leaderboard, "load_table", lambda: {ID: tuple(rows)})
    again = [leaderboard.make_record(row) for row in rows]
    references = {ID: leaderboard.get_reference(ID)}
    (before,), (after,) = (compare_problems(records, references=references) for records in (runs, again))
    for old in before.solvers:
        new = next(solver for solver in after.solvers if solver.name == old.name)
        assert new.costs == old.costs
        for target in (*TARGETS, *ECDF_TARGETS):
            assert new.expected_cost(target) == old.expected_cost(target)
            assert [c.cost_to_reach(target) for c in new.curves] == [c.cost_to_reach(target) for c in old.curves]
        assert [c.total_cost() for c in new.curves] == [c.total_cost() for c in old.curves]


def test_an_instance_without_a_baseline_is_named() -> None:
    with pytest.raises(InputError, match="no baseline of 'gb2:ssp:0' is shipped"):
        leaderboard.load_baseline("gb2:ssp:0")
