"""The condensed interior-point method: IPOPT's optima and prices, the same honest statuses, and refusals in words."""

from __future__ import annotations

import time

import casadi as ca
import numpy as np
import pytest
from casadi import MX

import nlp_gait
from nlp_gait.backends.exact import exact_model
from nlp_gait.backends.kernel import compiler
from nlp_gait.backends.solve import solve
from nlp_gait.backends.solvers import condensed
from nlp_gait.backends.solvers.condensed import CondensedSettings
from nlp_gait.backends.solvers.ipopt import IpoptSettings
from nlp_gait.errors import CompilerError, InputError
from nlp_gait.problem import Constraint
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from tests.backends.toys import Mathematics, corner, row, toy

Result = tuple[MX, tuple[Constraint, ...]]
# Both methods stop at scaled conditions of 1e-8; where a bound is nearly without a price, its price differs by more.
OBJECTIVE_TOLERANCE, PRICE_TOLERANCE = 1e-6, 1e-2


def circle(x: MX, y: MX, limit: MX, ops: Nonsmooth) -> Result:
    """Nearest point of a circle, an equation, to (2, 1), with a bent row beside it."""
    return (x - 2) ** 2 + (y - 1) ** 2, (row(x**2 + y**2, limit, limit), row(ca.exp(x) - y, upper=MX(4.0)))


def mean_of_least(x: MX, y: MX, limit: MX, ops: Nonsmooth) -> Result:
    """A row that holds several lifted variables."""
    least = ops.min(ca.vertcat(x, y, x + y), ca.vertcat(y, 1 - x, 2 * x))
    return x**2 + 2 * y**2, (row(ca.sum1(least) / 3, lower=limit),)


def product(x: MX, y: MX, limit: MX, ops: Nonsmooth) -> Result:
    """Curvature between a variable and a lifted one, and negative curvature elsewhere."""
    return (x + 3) * ops.abs(y - 0.3 * x) - 0.1 * x**2, (row(x * y, lower=limit / 2),)


def peak(x: MX, y: MX, limit: MX, ops: Nonsmooth) -> Result:
    """One lifted variable in many rows."""
    return ops.largest(ca.vertcat(x - limit, y + x, 2 * y - 1, x * y)), ()


@pytest.mark.parametrize("mathematics", [corner, circle, mean_of_least, product, peak])
@pytest.mark.parametrize("sense", ["minimise", "maximise"])
def test_small_problems_end_where_ipopt_ends(mathematics: Mathematics, sense: str) -> None:
    def signed(x: MX, y: MX, limit: MX, ops: Nonsmooth) -> Result:
        cost, rows = mathematics(x, y, limit, ops)
        return (cost if sense == "minimise" else -cost), rows

    problem = toy(signed, sense)  # type: ignore[arg-type]
    expected, found = (solve(problem, starts=3, solver=solver) for solver in (IpoptSettings(), CondensedSettings()))
    assert [start.success for start in found.starts] == [start.success for start in expected.starts] == [True] * 3
    assert found.objective == pytest.approx(expected.objective, abs=OBJECTIVE_TOLERANCE)
    known = {
        f"{bound.name} {bound.side}": bound.price for bound in expected.active_constraints if abs(bound.price) > 1e-3
    }
    prices = {f"{bound.name} {bound.side}": bound.price for bound in found.active_constraints}
    assert {name: prices[name] for name in known} == pytest.approx(known, rel=PRICE_TOLERANCE, abs=1e-4)


@pytest.mark.slow
def test_single_support_ends_in_ipopts_optimum_with_its_prices() -> None:
    problem = nlp_gait.load("nao-ssp")
    expected, found = (solve(problem, starts=2, solver=solver) for solver in (IpoptSettings(), CondensedSettings()))
    assert found.success and found.objective == pytest.approx(0.845869, abs=OBJECTIVE_TOLERANCE)
    assert all(start.success for start in found.starts)
    for mine, theirs in zip(found.active_constraints[:3], expected.active_constraints[:3], strict=True):
        assert (mine.name, mine.side) == (theirs.name, theirs.side)
        assert mine.price == pytest.approx(theirs.price, rel=1e-3)
    again = solve(problem, starts=2, solver=CondensedSettings(), workers=2)
    assert [start.x.tobytes() for start in again.starts] == [start.x.tobytes() for start in found.starts]


