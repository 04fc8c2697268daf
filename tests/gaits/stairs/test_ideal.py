"""The ideal step: known optima, an independent replay, stairs that the paper did not try."""

from __future__ import annotations

import numpy as np
import pytest

import nlp_gait
from nlp_gait.errors import InputError
from nlp_gait.formulation import GaitProblem
from tests.gaits.stairs.replay import FEEDBACK, OPEN_LOOP, replay

# Optima of an independent prototype of the same formulation, cases of Table IV.
KNOWN = {1: 43.95, 2: 42.82, 3: 46.02}
KNOWN_TOLERANCE = 0.005
# RK4 at 1 ms follows the continuous torques of the planned motion up to its own truncation error.
REPLAY_TOLERANCE = 1e-6
FIRST_PHASE_S = 0.5


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
    assert solution.iterations < 100


@pytest.mark.slow
def test_replay_by_rk4_reaches_the_planned_end_pose(problem: GaitProblem, solution: nlp_gait.Solution) -> None:
    _, error = replay(problem.signals(solution.x).arrays, FEEDBACK)
    assert np.abs(error[-1]).max() < REPLAY_TOLERANCE


@pytest.mark.slow
def test_replay_without_feedback_leaves_the_plan_as_an_inverted_pendulum_does(
    problem: GaitProblem, solution: nlp_gait.Solution
) -> None:
    """It follows the first phase; what rounding and truncation put in then grows exponentially until the robot falls."""
    time, error = replay(problem.signals(solution.x).arrays, OPEN_LOOP)
    largest = np.abs(error).max(axis=1)
    assert largest[time <= FIRST_PHASE_S].max() < REPLAY_TOLERANCE
    assert largest[-1] > 1.0


def test_a_search_is_refused(problem: GaitProblem) -> None:
    with pytest.raises(InputError, match="use solve"):
        nlp_gait.compile_objective(problem)


@pytest.mark.parametrize("intervals", [5, 70.0, True])
def test_intervals_that_are_not_allowed(intervals: float) -> None:
    with pytest.raises(InputError, match="intervals must be a"):
        nlp_gait.load("stairs-ideal", intervals=intervals)
