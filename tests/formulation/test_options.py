"""A problem records its options, loads with them again, and is pickled as its maker, options and values."""

import copy
import inspect
import pickle
from collections.abc import Callable
from fractions import Fraction
from pathlib import Path
from typing import Any, Literal, get_args, get_origin, get_type_hints

import numpy as np
import pytest

import nlp_gait
from compare.judge import evaluate
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.errors import InputError
from nlp_gait.formulation import GaitProblem, load
from nlp_gait.formulation.registry import find_maker
from nlp_gait.providers import PROBLEMS
from tests.backends.toys import corner, toy
from tests.evaluation import evaluated
from tests.robots.crooked import crooked

# Another value for each option that is no choice among some; a grid with free joints needs a sample in its middle.
OTHER: dict[str, Any] = {
    "robot": "nao-v6",
    "steps": 4,
    "slope_deg": 3.0,
    "intervals": 16,
    "rotational_inertia": False,
    "step_length_m": 0.07,
    "samples_per_interval": 2,
    "limits": "FrictionCone",
    "drive_limits": False,
    "alike": True,
    "angle_limits": False,
    "duration_s": 3.0,
    "instance": "walk12-w100",
    "tracking_limit": False,
    "stairs": 3,
}


# Both or none, and on the level: tested by themselves, as footholds are.
STAIRS = {"stair_rise_m": 0.02, "stair_run_m": 0.2}


def defaults(name: str) -> dict[str, Any]:
    return {option: parameter.default for option, parameter in inspect.signature(find_maker(name)).parameters.items()}


def others(name: str) -> dict[str, Any]:
    """A value that is not its default for every option; of a choice, the one after the default."""
    hints, found = get_type_hints(find_maker(name)), {}
    for option, default in defaults(name).items():
        if option in (*STAIRS, "footholds"):
            continue
        choices = get_args(hints[option]) if get_origin(hints[option]) is Literal else ()
        found[option] = (
            choices[(choices.index(default) + 1) % len(choices)] if choices and option not in OTHER else OTHER[option]
        )
        assert found[option] != default
    return found


def test_stairs_are_recorded(tmp_path: Path) -> None:
    problem = load("humanoid-walk", robot=crooked(tmp_path), intervals=2, **STAIRS)
    again = load("humanoid-walk", **problem.options)
    assert STAIRS.items() <= problem.options.items()
    assert (again.options, again.names, again.parameters) == (problem.options, problem.names, problem.parameters)
    with pytest.raises(InputError, match=r"stairs are level, but slope_deg is 3"):
        load("humanoid-walk", robot=problem.options["robot"], **STAIRS, slope_deg=3.0)


@pytest.mark.parametrize(
    "name",
    [pytest.param(name, marks=[pytest.mark.slow] if name.startswith("humanoid-") else []) for name in PROBLEMS],
)
def test_every_option_is_recorded(name: str) -> None:
    """With all the others; loading the recorded ones gives the same variables, grid and parameters."""
    for option, value in others(name).items():
        problem = load(name, **{option: value})
        recorded_values, wanted = defaults(name) | dict(problem.options), defaults(name) | {option: value}
        if option != "samples_per_interval":  # which follows from the trajectory
            recorded_values.pop("samples_per_interval", None), wanted.pop("samples_per_interval", None)
        assert recorded_values == wanted
        again = load(problem.name, **problem.options)
        assert again.options == problem.options
        assert (again.names, again.grid, again.parameters) == (problem.names, problem.grid, problem.parameters)


def test_the_judge_counts_the_intervals_of_its_grid() -> None:
    """With three samples an interval it needs 34 times as many to have at least 1,000."""
    problem = load("nao-ssp", samples_per_interval=3)
    middle = (problem.lower + problem.upper) / 2
    verdict = evaluate(load(problem.name, **problem.options), middle)
    dense = problem.dense(34)
    assert dense is not None
    assert verdict.dense_intervals == 34 * 30
    assert len(dense.signals(middle).arrays["t"]) == verdict.dense_intervals + 1
    assert verdict.dense == evaluated(dense, middle).metrics


def test_the_samples_of_a_trajectory_are_recorded() -> None:
    """Zero samples leave the choice to the trajectory; asking for what a cubic gets anyway changes nothing."""
    assert load("nao-ssp", trajectory="quintic").options["samples_per_interval"] == 4
    assert load("nao-ssp", samples_per_interval=1).options == load("nao-ssp").options
    assert load("nao-ssp", samples_per_interval=4).options["samples_per_interval"] == 4


def test_numbers_of_numpy_are_accepted() -> None:
    plain = load("nao-ssp", intervals=10, step_length_m=0.07)
    made = load("nao-ssp", intervals=np.int64(10), step_length_m=np.float64(0.07), robot=np.str_("nao-v5"))
    assert made.options == plain.options
    assert {type(value) for value in made.options.values()} == {type(value) for value in plain.options.values()}
    single = load("nao-ssp", step_length_m=np.float32(0.0625))
    assert single.options["step_length_m"] == 0.0625 and type(single.options["step_length_m"]) is float
    for number in (np.float32(0.025), np.float16(0.025), Fraction(1, 40)):
        moved = plain.fix(swing_height_m=number).with_values(**{"hip_height_m.lower": np.float32(0.25)})
        assert moved.values == {
            "swing_height_m.lower": float(number),
            "swing_height_m.upper": float(number),
            "hip_height_m.lower": 0.25,
        }
        assert all(type(value) is float for value in moved.values.values())


@pytest.mark.parametrize("value", [True, np.bool_(True), np.float32("nan"), np.array([0.02]), 0.02 + 0j, "0.02", None])
def test_values_that_are_not_numbers_are_refused(value: Any) -> None:
    with pytest.raises(InputError, match="must be a finite number"):
        load("nao-ssp").with_values(**{"swing_height_m.lower": value})
    with pytest.raises(InputError, match="option intervals must be a whole number"):
        load("nao-ssp", intervals=value)


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
    assert (again.load_name, again.options, again.values) == (problem.load_name, problem.options, problem.values)
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
