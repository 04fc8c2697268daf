"""The exact function of a problem: cost, violation and rows by hand."""

import numpy as np
import pytest
from casadi import MX, sqrt

from nlp_gait import compile_objective, solve
from nlp_gait.backends.exact import ExactValues, build_exact_model
from nlp_gait.errors import InputError
from nlp_gait.formulation import Constraint, GaitProblem
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
    assert out.indexes == pytest.approx({"cost": 3.0})


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
