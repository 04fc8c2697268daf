"""Solutions by IPOPT: feasible by the exact functions, with true prices, and honest when there is none."""

import json
from dataclasses import asdict, replace

import numpy as np
import pytest
from casadi import MX

from nlp_gait.backends.solve import solve
from nlp_gait.backends.solvers.ipopt import IpoptSettings
from nlp_gait.errors import InputError
from nlp_gait.formulation import Constraint, GaitProblem, load
from nlp_gait.formulation.solution import Outcome, Solution
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from tests.backends.toys import corner, row, toy

# Step of a limit for the difference quotient; the optimum's curvature and IPOPT's tolerance of 1e-8 leave 1e-3 of a price.
PRICE_STEP, PRICE_TOLERANCE = 1e-5, 5e-3
TOY_TOLERANCE = 1e-6  # IPOPT's tolerance of 1e-8 times slopes of order ten


@pytest.fixture(scope="module")
def double_support() -> tuple[GaitProblem, Solution]:
    problem = load("nao-dsp", intervals=5)
    return problem, solve(problem, starts=2, seed=0)


def point(solution: Solution) -> np.ndarray:
    return np.array(list(solution.x.values()))


def test_prices_are_what_a_changed_limit_costs(double_support: tuple[GaitProblem, Solution]) -> None:
    """Each bound moved by a little, and the problem solved again from the optimum."""
    problem, solution = double_support
    prices = {f"{bound.name} {bound.side}": bound for bound in solution.active_constraints}
    for key, parameter in (
        ("dbm_y_mean lower", "dbm_y_mean_limit_m"),
        ("bounds[hip_height_m] upper", "hip_height_m.upper"),
    ):
        bound = prices[key]
        assert bound.bound == problem.value(parameter)
        assert bound.price_unit == "W per m"
        moved = problem.with_values(**{parameter: bound.bound + PRICE_STEP})
        again = solve(moved, x0=point(solution))
        assert again.converged
        assert (again.objective - solution.objective) / PRICE_STEP == pytest.approx(bound.price, rel=PRICE_TOLERANCE)


def test_a_solution_accounts_for_its_work(double_support: tuple[GaitProblem, Solution]) -> None:
    problem, solution = double_support
    counts = asdict(solution.evaluations)
    assert counts.keys() == {"f", "g", "gradient", "jacobian", "hessian"}
    assert all(count >= solution.best.iterations > 0 for count in counts.values())
    assert solution.time_s.build > 0
    assert solution.time_s.compile > 0
    assert solution.time_s.solve == pytest.approx(sum(start.time_s for start in solution.starts))
    assert solution.best.linear_solver.lower().startswith(("mumps", "ma", "spral", "pardiso"))
    written = json.loads(json.dumps(solution.to_json()))
    assert written["x"] == solution.x
    assert [start["index"] for start in written["starts"]] == [0, 1]
    assert [start["x0"] for start in written["starts"]] == [problem.by_name(start.x0) for start in solution.starts]


@pytest.mark.parametrize(("limit", "objective", "price"), [(0.5, 0.0, None), (1.5, 1.5, 3.0)])
def test_a_corner_by_hand(limit: float, objective: float, price: float | None) -> None:
    solution = solve(toy(corner).with_values(limit=limit), starts=2)
    assert solution.converged
    assert solution.objective == pytest.approx(objective, abs=TOY_TOLERANCE)
    assert list(solution.x.values()) == pytest.approx([max(limit, 1.0)] * 2, abs=TOY_TOLERANCE)
    prices = {bound.name: (bound.side, bound.bound, bound.price_unit) for bound in solution.active_constraints}
    assert prices == ({"row": ("lower", limit, "J per m")} if price else {})
    assert [bound.price for bound in solution.active_constraints] == pytest.approx([price] if price else [], abs=1e-5)


def on_a_line(x: MX, y: MX, limit: MX, ops: Nonsmooth) -> tuple[MX, tuple[Constraint, ...]]:
    """Distance from (1, 1) squared where x + y equals the limit, and x may not pass 0.2 below it."""
    return (x - 1) ** 2 + (y - 1) ** 2, (
        row(x + y, lower=limit, upper=limit),
        replace(row(x, upper=limit - 0.3), name="most"),
    )


@pytest.mark.parametrize(("fix", "expected"), [({}, "most"), ({"x": 0.1}, "bounds[x]")])
def test_equations_are_left_out(fix: dict[str, float], expected: str) -> None:
    solution = solve(toy(on_a_line).fix(**fix), x0=[0.1, 0.1])
    assert solution.converged, solution.status
    assert [(bound.name, bound.side) for bound in solution.active_constraints] == [(expected, "upper")]


def test_a_corner_out_of_reach_is_missed_by_what_it_is_out_of_reach() -> None:
    solution = solve(toy(corner).with_values(limit=2.5), starts=2)
    assert not solution.converged
    (violation,) = solution.worst_violations
    assert (violation.name, violation.lower, violation.unit) == ("row", 2.5, "m")
    assert violation.violation == pytest.approx(0.5, abs=1e-4)  # x ends at 2, its upper bound
    assert "row (by 0.5 m)" in solution.status
    assert solution.status.endswith("relax these limits or widen the bounds")
    assert solution.active_constraints == ()
    assert solution.best.violation == min(start.violation for start in solution.starts)


