"""Logs in the format of iohinspector; tests/test_other_packages.py reads them with it."""

import json
from dataclasses import replace
from pathlib import Path

import pytest

from compare.analysis.comparison import Comparison, compare_problems
from compare.bench.baseline import get_reference, load_baseline
from compare.logs import NOTHING_FEASIBLE, SMALLEST, list_gaps, write_ioh

INSTANCES = ("walk12-w015", "ssp-v5")


def compare_baselines() -> list[Comparison]:
    """Compare the runs of the shipped baseline, which have no points."""
    runs = [record for id in INSTANCES for record in load_baseline(id)]
    runs = [replace(record, x=dict.fromkeys(record.x, 0.5)) for record in runs]
    return compare_problems(runs, references={id: get_reference(id) for id in INSTANCES})


@pytest.fixture(scope="module")
def comparisons() -> list[Comparison]:
    return compare_baselines()


def test_a_trace_begins_at_one_evaluation_and_improves(comparisons: list[Comparison]) -> None:
    for solver in comparisons[-1].solvers:
        for curve in solver.curves:
            evaluations, gaps = zip(*list_gaps(curve).items(), strict=True)
            assert evaluations[0] == 1 and gaps[0] <= NOTHING_FEASIBLE
            assert list(evaluations) == sorted(set(evaluations)) and list(gaps) == sorted(set(gaps), reverse=True)
            assert min(gaps) >= SMALLEST and evaluations[-1] <= max(1, curve.total_cost())


def test_runs_are_numbered_from_one_and_gaps_are_minimised(comparisons: list[Comparison], tmp_path: Path) -> None:
    assert NOTHING_FEASIBLE == 1e10  # as documented
    runs = [str(run + 1) for run in range(15)]
    for path in (path for path in write_ioh(comparisons[:1], tmp_path / "ioh") if path.suffix == ".json"):
        header = json.loads(path.read_text())
        assert [str(run["instance"]) for run in header["scenarios"][0]["runs"]] == runs
        assert header["maximization"] is False
