"""Algorithm 4 of the stairs paper: an ant colony at every instant, for the gains or the torques that make (53) least there."""

import time
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

import casadi as ca
import numpy as np

from metaheuristics import minimize
from metaheuristics.interface import Algorithm
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.gaits.stairs.closed_loop import GIVEN, QUANTUM, TORSO, ClosedLoop, N
from nlp_gait.gaits.stairs.display import JOINTS, make_rigid_bodies
from nlp_gait.gaits.stairs.track import compute_support
from nlp_gait.symbolic.nonsmooth import Exact

Decides = Literal["gains", "torques"]
PERCENTILES = (5, 95)
LARGEST_STATE = 1e3  # a step beyond this [rad, rad/s] has diverged


@dataclass(frozen=True, kw_only=True, eq=False)
class Quanta:
    """All quanta of a step; what is decided in each is x: K_p, K_d and torso pitch, or nine torques [Nm]."""

    problem: GaitProblem  # ``stairs-track`` with the parameters of the step
    loop: ClosedLoop  # of its options
    torso_rad: float  # desired torso pitch at the start, and of torques
    decides: Decides

    @cached_property
    def bounds(self) -> Array:
        """(2, n) of x: the problem's; for torques weight at a lever, see ``make_rigid_bodies``; the paper names none."""
        if self.decides == "gains":
            return np.stack([self.problem.lower, self.problem.upper])
        joints = make_rigid_bodies().joints
        hip, knee, ankle, toe = (joints[name].torque_limit_Nm for name in JOINTS[:4])
        fifth = ankle if self.loop.coordinates == "joint" else hip  # of the stance ankle, or of the torso
        limits = np.array([hip, knee, hip, knee, fifth, ankle, toe, ankle, toe])
        return np.stack([-limits, limits])

    @cached_property
    def inputs(self) -> tuple[Array, Array, Array]:
        """Desired states (m + 1, 18), other inputs (m, n), and both ends of the support polygon (m, 2) [m]."""
        at = self.problem.at([1.0, 1.0, self.torso_rad])
        desired, given = (np.array(ca.evalf(part)).T for part in self.loop.inputs(at, Exact()))
        ends = [np.array(ca.evalf(part)) for part in compute_support(at, self.loop)]
        return desired, given, np.hstack(ends)

    @cached_property
    def _quantum(self) -> ca.Function:
        state, given, tuned = ca.MX.sym("state", 2 * N), ca.MX.sym("given", sum(GIVEN.values())), ca.MX.sym("tuned", 3)
        following = self.loop.step(state, given, tuned)
        outcome = self.loop.outcome(state, following, given, tuned)
        return ca.Function("quantum", [state, given, tuned], [following, *outcome])

    def move(self, k: int, state: Array, X: Array) -> dict[str, Array]:
        """Return what follows in quantum k from a state (18,) at points X (P, n), with P rows each."""
        count, (desired, given, polygon) = len(X), self.inputs
        tuned, inputs, aim = X, np.tile(given[k], (count, 1)), np.tile(desired[k + 1], (count, 1))
        if self.decides == "torques":
            tuned = np.tile([0.0, 0.0, self.torso_rad], (count, 1))
            inputs[:, -N:] = X
        aim[:, TORSO] = tuned[:, 2]
        found = self._quantum.map(count)(np.tile(state[:, None], count), inputs.T, tuned.T)
        following, torque, zmp = (np.array(part).T for part in found)
        joints = self.loop.joints.full().T
        errors, rates = following - aim, following[:, N:] @ joints
        errors = np.hstack([errors[:, :N] @ joints, errors[:, N:] @ joints])
        power = np.abs(torque * rates).sum(axis=1)
        outside = np.maximum(polygon[k, 0] - zmp[:, 0], zmp[:, 0] - polygon[k, 1])
        return {
            "state": following,
            "cost": np.abs(errors).sum(axis=1) + power,  # (eq. 53)
            "power_W": power,
            "error_rad": np.abs(errors[:, :N]).max(axis=1),
            "outside_m": np.maximum(outside, 0.0),
        }


class Quantum:
    """Objective of one quantum: (53) at its end, with the distance of the ZMP from the support polygon as violation."""

    def __init__(self, instants: Quanta, k: int, state: Array) -> None:
        self.lower, self.upper = instants.bounds
        self.names = tuple(f"x{i}" for i in range(len(self.lower)))
        self._instants, self._k, self._state = instants, k, state

    def __call__(self, X: Array, /) -> tuple[Array, Array]:
        """Return (53) and violations (P,) [m] of points (P, n)."""
        found = self._instants.move(self._k, self._state, X)
        return found["cost"], found["outside_m"]


def track_by_instants(instants: Quanta, algorithm: Algorithm, evaluations: int) -> dict[str, Any]:
    """Return what Algorithm 4 finds over a whole step by a search at each instant k, whose seed is k.

    These are means and extremes, and percentiles of its decisions.
    """
    state, moments, started = instants.inputs[0][0], list[Mapping[str, Array]](), time.perf_counter()
    for k in range(instants.loop.quanta):
        x = minimize(Quantum(instants, k, state), algorithm, evaluations=evaluations, seed=k).x
        moments.append({"x": x[None], **instants.move(k, state, x[None])})
        state = moments[-1]["state"][0]
        if not np.abs(state).max() < LARGEST_STATE:
            break
    all_of = {name: np.concatenate([moment[name] for moment in moments]) for name in moments[0]}
    return {
        "quanta": len(moments),
        "finite": len(moments) == instants.loop.quanta,
        "time_s": time.perf_counter() - started,
        "cost": float(all_of["cost"].mean()),
        "energy_J": float(all_of["power_W"].sum()) * QUANTUM,
        "largest_error_rad": float(all_of["error_rad"].max()),
        "outside_quanta": int((all_of["outside_m"] > 0.0).sum()),
        "decided": np.percentile(all_of["x"], PERCENTILES, axis=0).T.tolist(),
    }
