"""The ideal step: known optima, an independent replay, stairs that the paper did not try."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from casadi import SX

import nlp_gait
from nlp_gait.errors import InputError
from nlp_gait.problems.gait_problem import Array, GaitProblem
from nlp_gait.problems.stairs import GRAVITY
from nlp_gait.problems.stairs_robot import load_biped
from nlp_gait.symbolic.planar_biped import biped_dynamics
from nlp_gait.symbolic.stair_loads import link_angles

# Optima of an independent prototype of the same formulation, cases of Table IV.
KNOWN = {1: 43.95, 2: 42.82, 3: 46.02}
KNOWN_TOLERANCE = 0.005
# Open loop the climber falls: after 2 s even rounding errors have grown to radians. Both gains are those of a joint with
# a natural frequency of 20 rad/s, critically damped.
REPLAY_GAINS = (400.0, 40.0)
# RK4 at 1 ms follows the continuous torques of the planned motion up to its own truncation error.
REPLAY_TOLERANCE = 1e-6


@pytest.fixture(scope="module")
def problem() -> GaitProblem:
    return nlp_gait.load("stairs-ideal")


@pytest.fixture(scope="module")
def solution(problem: GaitProblem) -> nlp_gait.Solution:
    return nlp_gait.solve(problem, starts=1, seed=1)


def test_case_2_meets_the_known_optimum(solution: nlp_gait.Solution) -> None:
    assert solution.success, solution.status
    assert solution.objective == pytest.approx(KNOWN[2], rel=KNOWN_TOLERANCE)
    assert solution.iterations < 100


def test_replay_by_rk4_reaches_the_planned_end_pose(problem: GaitProblem, solution: nlp_gait.Solution) -> None:
    signals = problem.signals(np.array(list(solution.x.values())), problem.p)
    error = replay(signals.arrays)
    assert np.abs(error).max() < REPLAY_TOLERANCE


def test_a_search_is_refused(problem: GaitProblem) -> None:
    with pytest.raises(InputError, match="use solve"):
        nlp_gait.compile_objective(problem)


@pytest.mark.parametrize("intervals", [5, 70.0, True])
def test_intervals_that_are_not_allowed(intervals: float) -> None:
    with pytest.raises(InputError, match="whole number"):
        nlp_gait.load("stairs-ideal", intervals=intervals)


def replay(arrays: dict[str, Array]) -> Array:
    """(7,) error of the end pose [rad] when the planned torques drive the model by RK4 at 1 ms."""
    rods = load_biped().rods
    q, v, time = SX.sym("q", 7), SX.sym("v", 7), SX.sym("time")
    reference = SX.sym("reference", 21)
    q0, v0, a0 = ca.vertsplit(reference, 7)
    motion = biped_dynamics(rods, GRAVITY, q, v, link_angles(q))
    dynamics = ca.Function("dynamics", [q, v], ca.cse([motion.M, motion.C @ v + motion.G]))
    planned_q, planned_v = q0 + v0 * time + a0 * time**2 / 2, v0 + a0 * time
    M_planned, h_planned = dynamics(planned_q, planned_v)
    M, h = dynamics(q, v)
    kp, kd = REPLAY_GAINS
    torque = M_planned @ a0 + h_planned + M @ (kp * (planned_q - q) + kd * (planned_v - v))
    rate = ca.Function("rate", [ca.vertcat(q, v), reference, time], [ca.vertcat(v, ca.solve(M, torque - h))])

    state, h = ca.MX.sym("state", 14), 1e-3
    ref, t = ca.MX.sym("ref", 21), ca.MX.sym("t")
    k1 = rate(state, ref, t)
    k2 = rate(state + h / 2 * k1, ref, t + h / 2)
    k3 = rate(state + h / 2 * k2, ref, t + h / 2)
    k4 = rate(state + h * k3, ref, t + h)
    step = ca.Function("step", [state, ref, t], [state + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)])
    intervals = len(arrays["t"]) - 1
    substeps = round(arrays["t"][1] / 1e-3)
    references = np.vstack([arrays[name][:-1].T for name in ("link_q", "link_qd", "link_qdd")])
    times = np.tile(np.arange(substeps) * 1e-3, intervals)
    start = np.concatenate([arrays["link_q"][0], arrays["link_qd"][0]])
    ends = step.mapaccum(intervals * substeps)(start, np.repeat(references, substeps, axis=1), times[None, :])
    return np.array(ends)[:7, -1] - arrays["link_q"][-1]
