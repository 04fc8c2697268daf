"""The exact function of a problem by hand, and what a problem is made of, wherever its files lie."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from casadi import MX, sqrt

from nlp_gait import compile_objective, solve
from nlp_gait.backends.exact import (
    ExactValues,
    build_exact_model,
    describe_difference,
    hash_formulas,
    hash_json,
    identify_problem,
    make_key,
)
from nlp_gait.errors import InputError
from nlp_gait.formulation import Constraint, GaitProblem, load
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from tests.backends.toys import corner, row, row_violations, toy


def evaluate(problem: GaitProblem, x: tuple[float, ...]) -> ExactValues:
    return build_exact_model(problem).at(x, problem.p)


def test_cost_rows_and_violation_by_hand() -> None:
    """At (0, 1.5) with limit 0.5: |0 - 1| + 2 |1.5 - 1| = 2; min(x, y) = 0 falls short by 0.5, which is 5 scales of 0.1."""
    out = evaluate(toy(corner), (0.0, 1.5))
    assert (out.cost, out.violation) == pytest.approx((2.0, 5.0))
    assert out.g == pytest.approx([0.0, 0.0, 1.5])
    assert out.lower == pytest.approx([0.5, -2.0, -1.0])
    assert out.upper == pytest.approx([np.inf, 2.0, 3.0])


def test_a_candidate_outside_the_bounds_violates_them_in_units_of_their_range() -> None:
    out = evaluate(toy(corner), (3.0, 1.0))
    assert out.violation == pytest.approx(1.0 / 4.0)
    assert build_exact_model(toy(corner)).row_names == ("row", "bounds[x]", "bounds[y]")
    assert build_exact_model(toy(corner)).row_units == ("m", "m", "m")


def test_what_is_maximised_costs_its_negative_and_is_indexed_as_it_is() -> None:
    def mathematics(x: MX, y: MX, limit: MX, ops: Nonsmooth) -> tuple[MX, tuple[Constraint, ...]]:
        return x + y, ()

    out = evaluate(toy(mathematics, "maximise"), (1.0, 2.0))
    assert out.cost == pytest.approx(-3.0)
    assert out.metrics == pytest.approx({"cost": 3.0})


def test_violated_rows_are_named_worst_first() -> None:
    rows = row_violations(toy(corner), np.array([-2.25, 1.0]))
    assert [(r.name, r.unit) for r in rows] == [("row", "m"), ("bounds[x]", "m")]
    assert [r.violation for r in rows] == pytest.approx([2.75, 0.25])
    assert (rows[0].value, rows[0].lower, rows[0].upper) == (-2.25, 0.5, None)
    assert row_violations(toy(corner), np.array([0.5 - 0.5 * FEASIBILITY_TOLERANCE, 1.0])) == ()


def test_an_objective_in_units_that_are_too_large_is_refused_everywhere() -> None:
    """IPOPT would converge 170 % above the optimum, and every search would have reached it."""

    def make_scaled(unit: float) -> GaitProblem:
        return toy(
            lambda x, y, limit, ops: (unit * ((x - 1) ** 2 + (y - 1) ** 2 + 1), (row(x + y, lower=3 + 0 * limit),))
        )

    for use in (solve, compile_objective):
        with pytest.raises(
            InputError, match="toy: cost changes by .*e-12 J only .*; use a unit in which it changes by"
        ):
            use(make_scaled(1e-12))
    assert solve(make_scaled(1e-3)).objective == pytest.approx(1.5e-3, rel=1e-6)
    assert solve(make_scaled(0.0)).converged  # a constant: any feasible point is an optimum


def test_a_bound_that_is_nan_is_not_satisfied() -> None:
    """The limit's square root has no value below zero; CasADi's fmax would ignore it."""
    problem = toy(lambda x, y, limit, ops: (x, (row(x + y, lower=sqrt(limit)),)), limit=0.25)
    model = build_exact_model(problem)
    assert model.at([1.0, 1.0], problem.p).feasible
    values = model.at([1.0, 1.0], problem.with_values(limit=-1.0).p)
    assert np.isnan(values.lower[0]) and np.isnan(values.violation) and not values.feasible
    assert [violated.name for violated in model.find_violated(values)] == ["row"]


OWN = "from nlp_gait.formulation import load\ndef leg(*, steps: int = 2):\n    return load('walk12'){more}\n"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"mathematics": 2}, "its version of the formulas is 2, not 1"),
        ({"name": "nao-dsp"}, "its name is nao-dsp, not walk12"),
        ({"parameters": {"lambda": 0.6}}, "parameter lambda is 0.6, not its default"),
        ({"files": {"code": "0"}}, "the user's files that it is made of have changed (code)"),
    ],
)
def test_what_differs_is_named(change: dict[str, object], message: str) -> None:
    known = identify_problem(load("walk12"))
    assert describe_difference(known, known) == "" and describe_difference(known, {**known, **change}) == message
    assert describe_difference({**known, **change}, known)


def test_options_with_their_defaults_do_not_count_so_that_a_new_one_changes_no_key() -> None:
    known = identify_problem(load("walk12"))
    older = {**known, "options": {key: known["options"][key] for key in list(known["options"])[1:]}}
    assert hash_json(make_key(older)) == hash_json(make_key(known)) and not describe_difference(older, known)
    other = identify_problem(load("walk12", intervals=10))
    assert describe_difference(known, other) == "option intervals is 10, not its default"
    assert hash_json(make_key(other)) != hash_json(make_key(known))


def test_user_code_is_its_files_by_content_and_not_by_folder(tmp_path: Path) -> None:
    found: list[dict[str, Any]] = []
    for folder, more in (("a", ""), ("b", ""), ("c", "  # edited")):
        (tmp_path / folder).mkdir()
        path = tmp_path / folder / "own.py"
        path.write_text(OWN.format(more=more))
        found.append(identify_problem(load(f"{path}:leg")))
    first, copied, edited = found
    assert not describe_difference(first, copied) and hash_json(make_key(first)) == hash_json(make_key(copied))
    assert describe_difference(first, edited) == "the user's files that it is made of have changed (code)"
    assert make_key(first)["name"] == "leg" and str(tmp_path) not in json.dumps(make_key(first))


def test_a_problem_that_no_name_loads_is_its_formulas() -> None:
    """Also the names of its rows and the defaults of its parameters."""
    first, again = toy(corner), toy(corner)
    assert identify_problem(first)["files"] == {"formulas": hash_formulas(again)}
    other = toy(lambda x, y, limit, ops: (2 * corner(x, y, limit, ops)[0], corner(x, y, limit, ops)[1]))
    assert describe_difference(identify_problem(first), identify_problem(other))
    assert describe_difference(identify_problem(first), identify_problem(toy(corner, limit=0.7)))
