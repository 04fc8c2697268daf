"""Paths of neighbouring problems."""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import ClassVar

import numpy as np
import pytest
from casadi import MX

from nlp_gait.backends.solve import Continuation, make_solution, solve_both_ways
from nlp_gait.backends.solvers.solver import Solver, judge_point
from nlp_gait.formulation import Array, Constraint, GaitProblem
from nlp_gait.formulation.solution import Evaluations, Outcome
from nlp_gait.interrupts import never
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from tests.backends.toys import corner, row, toy

TOLERANCE = 1e-6  # IPOPT's own is 1e-8


def two_wells(x: MX, y: MX, limit: MX, ops: Nonsmooth) -> tuple[MX, tuple[Constraint, ...]]:
    """Wells near x = -1 and x = 1; the right one is the lower one where the limit is negative."""
    return (x**2 - 1) ** 2 + limit * x + y**2, (row(y, lower=MX(0)),)


def path(problem: GaitProblem, limits: list[float]) -> list[GaitProblem]:
    return [problem.with_values(limit=limit) for limit in limits]


def true_depth(limit: float) -> float:
    x = np.linspace(-2.0, 2.0, 400_001)
    return float(((x**2 - 1) ** 2 + limit * x).min())


def test_one_direction_stays_in_a_well_and_both_find_the_lower_one() -> None:
    limits = np.linspace(-1.0, 1.0, 11).tolist()
    problem = toy(two_wells)
    truth = [true_depth(limit) for limit in limits]
    one_way = Continuation(starts=8)
    followed = [make_solution(p, one_way.run(p)).objective for p in path(problem, limits)]
    assert followed[0] == pytest.approx(truth[0], abs=TOLERANCE)
    assert followed[7] > truth[7] + 0.1  # still in the well on the right
    found = solve_both_ways(path(problem, limits), starts=8)
    assert [solution.objective for solution in found] == pytest.approx(truth, abs=TOLERANCE)


def test_infeasible_problems_are_named_and_the_path_continues() -> None:
    limits = [0.5, 1.2, 5.0, 1.5, 2.0]  # x and y end at 2 and 3
    calls: list[None] = []
    found = solve_both_ways(path(toy(corner), limits), starts=2, progress=lambda: calls.append(None))
    assert len(calls) == 2 * len(limits)
    assert [solution.converged for solution in found] == [True, True, False, True, True]
    assert "violated: row" in found[2].status
    costs = [found[k].objective for k in (0, 1, 3, 4)]
    assert costs == pytest.approx([0.0, 0.6, 1.5, 3.0], abs=TOLERANCE)
    # Random starts are in vain once: a warm and a cold attempt each way, and the two random ones.
    assert len(found[2].starts) == 2 * 2 + 2


def test_a_warm_start_needs_fewer_iterations_than_a_cold_one() -> None:
    problems = path(toy(corner), np.linspace(1.1, 1.9, 9).tolist())
    warm = Continuation(starts=1)
    first, *others = [min(warm.run(problem), key=lambda end: end.rank).iterations for problem in problems]
    assert max(others) < first


@dataclass(frozen=True, kw_only=True)
class Recorder(Solver):
    """A solver that ends where it starts, and says where that was."""

    name: ClassVar[str] = "recorder"

    starts: list[list[float]] = field(default_factory=list)

    def run(self, problem: GaitProblem, x0: Array, stop: Callable[[], bool] = never) -> Outcome:
        self.starts.append(x0.tolist())
        return judge_point(
            self.name, problem, x0, x0, claimed=True, status="", iterations=0, evaluations=Evaluations(), time_s=0.0
        )


def test_a_cold_start_from_the_neighbour_is_within_the_bounds() -> None:
    problem, recorder = toy(lambda x, y, limit, ops: (x**2 + y**2, (row(x, upper=MX(9.0)),))), Recorder()
    path = Continuation(starts=1, seed=3, solver=recorder)
    path.run(problem.fix(x=2.0, y=3.0))
    path.run(problem.with_values(**{"x.upper": 0.5, "y.lower": 1.0}))
    assert recorder.starts == [[2.0, 3.0], [0.5, 3.0]]