def test_what_is_maximised_has_prices_in_its_own_sense() -> None:
    def mathematics(x: MX, y: MX, limit: MX, ops: Nonsmooth) -> tuple[MX, tuple[Constraint, ...]]:
        return 3 * ops.min(x, 10 + 0 * y) - ops.abs(y), ()

    solution = solve(toy(mathematics, "maximise"), starts=2)
    assert solution.objective == pytest.approx(6.0, abs=TOY_TOLERANCE)
    (bound,) = solution.active_constraints
    assert (bound.name, bound.side, bound.bound) == ("bounds[x]", "upper", 2.0)
    assert bound.price == pytest.approx(3.0, abs=1e-5)  # a higher bound on x raises the objective


def test_start_points_come_from_the_bounds_and_x0_goes_first() -> None:
    seen: list[Outcome] = []
    solution = solve(
        toy(corner).with_values(**{"x.upper": -1.0}), starts=5, seed=3, x0=[-1.5, 3.0], progress=seen.append
    )
    assert solution.starts == tuple(seen)
    assert seen[0].x0.tolist() == [-1.5, 3.0]
    assert all(-2.0 <= start.x0[0] <= -1.0 for start in seen)
    assert len({start.x0[1] for start in seen}) == 5


def test_an_iteration_limit_is_reported_as_such() -> None:
    for few_rows in (None, True):
        solution = solve(load("nao-dsp"), solver=IpoptSettings(iterations=2, few_rows=few_rows))
        assert not solution.converged
        assert "stopped at the iteration limit" in solution.status
        assert solution.starts[0].iterations == 2


def test_a_start_from_which_feasibility_is_not_restored_soon_is_moved_towards_the_middle() -> None:
    """IPOPT alone takes over 100 iterations from it, or does not converge."""
    problem = load("nao-ssp")
    rng = np.random.default_rng(0)
    x0 = [problem.start_point(rng) for _ in range(11)][-1]
    found = IpoptSettings(compiled=False).prepare(problem).run(problem, x0)
    assert found.converged and found.status == "converged from half way to the middle of the bounds"
    assert found.objective == pytest.approx(0.8458687208, rel=1e-9) and found.iterations < 100
    assert found.x0.tolist() == x0.tolist()


@pytest.mark.parametrize("name", ["nao-ssp", "humanoid-ssp"])
def test_no_start_takes_many_more_iterations_than_the_others(name: str) -> None:
    solution = solve(load(name), starts=20, seed=0)
    iterations = [start.iterations for start in solution.starts]
    assert all(start.converged for start in solution.starts)
    assert max(iterations) <= 4 * np.median(iterations)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"tolerance": 0.0}, r"tolerance must be within \(0, 1\), got 0\.0"),
        ({"iterations": 0}, "iterations and time_limit_s must be positive, got 0"),
        ({"barrier": "fast"}, "barrier must be one of 'adaptive', 'monotone', got 'fast'"),
    ],
)
def test_settings_that_ipopt_would_refuse_late_are_refused_early(settings: dict[str, float], message: str) -> None:
    with pytest.raises(InputError, match=message):
        IpoptSettings(**settings)  # type: ignore[arg-type]


def test_a_start_outside_the_bounds_is_refused_and_one_on_them_but_for_rounding_is_taken() -> None:
    problem = toy(corner)
    for outside in ([1e6, 0.0], [2.001, 0.0], {"x": -3.0, "y": 0.0}):
        with pytest.raises(InputError, match=r"x0 of toy: x is .*, outside its bounds \[-2, 2\] m"):
            solve(problem, x0=outside)
    assert solve(problem, x0=[2.0 + 1e-9, 0.0]).starts[0].x0.tolist() == [2.0, 0.0]
    # A variable that is fixed is where it is fixed.
    assert solve(problem.fix(x=1.0), x0=[9.0, 0.0]).starts[0].x0.tolist() == [1.0, 0.0]


def test_widths_of_ones_own_narrow_from_stage_to_stage() -> None:
    problem = load("nao-ssp", intervals=3)
    usual, narrower = (
        solve(problem, starts=1, solver=IpoptSettings(widths=widths)) for widths in ((), (1e-2, 1e-3, 1e-4))
    )
    assert narrower.converged and narrower.best.iterations > usual.best.iterations  # one stage more
    assert narrower.objective == pytest.approx(usual.objective, rel=1e-6)
    for widths in ((1e-3, 1e-2), (1e-2, 0.0)):
        with pytest.raises(InputError, match=r"widths must be positive and narrow from stage to stage, got \(0\.0"):
            IpoptSettings(widths=widths)


@pytest.mark.parametrize(("margin_m", "compiled"), [(0.05, False), (0.065, True)])
def test_the_usual_widths_end_at_the_gait_of_narrower_ones(margin_m: float, compiled: bool) -> None:
    problem = load("nao-ssp").with_values(dbm_x_mean_limit_m=margin_m)  # 0.065: samples stay at the edge of the jump
    usual, wide, narrow = (
        solve(problem, starts=2, solver=IpoptSettings(widths=widths, compiled=compiled))
        for widths in ((), (1e-2,), (1e-2, 5e-4, 2e-4, 1e-4, 5e-5))
    )
    assert {outcome.converged for outcome in usual.starts} == {True}
    for outcome in usual.starts:
        assert outcome.cost <= min(wide.objective, narrow.objective) * (1 + 5e-4)
    guess = usual.best.guess
    # No stage more than the gait needs.
    assert guess is not None and guess.width == (5e-4 if margin_m == 0.05 else 2e-5)
    assert usual.objective == pytest.approx(0.845869 if margin_m == 0.05 else 0.849248, rel=1e-6)
