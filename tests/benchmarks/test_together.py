"""The comparison of threads and forked processes with one thread: none differs, and a difference would be found."""

from __future__ import annotations

import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import pytest

import nlp_gait
from benchmarks.faults import together
from tests.backends.toys import corner, toy
from tests.faults.processes import ROOT


@pytest.mark.slow
def test_threads_and_forked_processes_find_what_one_thread_does() -> None:
    # In a process of its own: forking the suite, with all its threads, is not what is tested.
    done = subprocess.run(
        [sys.executable, "-m", "benchmarks.faults.together", "--problem", "walk12", "--solves", "2"],
        cwd=ROOT,
        capture_output=True,
        text=True,
        timeout=300,
    )
    assert done.returncode == 0, done.stderr
    assert "8 threads x 2: 0 differ" in done.stdout and "4 forked processes x 2: 0 differ" in done.stdout


def test_a_difference_would_be_found() -> None:
    problem = toy(corner)
    objective = nlp_gait.compile_objective(problem)
    found = [nlp_gait.solve(problem, x0=x0).objective for x0 in ([0.0, 0.0], [1.0, 1.0])]
    serial = [together.Found(True, "", value, (), objective([[0.0, 0.0]])[0].tolist(), b"") for value in found]  # type: ignore[arg-type]
    with ThreadPoolExecutor(2) as pool:
        assert together.different(pool, 2, lambda k: serial[k], serial) == 0
        assert together.different(pool, 2, lambda k: serial[1 - k], serial) == (4 if found[0] != found[1] else 0)
        assert together.different(pool, 2, lambda k: serial[k]._replace(objective=1.5), serial) == 4
