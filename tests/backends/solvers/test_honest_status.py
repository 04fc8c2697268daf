"""What IPOPT does silently is said: acceptable level, no convergence, NaN, a linear solver, and options from elsewhere."""

import math
from pathlib import Path

import casadi as ca
import numpy as np
import pytest
from casadi import MX

from nlp_gait.backends.solve import make_solution, solve
from nlp_gait.backends.solvers.ipopt import CONVERGED, STATUS_WORDS, IpoptSettings, find_linear_solver
from nlp_gait.backends.solvers.solver import judge_point
from nlp_gait.formulation import Constraint
from nlp_gait.formulation.solution import Evaluations, Outcome
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from tests.backends.toys import Mathematics, corner, row, toy

Result = tuple[MX, tuple[Constraint, ...]]


def rough(x: MX, y: MX, limit: MX, ops: Nonsmooth) -> Result:
    """Steep, flat, and with ripples below what the tolerance could resolve."""
    return 1e6 * (x - 0.3) ** 2 + (y - 0.2) ** 4 + 1e-9 * ca.sin(1e7 * x), ()


def test_an_acceptable_level_counts_as_converged_and_says_so() -> None:
    solution = solve(toy(rough), solver=IpoptSettings(tolerance=1e-14))
    assert solution.converged
    assert solution.status == solution.starts[0].status == "converged to IPOPT's acceptable level only"


def test_a_point_that_is_feasible_but_not_converged_is_called_that() -> None:
    solution = solve(toy(corner), solver=IpoptSettings(tolerance=1e-30))
    assert not solution.converged
    assert solution.best.violation == 0.0
    assert solution.status == "no start converged; ending of the best feasible one: search direction became too small"


def test_contradicting_limits_are_called_local_infeasibility() -> None:
    solution = solve(toy(lambda x, y, limit, ops: (x + y, (row(x**2 + y**2, upper=-2 * limit),))))
    assert not solution.converged
    assert (
        "ending of the least infeasible one: converged to a point of local infeasibility; violated: row (by 1 m)"
        in solution.status
    )


@pytest.mark.parametrize(
    ("mathematics", "objective"),
    [
        (lambda x, y, limit, ops: (ca.sqrt(-1 - x**2), ()), math.nan),
        (lambda x, y, limit, ops: (1 / (x * 1e-200) ** 2, ()), math.inf),
    ],
    ids=["nan", "inf"],
)
def test_an_objective_without_a_value_is_not_converged_and_not_noisy(
    mathematics: Mathematics, objective: float, capfd: pytest.CaptureFixture[str]
) -> None:
    solution = solve(toy(mathematics), starts=2)
    assert not solution.converged
    assert "a function returned NaN or inf" in solution.status
    assert solution.status.endswith(f"; cost is {objective} there")
    assert "".join(capfd.readouterr()) == ""  # CasADi would warn at every call


def test_starts_from_where_a_row_has_no_value_do_not_hide_the_others() -> None:
    solution = solve(toy(lambda x, y, limit, ops: (x + y, (row(ca.sqrt(x), lower=limit),))), starts=4)
    assert solution.converged
    assert solution.objective == pytest.approx(-0.75, abs=1e-6)  # sqrt(x) >= 0.5, y >= -1
    assert {start.converged for start in solution.starts} == {True, False}


def end(claimed: bool, cost: float, violation: float) -> Outcome:
    """An outcome with what its rank depends on."""
    none, rest = (
        np.zeros(0),
        {"iterations": 0, "evaluations": Evaluations(), "time_s": 0.0, "solver": "any", "status": ""},
    )
    return Outcome(x0=none, x=none, claimed=claimed, objective=cost, cost=cost, violation=violation, **rest)  # type: ignore[arg-type]


def test_outcomes_rank_by_convergence_then_feasibility_then_violation() -> None:
    ranked = [end(True, 2.0, 0.0), end(True, 3.0, 1e-7), end(False, 0.0, 0.0), end(False, 1.0, 1e-7)]
    ranked += [end(True, 9.0, 0.1), end(False, 0.0, 0.2), end(False, 0.0, math.nan)]
    ranks = [item.rank for item in ranked]
    assert ranks == sorted(ranks)
    assert len(set(ranks)) == len(ranks)
    assert [item.converged for item in ranked] == [True, True, *[False] * 5]
    assert not end(True, math.nan, 0.0).converged
    assert set(CONVERGED) < set(STATUS_WORDS)


def test_options_that_lie_in_the_working_folder_change_nothing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    """IPOPT reads ``ipopt.opt`` by itself; this one would stop at once, and leave a file."""
    expected = solve(toy(corner))
    (tmp_path / "ipopt.opt").write_text("acceptable_tol 1e10\nacceptable_iter 1\noutput_file left.txt\n")
    monkeypatch.chdir(tmp_path)
    find_linear_solver.cache_clear()
    solution = solve(toy(corner))
    assert (solution.x, solution.best.iterations) == (expected.x, expected.best.iterations)
    assert solution.best.linear_solver == expected.best.linear_solver
    assert [path.name for path in tmp_path.iterdir()] == ["ipopt.opt"]
    assert "".join(capfd.readouterr()) == ""


def test_the_solution_is_the_cheapest_start_that_converged() -> None:
    """By hand: converged at 3 and 2, feasible but not converged at 1, cheaper than all but infeasible at 0.5."""
    problem = toy(lambda x, y, limit, ops: (x + y, (row(x + y, lower=limit),)), limit=0.8)
    points = {(1.0, 2.0): True, (1.0, 1.0): True, (0.5, 0.5): False, (0.25, 0.25): True}
    starts = [
        judge_point(
            "hand", problem, np.zeros(2), np.array(x), claimed=claimed, status=f"at {x}", iterations=0,
            evaluations=Evaluations(), time_s=0.0,
        )
        for x, claimed in points.items()
    ]  # fmt: skip
    solution = make_solution(problem, starts)
    assert (solution.objective, solution.converged, solution.status) == (2.0, True, "at (1.0, 1.0)")
    assert make_solution(problem, starts[2:]).objective == 1.0  # feasible before infeasible
    assert "no start converged to a feasible point" in make_solution(problem, starts[3:]).status
