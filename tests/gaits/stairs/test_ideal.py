"""The ideal step: known optima; its rows are those of ``tests.referee``."""

import pytest

import nlp_gait
from nlp_gait.errors import InputError
from nlp_gait.formulation import GaitProblem

# Optima of an independent prototype of the same formulation, cases of Table IV.
KNOWN = {1: 43.95, 2: 42.82, 3: 46.02}
KNOWN_TOLERANCE = 0.005


@pytest.fixture(scope="module")
def problem() -> GaitProblem:
    return nlp_gait.load("stairs-ideal")


@pytest.fixture(scope="module")
def solution(problem: GaitProblem) -> nlp_gait.Solution:
    return nlp_gait.solve(problem, starts=1, seed=1, solver=nlp_gait.IpoptSettings(compiled=False))


@pytest.mark.slow
def test_case_2_meets_the_known_optimum(solution: nlp_gait.Solution) -> None:
    assert solution.converged, solution.status
    assert solution.objective == pytest.approx(KNOWN[2], rel=KNOWN_TOLERANCE)
    assert solution.best.iterations < 100


def test_a_search_is_refused(problem: GaitProblem) -> None:
    with pytest.raises(InputError, match="use solve"):
        nlp_gait.compile_objective(problem)
