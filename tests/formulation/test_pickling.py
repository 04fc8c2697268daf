"""A problem in other processes: it is pickled as its maker, options and values, and refused if these have changed."""

import copy
import pickle
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import nlp_gait
from compare.judge import evaluate
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.errors import InputError
from nlp_gait.formulation import GaitProblem
from tests.backends.toys import corner, toy

EXAMPLE = Path(__file__).parents[2] / "examples" / "bring_your_own.py"


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
