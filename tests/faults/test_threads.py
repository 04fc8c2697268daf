"""Equal seeds give equal results for every solver, whatever the threads, hash seed and processes."""

from __future__ import annotations

import io
import os
import subprocess
import sys
import warnings
from contextlib import redirect_stdout

import pytest

from tests.faults.processes import ROOT

THREADS = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
# Numbers are printed to the last bit.
PROGRAM = """
import metaheuristics, nlp_gait
from compare.study.task import GRADIENT_SOLVERS, list_solvers
from nlp_gait.backends.solvers.registry import make_solver
problem = nlp_gait.load("nao-ssp", intervals=4)
objective = nlp_gait.compile_objective(problem, threads=1)
for name in list_solvers():
    if name in GRADIENT_SOLVERS:
        continue
    found = metaheuristics.minimize(objective, metaheuristics.make_algorithm(name), evaluations=170, seed=1)
    print(name, found.evaluations, found.objective.hex(), [value.hex() for value in found.x.tolist()])
for name, settings in (("ipopt", {}), ("slsqp", {"evaluations": 100})):
    outcome = make_solver(name, **settings).prepare(problem, 1).run(problem, 0.5 * (problem.lower + problem.upper))
    print(name, outcome.evaluations.f, outcome.objective.hex(), [value.hex() for value in outcome.x.tolist()])
"""


@pytest.mark.slow
def test_every_solver_repeats_its_result_in_other_processes() -> None:
    """One process has one thread and a fixed hash seed, this one all threads and any hash seed."""
    one = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        cwd=ROOT,
        env={**os.environ, **dict.fromkeys(THREADS, "1"), "PYTHONHASHSEED": "1"},
        capture_output=True,
        text=True,
        timeout=300,
        check=True,
    )
    printed = io.StringIO()
    with redirect_stdout(printed), warnings.catch_warnings():
        warnings.simplefilter("ignore")  # as in a process of its own
        exec(PROGRAM, {})  # noqa: S102
    assert one.stdout.splitlines() == printed.getvalue().splitlines()
    assert one.stdout.count("\n") >= 23
