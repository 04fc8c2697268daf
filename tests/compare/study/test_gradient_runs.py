"""Gradient methods as runs: SLSQP on finite differences, other NLP solvers, limits."""

import numpy as np
import pytest

from compare.study.run import ProblemSpec, Run
from tests.compare.records import run_once

SSP = ProblemSpec(name="nao-ssp")
OPTIMUM = 0.845868


def test_slsqp_finds_the_optimum_and_counts_every_finite_difference() -> None:
    record = run_once(Run(problem=SSP, solver="slsqp"))
    assert record.reported_feasible and record.feasible
    assert record.objective == pytest.approx(OPTIMUM, rel=1e-4)
    assert record.counts["f"] == record.history.evaluations[-1] > 10 * record.iterations
    assert (np.diff(record.history.evaluations) > 0).all() and (np.diff(record.time_s.history) > 0.0).all()


def test_slsqp_keeps_its_best_point_within_the_budget() -> None:
    record = run_once(Run(problem=SSP, solver="slsqp", evaluations=45))
    assert record.status == "evaluation budget used" and not record.reported_feasible
    assert record.counts["f"] <= 45 and set(record.x) == set(SSP.load().names)
    assert run_once(Run(problem=SSP, solver="slsqp", time_limit_s=1e-9)).status == "time limit reached"
