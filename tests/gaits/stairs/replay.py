"""Replay of a step's torques by another integrator."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cache

import casadi as ca
import numpy as np
from casadi import MX, SX

from nlp_gait.formulation import Array
from nlp_gait.gaits.stairs.planar_biped import MOVING, link_angles, make_dynamics

STEP_S = 1e-3
N = len(MOVING)
# Both gains are those of a joint with a natural frequency of 20 rad/s, critically damped [1/s^2], [1/s].
FEEDBACK, OPEN_LOOP = (400.0, 40.0), (0.0, 0.0)


def replay(arrays: Mapping[str, Array], gains: tuple[float, float]) -> tuple[Array, Array]:
    """Times (m,) [s] and errors (m, 7) of the link angles [rad] when the planned torques drive the robot.

    The planned generalised torques are those of the joints with the planned ground forces on the rear foot, as continuous
    functions of time: M a + C v + G along the planned motion, whose acceleration is constant within an interval.

    Args:
        arrays: signals of ``stairs-ideal``.
        gains: K_p and K_d of a feedback of the error, multiplied by M; ``OPEN_LOOP`` for none.
    """
    intervals = len(arrays["t"]) - 1
    steps = round(arrays["t"][1] / STEP_S)
    planned = np.hstack([arrays[name][:-1] for name in ("link_q", "link_qd", "link_qdd")])
    inputs = np.column_stack([np.repeat(planned, steps, axis=0), np.tile(np.arange(steps) * STEP_S, intervals)])
    start = np.concatenate([arrays["link_q"][0], arrays["link_qd"][0]])
    path = np.array(_step().mapaccum(len(inputs))(start, inputs.T, np.array(gains)))[:N].T
    since = (inputs[:, -1] + STEP_S)[:, None]
    q, v, a = np.split(inputs[:, :-1], 3, axis=1)
    times = np.asarray(np.arange(1, len(inputs) + 1) * STEP_S)
    return times, path - (q + v * since + a * since**2 / 2)


@cache
def _step() -> ca.Function:
    """(state, planned angles, rates and accelerations with the time since then, gains) to the state a step later."""
    q, v, planned, gains = SX.sym("q", N), SX.sym("v", N), SX.sym("planned", 3 * N + 1), SX.sym("gains", 2)
    motion = make_dynamics(q, v, link_angles(q))
    dynamics = ca.Function("dynamics", [q, v], ca.cse([motion.M, motion.C @ v + motion.G]))
    q0, v0, a, time = ca.vertsplit(planned, [0, N, 2 * N, 3 * N, 3 * N + 1])
    now_q, now_v = q0 + v0 * time + a * time**2 / 2, v0 + a * time
    M_planned, h_planned = dynamics(now_q, now_v)
    M, h = dynamics(q, v)
    torque = M_planned @ a + h_planned + M @ (gains[0] * (now_q - q) + gains[1] * (now_v - v))
    rate = ca.Function("rate", [ca.vertcat(q, v), planned, gains], [ca.vertcat(v, ca.solve(M, torque - h))])

    state, given, k, dt = MX.sym("state", 2 * N), MX.sym("given", 3 * N + 1), MX.sym("gains", 2), STEP_S
    half, whole = (ca.vertcat(given[:-1], given[-1] + share * dt) for share in (0.5, 1.0))
    k1 = rate(state, given, k)
    k2 = rate(state + dt / 2 * k1, half, k)
    k3 = rate(state + dt / 2 * k2, half, k)
    k4 = rate(state + dt * k3, whole, k)
    return ca.Function("step", [state, given, k], [state + dt / 6 * (k1 + 2 * k2 + 2 * k3 + k4)])
