"""Planning again: the same optima as IPOPT's, few steps, and what is reported where there is no optimum."""

from __future__ import annotations

import math
from collections.abc import Iterator

import numpy as np
import pytest
from casadi import MX

import nlp_gait
from nlp_gait.backends.onboard.replanner import Replanner, make_replanner
from nlp_gait.backends.optima.optimum import SHARP
from nlp_gait.errors import InputError, UnknownNameError
from nlp_gait.formulation import Constraint
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from tests.backends.toys import corner, row, toy

pytest.importorskip("daqp")


@pytest.fixture(scope="module")
def nao() -> Iterator[Replanner]:
    yield make_replanner("nao-ssp", starts=2)


def test_a_corner_follows_its_limit_across_a_change_of_sign() -> None:
    """|x - 1| + 2 |y - 1| with min(x, y) >= limit is 0 at (1, 1) up to limit 1, then 3 (limit - 1) at (limit, limit)."""
    plan = make_replanner(toy(corner, limit=0.5), starts=3)
    for limit, expected in ((1.5, 1.5), (1.2, 0.6), (0.7, 0.0), (1.05, 0.15)):
        found = plan.solve({"limit": limit}, judge=True)
        assert found.converged and found.feasible and found.solver == "sqp", found.note
        assert found.objective == pytest.approx(expected, abs=1e-8)
        np.testing.assert_allclose(found.x, max(1.0, limit), atol=1e-8)


def test_many_values_that_are_zero_at_once_stay_so() -> None:
    """20 terms |a d + b e + d e / 10| with d = x - limit, e = y - 1 are zero together, in two directions, against a pull by x."""
    angles = np.linspace(0.0, 3.0, 20)

    def fan(x: MX, y: MX, limit: MX, ops: Nonsmooth) -> tuple[MX, tuple[Constraint, ...]]:
        d, e = x - limit, y - 1
        terms = [ops.abs(math.cos(a) * d + math.sin(a) * e + d * e / 10) for a in angles]
        return sum(terms, 3 * x), (row(x + y, lower=MX(-9)),)

    plan = make_replanner(toy(fan, limit=0.5), starts=1)
    for limit in (0.6, 1.4, -0.3, -0.31):
        found = plan.solve({"limit": limit}, judge=True)
        assert found.converged and found.feasible and found.solver == "sqp" and found.iterations <= 5, found.note
        np.testing.assert_allclose(found.x, [limit, 1.0], atol=1e-7)
        assert found.objective == pytest.approx(3 * limit, rel=1e-6)


def test_a_predicted_start_is_the_optimum_where_the_same_bounds_stay_active() -> None:
    """Where limit > 1, the optimum is (limit, limit): one step confirms it."""
    plan = make_replanner(toy(corner, limit=1.5), starts=3, predict=True)
    for limit, most in ((1.9, 1), (1.2, 1), (0.7, 20)):
        found = plan.solve({"limit": limit})
        assert found.converged and found.solver == "sqp" and found.iterations <= most
        np.testing.assert_allclose(found.x, max(1.0, limit), atol=1e-8)


def test_a_limit_that_nothing_satisfies_is_named_with_its_amount() -> None:
    """min(x, y) >= 5 with x <= 2: the row misses its bound by at least 3."""
    found = make_replanner(toy(corner), starts=3).solve({"limit": 5.0})
    assert not found.feasible and not found.converged and "IPOPT" in found.note
    assert found.violated[0].name == "row" and found.violated[0].violation >= 3.0 - 1e-6


@pytest.mark.slow
def test_every_change_of_the_parameters_leads_to_ipopts_optimum(nao: Replanner) -> None:
    problem, rng = nao.problem, np.random.default_rng(0)
    for _ in range(2):
        changed = {q.name: q.default * (1 + 0.05 * rng.uniform(-1.0, 1.0)) for q in problem.own_parameters}
        changed = {q.name: min(max(changed[q.name], q.minimum), q.maximum) for q in problem.own_parameters}
        found, moved = nao.solve(changed, judge=True), problem.with_values(**changed)
        assert found.solver == "sqp" and found.converged and found.feasible and found.iterations <= 6
        sharp = SHARP.run(moved, found.x)
        assert found.objective == pytest.approx(sharp.objective, rel=1e-6)


@pytest.mark.slow
def test_a_disturbed_robot_plans_from_the_state_where_it_is() -> None:
    plan = make_replanner(nlp_gait.load("nao-dsp", trajectory="measured", intervals=4), starts=1)
    state = {"hip_x_start_m": 0.002, "hip_y_start_m": -0.003, "hip_z_start_m": -0.002, "hip_vx_start_m_s": 0.01}
    values = {key: plan.problem.value(key) + change for key, change in state.items()}
    found = plan.solve(values, judge=True)
    assert found.converged and found.feasible and found.solver == "sqp", found.note
    hip = plan.problem.with_values(**values).signals(found.x)["hip"]
    np.testing.assert_allclose(hip[0], [values[f"hip_{axis}_start_m"] for axis in "xyz"], atol=1e-12)
    assert set(values).isdisjoint(plan.problem.names)


@pytest.mark.slow
def test_parameters_in_order_and_a_start_give_the_same_result(nao: Replanner) -> None:
    by_name = nao.solve({"dbm_y_mean_limit_m": nao.problem.value("dbm_y_mean_limit_m")})
    in_order = nao.solve(nao.problem.p.tolist(), x0=dict(zip(nao.problem.names, by_name.x, strict=True)))
    assert in_order.objective == pytest.approx(by_name.objective, rel=1e-9)
    assert in_order.iterations <= by_name.iterations


@pytest.mark.slow
def test_a_limit_of_time_or_steps_returns_the_best_feasible_point(nao: Replanner) -> None:
    optimum = nao.solve()
    far = nao.solve(x0=(nao.problem.lower + nao.problem.upper) / 2, time_limit_s=1e-9)
    assert far.iterations == 0 and not far.converged and "limit" in far.note
    assert not far.feasible and far.violated[0].violation > 0.0
    again = nao.solve(time_limit_s=1e-9)
    assert again.feasible and again.objective == pytest.approx(optimum.objective, rel=1e-6)


@pytest.mark.slow
def test_what_is_not_allowed_is_named(nao: Replanner) -> None:
    with pytest.raises(UnknownNameError, match="no_such"):
        nao.solve({"no_such": 1.0})
    with pytest.raises(InputError, match="45 in order, got 2"):
        nao.solve([1.0, 2.0])
    other = nlp_gait.solve(nao.problem, solver=nlp_gait.make_solver("slsqp"))
    with pytest.raises(InputError, match="optimum by IPOPT"):
        make_replanner(nao.problem, near=other)
