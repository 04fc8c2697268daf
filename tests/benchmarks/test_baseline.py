"""Packed records of the baseline have all that the leaderboard needs."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from benchmarks.gaitbench.baseline import pack_records
from compare.analysis.comparison import compare_problems
from compare.analysis.record_statistics import TARGETS
from compare.bench.baseline import load_baseline, make_bench_study
from compare.study.record import RunRecord
from compare.study.run_study import Study, run_study
from compare.study.settings import SolverSpec
from nlp_gait.errors import InputError

ID = "walk12-w015"


@pytest.fixture(scope="module")
def runs() -> list[RunRecord]:
    """A few runs of two solvers."""
    solvers = (SolverSpec(name="pso"), SolverSpec(name="ipopt"))
    return run_study(Study(tasks=make_bench_study([ID], *solvers, runs=3, evaluations=1000).tasks()))


@pytest.mark.slow
def test_packing_keeps_what_the_leaderboard_needs(runs: list[RunRecord], tmp_path: Path) -> None:
    """Expected running times and final objectives to twelve digits; equal records give an equal file."""
    path = pack_records(ID, runs, tmp_path)
    first = path.read_bytes()
    assert pack_records(ID, runs, tmp_path).read_bytes() == first
    again = load_baseline(ID, tmp_path)
    assert [(r.solver, r.run, r.seed, r.status) for r in again] == [(r.solver, r.run, r.seed, r.status) for r in runs]
    (before,), (after,) = map(compare_problems, (runs, again))
    for old, new in zip(before.solvers, after.solvers, strict=True):
        np.testing.assert_allclose(new.costs, old.costs, rtol=1e-12)
        for target in (1.0, *TARGETS):
            assert new.expected_cost(target) == old.expected_cost(target)
        assert [c.total_cost() for c in new.curves] == [c.total_cost() for c in old.curves]
    with pytest.raises(InputError, match="does not belong"):
        pack_records("ssp-v5", runs, tmp_path)
    with pytest.raises(InputError, match="differ in their settings"):
        pack_records(
            ID, [runs[0], replace(runs[1], definition={**runs[1].definition, "settings": {"population": 7}})], tmp_path
        )
    with pytest.raises(InputError, match="no baseline records of 'ssp-v4'"):
        load_baseline("ssp-v4", tmp_path)
