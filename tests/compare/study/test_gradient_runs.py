"""Gradient methods as runs: SLSQP on finite differences, other NLP solvers, limits."""

import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import nlp_gait
from compare.study.run import ProblemSpec, Run, Stop
from nlp_gait.backends.solvers import nlpsol
from nlp_gait.backends.solvers.registry import make_solver
from nlp_gait.errors import InputError, UnknownNameError
from tests.compare.records import run_once

SSP = ProblemSpec(name="nao-ssp")
OPTIMUM = 0.845868


@pytest.mark.slow
def test_slsqp_finds_the_optimum_and_counts_every_finite_difference() -> None:
    record = run_once(Run(problem=SSP, solver="slsqp"))
    assert record.reported_feasible and record.feasible
    assert record.objective == pytest.approx(OPTIMUM, rel=1e-4)
    assert record.counts["f"] == record.history.evaluations[-1] > 10 * record.iterations
    assert (np.diff(record.history.evaluations) > 0).all() and (np.diff(record.time_s.history) > 0.0).all()


@pytest.mark.slow
def test_slsqp_keeps_its_best_point_within_the_budget() -> None:
    record = run_once(Run(problem=SSP, solver="slsqp", stop=Stop(evaluations=45)))
    assert record.status == "evaluation budget used" and not record.reported_feasible
    assert record.counts["f"] <= 45 and set(record.x) == set(SSP.load().names)
    assert run_once(Run(problem=SSP, solver="slsqp", stop=Stop(time_limit_s=1e-9))).status == "time limit reached"


@pytest.mark.slow
@pytest.mark.parametrize("name", ["fatrop", "sqpmethod", "uno"])
def test_other_nlp_solvers_reach_the_same_optimum(name: str) -> None:
    reason = nlpsol.probe(name)
    if reason is not None:
        pytest.skip(f"{name} does not run here: {reason}")
    record = run_once(Run(problem=SSP, solver="nlpsol", settings={"plugin": name}))
    assert record.reported_feasible
    assert record.objective == pytest.approx(OPTIMUM, rel=1e-5)
    assert record.violation < 1e-5  # fatrop relaxes bounds by more than the judge's 1e-6, and is told so
    assert record.counts["f"] > 0 and record.counts["gradient"] > 0


@pytest.mark.slow
def test_other_nlp_solvers_print_nothing() -> None:
    program = (
        "from compare.study.run import ProblemSpec, Run; from tests.compare.records import run_once\n"
        "run_once(Run(problem=ProblemSpec(name='walk12'), solver='nlpsol'))"
    )
    done = subprocess.run(
        [sys.executable, "-c", program], cwd=Path(__file__).parents[3], capture_output=True, text=True, timeout=120
    )
    assert done.returncode == 0 and done.stdout == ""


def test_a_solver_that_crashes_while_probed_is_a_reason(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(nlpsol, "PROBE", "import os; os.kill(os.getpid(), 9)")
    nlpsol.probe.cache_clear()
    try:
        assert nlpsol.probe("fatrop") == "it exits with status -9"
        with pytest.raises(InputError, match="'fatrop' does not run in this installation"):
            make_solver("nlpsol", plugin="fatrop").run(nlp_gait.load("nao-ssp", intervals=5), np.zeros(9))
    finally:
        nlpsol.probe.cache_clear()
    with pytest.raises(UnknownNameError, match="unknown NLP solver 'snop'"):
        make_solver("snop")
