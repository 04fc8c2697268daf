"""One process or several, one thread or several: the same numbers."""

from __future__ import annotations

import copy
import multiprocessing
import os
import pickle
import subprocess
import sys
import threading
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest

import nlp_gait
from compare.judge import evaluate
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.errors import InputError
from nlp_gait.formulation import GaitProblem
from tests.backends.toys import corner, toy
from tests.faults.processes import ROOT

EXAMPLE = ROOT / "examples" / "bring_your_own.py"


@pytest.mark.slow
def test_four_threads_solve_one_problem_and_build_it_once() -> None:
    problem = nlp_gait.load("walk12")
    points = [problem.start_point(np.random.default_rng(k)) for k in range(4)]
    builds: list[str] = []

    def build(problem: GaitProblem) -> object:
        builds.append("built")
        return object()

    together_at = threading.Barrier(4)

    def solved(k: int) -> tuple[bool, float, bytes, float]:
        together_at.wait()
        problem.build_once(build)
        solution = nlp_gait.solve(problem, x0=points[k])
        history = problem.signals(solution.x)
        judged = float(evaluate(problem, solution.x).objective["value"])
        return solution.converged, solution.objective, history.arrays["q"].tobytes(), judged

    with ThreadPoolExecutor(4) as pool:
        shared = list(pool.map(solved, range(4)))
    assert builds == ["built"]
    together_at = threading.Barrier(1)
    assert shared == [solved(k) for k in range(4)]
    assert all(success for success, *_ in shared)


def test_threads_may_use_what_was_never_built_and_the_interpreted_objective(without_compiler: None) -> None:
    def values(_: int) -> list[float]:
        problem = nlp_gait.load("walk12")
        objective = nlp_gait.compile_objective(problem)
        assert objective.backend == "interpreted"
        points = np.random.default_rng(0).uniform(problem.lower, problem.upper, (70, len(problem.names)))
        return [*objective(points)[0].tolist(), float(evaluate(problem, points[0]).objective["value"])]

    with ThreadPoolExecutor(4) as pool:
        first, *others = pool.map(values, range(4))
    assert others == [first] * 3


FORKED = """
import multiprocessing, sys
import numpy as np
import nlp_gait

problem = nlp_gait.load("nao-ssp")
objective = nlp_gait.compile_objective(problem, threads=2)
X = np.random.default_rng(0).uniform(objective.lower, objective.upper, (4000, len(objective.names)))

def inherited(_):
    return objective(X)[0].tolist()

def sent(given):
    return given(X)[0].tolist()

def solved(k):
    found = nlp_gait.solve(problem, x0=problem.start_point(np.random.default_rng(k)))
    return found.status, found.objective, list(found.x.values()), problem.signals(found.x).arrays["q"].tobytes()

if __name__ == "__main__":
    for _ in range(3):
        expected = objective(X)[0].tolist()  # the threads of the parent have worked
    with multiprocessing.get_context(sys.argv[1]).Pool(2) as pool:
        assert pool.map(sent, [objective] * 4) == [expected] * 4
        if sys.argv[1] == "fork":
            assert pool.map(inherited, range(4)) == [expected] * 4
            assert pool.map(solved, range(4)) == [solved(k) for k in range(4)]
    print("equal")
"""


BUSY = """
import os, threading, nlp_gait
problem = nlp_gait.load("walk12")
nlp_gait.solve(problem)
busy = threading.Thread(target=lambda: nlp_gait.solve(problem, starts=4))
busy.start()
child = os.fork()
if child == 0:
    found = []
    for where in (lambda work: work(), lambda work: (alone := threading.Thread(target=work), alone.start(), alone.join(60))):
        where(lambda: found.append(nlp_gait.solve(problem).converged))
    os._exit(0 if found == [True, True] else 1)
assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0
busy.join()
print("equal")
"""
METHODS = [m for m in ("fork", "spawn") if m in multiprocessing.get_all_start_methods()]


@pytest.mark.slow
@pytest.mark.parametrize(("program", "method"), [*((FORKED, method) for method in METHODS), (BUSY, "")])
def test_what_was_used_goes_to_other_processes(program: str, method: str, tmp_path: Path) -> None:
    """A fork waits until no other thread is inside CasADi."""
    path = tmp_path / "program.py"
    path.write_text(program)
    done = subprocess.run(
        [sys.executable, str(path), method],
        env={**os.environ, "PYTHONPATH": str(ROOT)},
        capture_output=True,
        text=True,
        timeout=200,
    )
    assert done.stdout == "equal\n", done.stderr


@pytest.mark.parametrize(
    "make",
    [
        pytest.param(lambda: nlp_gait.load("walk12").with_values(**{"lambda": 0.15}), id="values"),
        pytest.param(
            lambda: nlp_gait.load("nao-ssp", robot="nao-v5@mass=1.05", intervals=10).fix(swing_height_m=0.024),
            id="options",
            marks=pytest.mark.slow,
        ),
        pytest.param(lambda: nlp_gait.load("nao-dsp").dense(2), id="dense", marks=pytest.mark.slow),
        pytest.param(lambda: nlp_gait.load(f"{EXAMPLE}:two_link", intervals=10), id="own code"),
    ],
)
def test_a_problem_is_pickled_as_its_maker_options_and_values(make: Callable[[], GaitProblem]) -> None:
    problem = make()
    text = pickle.dumps(problem)
    assert len(text) < 20_000
    again = pickle.loads(text)
    assert (again.address, again.options, again.values) == (problem.address, problem.options, problem.values)
    first, second = (made.start_point(np.random.default_rng(0)) for made in (problem, again))
    assert np.array_equal(first, second) and evaluate(problem, first).violation == evaluate(again, first).violation
    assert build_exact_model(pickle.loads(text)) is build_exact_model(again)  # built once
    assert copy.deepcopy(problem) is copy.copy(problem) is problem


def test_a_problem_without_a_maker_is_refused_by_name() -> None:
    walk = nlp_gait.load("walk12")
    for problem in (toy(corner), walk.derive(title="other mathematics under the same name")):
        for given in (problem, nlp_gait.compile_objective(problem)):
            with pytest.raises(
                InputError, match=rf"problem '{problem.name}' cannot be pickled.*make it in the other process"
            ):
                pickle.dumps(given)


def test_a_robot_or_code_that_changed_on_the_way_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "robot.json"
    path.write_text('{"schema": 1, "name": "mine", "extends": "nao-v5"}')
    text = pickle.dumps(nlp_gait.load("nao-ssp", robot=str(path)))
    path.write_text('{"schema": 1, "name": "mine", "extends": "nao-v6"}')
    with pytest.raises(InputError, match="file of its robot has changed"):
        pickle.loads(text)
    code = tmp_path / "own.py"
    code.write_text(EXAMPLE.read_text())
    text = pickle.dumps(nlp_gait.load(f"{code}:two_link", intervals=10))
    code.write_text(EXAMPLE.read_text().replace("0.05", "0.06"))
    with pytest.raises(InputError, match="has changed since the problem was pickled"):
        pickle.loads(text)
