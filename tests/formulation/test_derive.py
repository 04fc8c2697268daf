"""Derived problems: new functions, and everything else that a problem provides still works."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from casadi import MX

import nlp_gait
from compare.judge import evaluate
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.nlp import build_nlp
from nlp_gait.errors import InputError, UnknownNameError
from nlp_gait.formulation import Array, Assembly, Constraint, GaitProblem, Parameter, Point, Variable, load
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from tests.backends.toys import corner, toy
from tests.evaluation import evaluated

PRICE = Parameter(name="price_J_m", unit="J/m", default=2.0, description="of the slack", minimum=0.0)
SLACK = Variable(name="slack_m", unit="m", lower=0.0, upper=1.0, description="that costs")
LEAST_SLACK = 0.25
WALK_X = np.array([0.13, 0.1135, 0.02, 0.0204])


def dearer(assembly: Assembly, point: Point, ops: Nonsmooth) -> Assembly:
    """The objective with a slack at its price, and a row that asks for some."""
    asked = Constraint(name="least_slack", unit="m", scale=0.1, value=point["slack_m"], lower=MX(LEAST_SLACK))
    return replace(
        assembly,
        objective=assembly.objective + point["price_J_m"] * point["slack_m"],
        constraints=(*assembly.constraints, asked),
    )


def with_slack(problem: GaitProblem) -> GaitProblem:
    return problem.derive(name="dearer", variables=[SLACK], parameters=[PRICE], change=dearer)


@pytest.fixture(scope="module")
def walk() -> GaitProblem:
    return load("walk12", intervals=4)


def built(problem: GaitProblem) -> GaitProblem:
    """The problem after its functions were built, which a changed copy must not find."""
    build_exact_model(problem), build_nlp(problem), problem.dense(2)
    return problem


def doubled(assembly: Assembly, point: Point, ops: Nonsmooth) -> Assembly:
    return replace(assembly, objective=2.0 * assembly.objective)


@pytest.mark.parametrize("how", ["replace", "derived", "derived with other values"])
def test_a_changed_problem_has_its_own_functions(how: str) -> None:
    problem = built(toy(corner))
    if how == "replace":
        changed = replace(problem, assemble=lambda point, ops: doubled(problem.assemble(point, ops), point, ops))
    else:
        changed = problem.with_values(limit=0.25) if "values" in how else problem
        changed = changed.derive(change=doubled)
    x = [1.5, 0.0]
    assert evaluated(problem, x).cost == 2.5 and evaluated(changed, x).cost == 5.0
    assert build_nlp(changed) is not build_nlp(problem)
    assert changed.values == ({"limit": 0.25} if "values" in how else {})
    f, _ = nlp_gait.compile_objective(changed)(np.array([x]))
    assert f[0] == pytest.approx(5.0)


@pytest.mark.parametrize("name", ["nao-ssp", "nao-cycle", "walk12", "stairs-plan", "stairs-track"])
def test_time_histories_are_those_of_the_base_problem(name: str) -> None:
    """With a parameter and a variable more, at the current values of both."""
    problem = load(name)
    changed = with_slack(problem).with_values(price_J_m=3.0)
    x = (problem.lower + problem.upper) / 2
    before, after = problem.signals(x), changed.signals([*x, 0.5])
    assert before.arrays.keys() == after.arrays.keys()
    for key, values in before.arrays.items():
        np.testing.assert_array_equal(after.arrays[key], values, err_msg=key)


@pytest.mark.parametrize("name", ["nao-ssp", "nao-cycle", pytest.param("stairs-climb", marks=pytest.mark.slow)])
def test_start_points_have_the_new_variable_within_its_current_bounds(name: str) -> None:
    """Where the problem has start points of its own, and where it has none."""
    options: dict[str, Any] = {"nao-cycle": {"objective": "power"}}.get(name, {})
    problem = load(name, **options)
    changed = with_slack(problem).with_values(**{"slack_m.lower": 0.6})
    x = changed.start_point(np.random.default_rng(0))
    assert x.shape == (len(problem.names) + 1,) and 0.6 <= x[-1] <= 1.0
    if problem.hints.start is not None:
        np.testing.assert_array_equal(x[:-1], problem.start_point(np.random.default_rng(0)))


def test_denser_grids_are_adapted(walk: GaitProblem) -> None:
    changed = with_slack(walk).with_values(price_J_m=3.0)
    fine, plain = changed.dense(3), walk.dense(3)
    assert fine is not None and plain is not None
    assert (fine.name, fine.grid, fine.value("price_J_m")) == ("dearer", plain.grid, 3.0)
    found, below = evaluated(fine, [*WALK_X, 0.5]), evaluated(plain, WALK_X)
    assert walk.objective.sense == "maximise"
    assert found.cost == pytest.approx(below.cost - 1.5, rel=1e-12)
    assert found.rows["least_slack"] == 0.5 and len(found.rows) == len(below.rows) + 2


def test_the_compiled_objective_and_the_judge_see_it(walk: GaitProblem) -> None:
    changed = with_slack(walk)
    X: Array = np.column_stack([np.tile(WALK_X, (2, 1)), [0.1, 0.5]])
    f, violation = nlp_gait.compile_objective(changed)(X)
    verdicts = [evaluate(changed, x) for x in X]
    assert (-f).tolist() == pytest.approx([verdict.objective["value"] for verdict in verdicts])
    assert f[0] - f[1] == pytest.approx(2.0 * 0.4)  # what is maximised rises with the slack
    assert violation.tolist() == pytest.approx([verdict.violation for verdict in verdicts])
    assert violation[0] - violation[1] == pytest.approx((LEAST_SLACK - 0.1) / 0.1)
    assert verdicts[0].problem == "dearer" and "least_slack" in [row.name for row in verdicts[0].violations]
    assert verdicts[0].dense is not None


@pytest.mark.parametrize(
    ("more", "twice"),
    [
        ({"parameters": [replace(PRICE, name="limit")]}, "limit"),
        ({"parameters": [replace(PRICE, name="x.lower")]}, "x.lower"),
        ({"variables": [replace(SLACK, name="x")]}, "x, x.lower, x.upper"),
    ],
    ids=["a parameter", "a bound", "a variable"],
)
def test_duplicated_names_are_refused(more: dict[str, Any], twice: str) -> None:
    with pytest.raises(InputError, match=f"problem 'toy': two variables or parameters are named {twice}; rename"):
        toy(corner).derive(**more)


def test_a_name_that_a_point_does_not_have_is_refused_with_those_that_it_has(walk: GaitProblem) -> None:
    with pytest.raises(UnknownNameError, match="unknown variable or parameter 'lamda'; did you mean 'lambda'"):
        walk.at(WALK_X)["lamda"]
