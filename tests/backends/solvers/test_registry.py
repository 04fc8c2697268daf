"""Every NLP solver of the registry, and one that is not in it, wherever a solver is taken."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import numpy as np
import pytest

from compare.questions.certainty import run_stored_starts
from compare.questions.question import Work
from compare.study.memo import Memo
from nlp_gait.backends.optima.optimum import find_optimum
from nlp_gait.backends.solve import Continuation, find_cheapest_feasible, solve, solve_both_ways
from nlp_gait.backends.solvers.registry import SOLVERS, make_solver
from nlp_gait.backends.solvers.solver import Solver, judge_point
from nlp_gait.errors import InputError, UnknownNameError
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.solution import Evaluations, Outcome
from nlp_gait.interrupts import never
from tests.backends.toys import corner, row, toy

# Of the objective of the toy: SLSQP differentiates by differences.
TOLERANCE = 1e-5


@dataclass(frozen=True, kw_only=True)
class Corners(Solver):
    """Tries the start point and the corner at the limit: all that a new solver must have."""

    name: ClassVar[str] = "corners"

    def run(self, problem: GaitProblem, x0: Array, stop: Callable[[], bool] = never) -> Outcome:
        x, work = np.maximum(problem.value("limit"), np.ones(2)), Evaluations(f=1)
        return judge_point(
            self.name, problem, x0, x, claimed=True, status="tried", iterations=1, evaluations=work, time_s=0.0
        )


@pytest.mark.parametrize("name", SOLVERS)
def test_each_solver_of_the_registry_solves_and_accounts_for_it(name: str) -> None:
    solution = solve(toy(corner, limit=1.5), starts=3, solver=make_solver(name))
    assert solution.objective == pytest.approx(1.5, abs=TOLERANCE)
    assert (solution.best.solver, len(solution.starts)) == (name, 3)
    assert solution.evaluations.f >= 3
    assert bool(solution.active_constraints) == (solution.starts[0].guess is not None)
    assert solution.to_json()["starts"][2]["x0"] == dict(zip("xy", solution.starts[2].x0.tolist(), strict=True))


@pytest.mark.parametrize("chosen", [*SOLVERS, "corners"])
def test_a_path_of_problems_is_followed_by_any_solver(chosen: str) -> None:
    follower = Corners() if chosen == "corners" else make_solver(chosen)
    problem = toy(corner)
    problems = [problem.with_values(limit=limit) for limit in (1.2, 1.4, 1.6)]
    found = solve_both_ways(problems, starts=2, solver=follower)
    assert [solution.objective for solution in found] == pytest.approx([0.6, 1.2, 1.8], abs=TOLERANCE)


def test_a_solver_with_a_name_and_a_run_is_enough(tmp_path: Path) -> None:
    problem = toy(corner, limit=1.5)
    solution = solve(problem, starts=2, solver=Corners())
    assert solution.converged and solution.status == "tried" and solution.objective == pytest.approx(1.5)
    assert (solution.best.solver, solution.best.linear_solver, solution.best.functions) == (
        "corners",
        "",
        "interpreted",
    )
    ends = run_stored_starts(problem, Work(memo=Memo(tmp_path)), starts=3, solver=Corners())
    assert all(end.feasible for end in ends) and [end.objective for end in ends] == pytest.approx([1.5] * 3)


def test_what_needs_multipliers_says_which_solver_gives_none() -> None:
    problem = toy(corner, limit=1.5)
    near = find_cheapest_feasible(Continuation(starts=1, solver=Corners()).run(problem))
    assert near is not None
    with pytest.raises(InputError, match="need multipliers, which corners does not return; solve with ipopt"):
        find_optimum(problem, near)


def test_unknown_names_and_settings_are_refused() -> None:
    with pytest.raises(UnknownNameError, match="unknown NLP solver 'ipop'; did you mean 'ipopt'"):
        make_solver("ipop")
    with pytest.raises(UnknownNameError, match="unknown setting of slsqp 'tolerance'"):
        make_solver("slsqp", tolerance=1e-6)
    with pytest.raises(InputError, match="setting of ipopt: tolerance must be a number"):
        make_solver("ipopt", tolerance="small")
    with pytest.raises(InputError, match="slsqp needs at least 3 evaluations"):
        solve(toy(corner), solver=make_solver("slsqp", evaluations=2))


def test_slsqp_ends_where_a_circle_meets_a_line() -> None:
    """The point of x + y <= 2 nearest to (1, 2)."""
    problem = toy(lambda x, y, limit, ops: ((x - 1) ** 2 + (y - 2) ** 2, (row(x + y, upper=limit),)), limit=2.0)
    found = solve(problem, x0=[-1.5, 0.0], solver=make_solver("slsqp"))
    assert found.x == pytest.approx({"x": 0.5, "y": 1.5}, abs=1e-6)