def test_a_warm_start_needs_fewer_iterations_and_a_fixed_variable_has_its_price() -> None:
    problem = toy(circle)
    solver = CondensedSettings().ready_for(problem)
    cold = solver.run(problem, np.array([0.1, 0.2]))
    moved = problem.with_values(limit=0.51)
    warm = solver.run_from(moved, cold)
    assert warm is not None and warm.success and warm.iterations < cold.iterations
    assert warm.cost == pytest.approx(solver.run(moved, np.array([0.1, 0.2])).cost, abs=OBJECTIVE_TOLERANCE)
    held = [solve(problem, fix={"x": 0.6}, solver=each) for each in (IpoptSettings(), CondensedSettings())]
    prices = [{bound.name: bound.price for bound in solution.active_constraints} for solution in held]
    assert prices[1]["bounds[x]"] == pytest.approx(prices[0]["bounds[x]"], rel=PRICE_TOLERANCE)


def test_what_cannot_be_solved_is_said() -> None:
    contradiction = toy(lambda x, y, limit, ops: (x + y, (row(x**2 + y**2, upper=-2 * limit),)))
    refused = solve(contradiction, solver=CondensedSettings())
    assert not refused.success and "local infeasibility; in the way: row (by 1 m)" in refused.status
    short = solve(toy(circle), solver=CondensedSettings(iterations=2))
    assert not short.success and "stopped at the iteration limit" in short.status
    undefined = toy(lambda x, y, limit, ops: (ca.sqrt(x - 5.0) + y, ()))
    assert "a function returned NaN or inf" in solve(undefined, solver=CondensedSettings()).status
    asked = iter([False, False, True, True, True])
    ended = CondensedSettings().run(toy(circle), np.array([0.1, 0.2]), stop=lambda: next(asked))
    assert (ended.status, ended.iterations, ended.claimed) == ("was interrupted", 2, False)


def test_what_the_watch_raises_is_raised() -> None:
    def press() -> bool:
        raise KeyError("from within")

    with pytest.raises(KeyError, match="from within"):
        CondensedSettings().run(toy(circle), np.array([0.1, 0.2]), stop=press)


def test_it_is_refused_where_it_would_not_run(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(condensed, "LARGEST", 2)
    with pytest.raises(InputError, match="a dense matrix of 3 x 3 for toy, 2 at most"):
        solve(toy(circle), solver=CondensedSettings())

    def none() -> compiler.Compiler:
        raise CompilerError("no C++ compiler")

    condensed._library.cache_clear()
    monkeypatch.setattr(condensed, "find_compiler", none)
    with pytest.raises(InputError, match="needs a C\\+\\+ compiler: no C\\+\\+ compiler; use ipopt"):
        solve(toy(circle), solver=CondensedSettings(compiled=False))
    with pytest.raises(InputError, match="tolerance must be within"):
        CondensedSettings(tolerance=2.0)


def test_every_end_is_judged_by_the_exact_functions() -> None:
    problem = toy(product)
    outcome = CondensedSettings().run(problem, np.array([1.0, 1.0]))
    exact = exact_model(problem).at(outcome.x, problem.p)
    assert (outcome.cost, outcome.violation) == (exact.cost, exact.violation)
    assert outcome.evaluations.f >= outcome.iterations and outcome.evaluations.hessian >= outcome.iterations


def test_each_iteration_takes_one_hessian_and_each_stage_one_gradient_more() -> None:
    before = time.perf_counter()
    found = CondensedSettings(iterations=2).run(toy(product), np.array([0.5, 0.5]))
    assert 0.0 < found.compile_s < time.perf_counter() - before
    assert (found.status, found.iterations) == ("stopped at the iteration limit", 4)  # of two stages
    assert (found.evaluations.hessian, found.evaluations.gradient) == (4, 6)
