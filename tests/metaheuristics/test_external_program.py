"""Programs that take part by lines of JSON: what they receive, how they end, and every way in which they fail."""

import json
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from metaheuristics.errors import SearchError
from metaheuristics.external_program import ExternalProgram
from metaheuristics.interface import Result
from metaheuristics.minimize import minimize
from nlp_gait.backends.kernel.compiler import find_compiler

CALLERS = Path(__file__).parents[2] / "examples" / "callers"
PROGRAM = """
import json, random, sys
problem = json.loads(sys.stdin.readline())
rng = random.Random(problem["seed"])
assert problem["names"] == ["a", "b"] and problem["settings"] == {"rows": 7}, problem
worst = 0
while True:
    x = [[rng.uniform(*ends) for ends in zip(problem["lower"], problem["upper"])] for _ in range(7)]
    print(json.dumps({"x": x if worst else x[0]}), flush=True)
    answer = json.loads(sys.stdin.readline())
    if "stop" in answer:
        break
    for point, f, violation, cost in zip(x, answer["f"], answer["violation"], answer["cost"]):
        assert (f is None) == (point[0] > 0.9) and (cost == f) == (violation == 0 and f is not None), (f, violation, cost)
    worst += 1
"""


class Disc:
    """Sum of squares outside a disc; it fails near one edge."""

    names = ("a", "b")
    lower = np.array([-1.0, 0.0])
    upper = np.array([1.0, 2.0])

    def __call__(self, X: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        squares = np.sum(X**2, axis=1)
        return np.where(X[:, 0] > 0.9, np.nan, squares), np.maximum(0.0, 0.25 - squares)


def run(*command: str, answer_s: float = 20.0, **settings: int) -> Result:
    program = ExternalProgram(
        command=command, name="own", settings=settings, answer_s=answer_s, first_answer_s=answer_s
    )
    return minimize(Disc(), program, evaluations=50, seed=3)


def test_a_program_is_counted_seeded_and_repeats_its_run() -> None:
    first, again = (run(sys.executable, "-c", PROGRAM, rows=7) for _ in range(2))
    assert first.evaluations == 50 and first.reasons == ("evaluation budget used",)
    assert first.feasible and np.array_equal(first.x, again.x) and first.objective == again.objective
    assert np.array_equal(first.history.objective, again.history.objective)


def test_a_program_may_end_by_itself() -> None:
    said = run("sh", "-c", 'echo \'{"x": [0.5, 1]}\'; read a; read a; echo \'{"stop": "good enough"}\'')
    assert said.evaluations == 1 and "good enough" in said.reasons[0]
    ended = run("sh", "-c", "printf '{\"x\": [[0.5, 1], [1.0000000001, 0]]}\\n'; read a; read a")
    assert ended.evaluations == 2 and ended.reasons == ("the program ended",)


def test_a_program_may_leave_a_process_behind_that_holds_its_output() -> None:
    held = run("sh", "-c", "printf '{\"x\": [0, 1]}\\n'; read a; read a; sleep 30 & exit 0")
    assert held.evaluations == 1


@pytest.mark.parametrize(
    ("script", "message"),
    [
        ("exit 3", "status 3: no message"),
        ("echo oh dear >&2; exit 1", "status 1: oh dear"),
        ("kill -9 $$", "status -9"),
        # It is waited for.
        pytest.param(
            "sleep 30", "sent nothing for 0.5 s: it has not sent its first.*in Octave", marks=pytest.mark.slow
        ),
        ("echo hello", "neither"),
        ("""printf '{"x": [[0.1,'""", "neither"),
        ("""printf '{"x": [[1, 2, 3]]}\\n'""", r"\(P, 2\)"),
        ("""printf '{"x": [[0, 1e999]]}\\n'""", "outside the bounds"),
        ("""printf '{"x": [[0, 2.1]]}\\n'""", "outside the bounds"),
        ("head -c 3000000 /dev/zero", "neither"),
        ("exit 0", "f was never called: the program ended"),
    ],
)
def test_faulty_programs_fail_with_one_sentence(script: str, message: str) -> None:
    with pytest.raises(SearchError, match=message) as failure:
        run("sh", "-c", script, answer_s=0.5)
    assert "\n" not in str(failure.value) and len(str(failure.value)) < 600


def test_a_program_that_hangs_ends_at_the_time_limit_with_its_best_point() -> None:
    script = "printf '{\"x\": [0.5, 1]}\\n'; read a; read a; exec sleep 30"
    program = ExternalProgram(command=("sh", "-c", script), name="own")
    result = minimize(Disc(), program, evaluations=100, time_limit_s=1.0)
    assert (result.evaluations, result.reasons) == (1, ("time limit reached",))
    assert result.x.tolist() == [0.5, 1.0]


def test_a_missing_program_is_named() -> None:
    with pytest.raises(SearchError, match="'/no/such' cannot be started: No such file"):
        run("/no/such")


def test_the_caller_in_cpp(tmp_path: Path) -> None:
    program = tmp_path / "random_search"
    command = [*find_compiler().command, "-o", str(program), str(CALLERS / "random_search.cpp")]
    subprocess.run(command, check=True)
    assert run(str(program)).evaluations == 50


@pytest.mark.parametrize(
    "caller",
    [
        pytest.param(caller, marks=pytest.mark.program(caller.split()[0]))
        for caller in ("octave-cli --quiet genetic.m", "julia random_search.jl", "Rscript random_search.R")
    ],
)
def test_callers_in_other_languages(caller: str) -> None:
    program, *arguments = caller.split()
    if (
        program == "Rscript"
        and subprocess.run([program, "-e", "library(jsonlite)"], stderr=subprocess.DEVNULL).returncode
    ):
        pytest.skip("R's package jsonlite is not installed")
    first, again = (run(program, *arguments[:-1], str(CALLERS / arguments[-1])) for _ in range(2))
    assert first.evaluations == 50 and np.array_equal(first.x, again.x), json.dumps(first.reasons)
