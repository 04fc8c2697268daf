"""Logs that iohinspector reads: as many runs, the same expected running times and the same distribution as ours."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from compare.analysis.comparison import Comparison, compare_problems
from compare.analysis.record_statistics import compute_ecdf
from compare.bench.baseline import get_reference, load_baseline
from compare.logs import NOTHING_FEASIBLE, SMALLEST, make_traces, write_ioh

BUDGET = 10_000
TARGETS = 2_001  # of our distribution; iohinspector's has no end of them
SOLVERS = ("pso", "random", "de")
INSTANCES = ("walk12-w015", "ssp-v5")


@pytest.fixture(scope="module")
def comparisons() -> list[Comparison]:
    """Of the shipped baseline, whose runs have no points."""
    runs = [record for id in INSTANCES for record in load_baseline(id)]
    runs = [replace(record, x=dict.fromkeys(record.x, 0.5)) for record in runs]
    return compare_problems(runs, references={id: get_reference(id) for id in INSTANCES})


def loaded(folder: Path) -> Any:
    """Manager and data of a folder, as iohinspector reads them."""
    iohinspector = pytest.importorskip("iohinspector")
    manager = iohinspector.DataManager()
    manager.add_folder(str(folder))
    return manager, manager.load(monotonic=True, include_columns=["algorithm_name", "function_id"])


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")  # iohinspector and what it imports warn of their own
def test_iohinspector_finds_our_numbers(comparisons: list[Comparison], tmp_path: Path) -> None:
    """Expected running times exactly; the distribution as finely as targets are taken."""
    write_ioh(comparisons, tmp_path)
    manager, data = loaded(tmp_path)
    from iohinspector.metrics.ecdf import get_data_ecdf
    from iohinspector.metrics.fixed_target import aggregate_running_time

    assert len(manager.overview) == sum(len(comparison.records) for comparison in comparisons)
    compared = 0
    for number, comparison in enumerate(comparisons, start=1):
        for solver in comparison.solvers:
            if solver.name not in SOLVERS:
                continue
            rows = data.filter((data["algorithm_name"] == solver.name) & (data["function_id"] == number))
            table = aggregate_running_time(rows, f_min=1e-6, f_max=1.0, eval_max=BUDGET)
            for target, found in zip(table["raw_y"], table["ERT"], strict=True):
                ours = solver.expected_cost(float(target))
                assert found == pytest.approx(ours, rel=1e-12) or (math.isinf(found) and math.isinf(ours))
                compared += math.isfinite(ours)
            at = [100, 1000, BUDGET]
            shares = get_data_ecdf(rows, f_min=1e-6, f_max=1.0, eval_values=at)
            targets = np.logspace(0.0, -6.0, TARGETS)
            costs = np.array([[c.cost_to_reach(t) for t in targets] for c in solver.curves]).ravel()
            cost, share = compute_ecdf(costs)
            ours_at = [float(share[cost <= count][-1]) if (cost <= count).any() else 0.0 for count in at]
            np.testing.assert_allclose(shares["eaf"], ours_at, atol=1.0 / (TARGETS - 1))
    assert compared > 100


def test_a_trace_begins_at_one_evaluation_and_improves(comparisons: list[Comparison]) -> None:
    for solver in comparisons[-1].solvers:
        for trace in make_traces(solver):
            assert trace.lines[0] == (1, NOTHING_FEASIBLE) or trace.lines[0][0] == 1
            evaluations, gaps = zip(*trace.lines, strict=True)
            assert list(evaluations) == sorted(set(evaluations)) and list(gaps) == sorted(set(gaps), reverse=True)
            assert min(gaps) >= SMALLEST and evaluations[-1] <= trace.total


def test_runs_are_numbered_from_one_and_gaps_are_minimised(comparisons: list[Comparison], tmp_path: Path) -> None:
    assert NOTHING_FEASIBLE == 1e10  # as documented
    runs = [str(run + 1) for run in range(15)]
    for path in (path for path in write_ioh(comparisons[:1], tmp_path / "ioh") if path.suffix == ".json"):
        header = json.loads(path.read_text())
        assert [str(run["instance"]) for run in header["scenarios"][0]["runs"]] == runs
        assert header["maximization"] is False


def test_the_header_is_what_ioh_itself_writes(comparisons: list[Comparison], tmp_path: Path) -> None:
    """The same keys as in a file of ioh's own logger."""
    ioh = pytest.importorskip("ioh")
    logger = ioh.logger.Analyzer(root=str(tmp_path), folder_name="theirs", algorithm_name="a", algorithm_info="b")
    problem = ioh.get_problem(1, 1, 2)
    problem.attach_logger(logger)
    for x in ([0.0, 0.0], [1.0, 1.0]):
        problem(x)
    problem.reset()
    logger.close()
    theirs = json.loads(next((tmp_path / "theirs").glob("*.json")).read_text())
    path = write_ioh(comparisons[:1], tmp_path / "ours")[0]
    ours = json.loads(path.read_text())
    assert set(ours) <= set(theirs) and set(theirs) - set(ours) <= {"experiment_attributes"}
    assert set(ours["scenarios"][0]) == set(theirs["scenarios"][0])
    assert set(ours["scenarios"][0]["runs"][0]) <= set(theirs["scenarios"][0]["runs"][0])
    assert set(ours["algorithm"]) == set(theirs["algorithm"])
