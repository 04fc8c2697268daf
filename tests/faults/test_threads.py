"""The number of threads of BLAS and OpenMP changes no bit of a result."""

from __future__ import annotations

import os
import subprocess
import sys

import pytest

from tests.faults.processes import ROOT

VARIABLES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS")
# CMA-ES takes eigenvalues by LAPACK; numbers are printed to the last bit.
PROGRAM = """
import metaheuristics, nlp_gait
problem = nlp_gait.load("walk12")
objective = nlp_gait.compile_objective(problem)
for name in ("cma", "pso"):
    for seed in (0, 1):
        found = metaheuristics.minimize(objective, metaheuristics.algorithm(name), evaluations=1000, seed=seed)
        print(name, found.objective.hex(), [value.hex() for value in found.x.tolist()])
solution = nlp_gait.solve(problem, starts=3)
for start in solution.starts:
    print("ipopt", start.objective.hex(), start.iterations)
print([value.hex() for value in solution.x.values()])
"""


@pytest.mark.slow
def test_threads_change_no_bit() -> None:
    one, two = (
        subprocess.run(
            [sys.executable, "-c", PROGRAM],
            cwd=ROOT,
            env={**os.environ, **dict.fromkeys(VARIABLES, threads)},
            capture_output=True,
            text=True,
            timeout=120,
            check=True,
        )
        for threads in "12"
    )
    assert one.stdout == two.stdout and one.stdout.count("\n") == 8
    assert not one.stderr and not two.stderr
