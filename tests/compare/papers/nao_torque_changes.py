"""Candidates for the torque change that the NAO paper prints for double support, each applied to a printed solution."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import casadi as ca
import numpy as np

from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.gaits.biped.body import Body
from nlp_gait.gaits.biped.samples import BOTH_FEET
from nlp_gait.gaits.nao.body import make_nao
from nlp_gait.gaits.nao.joints import JOINTS, YAW_PITCHES
from nlp_gait.symbolic.trajectories import Motion

LEFT, RIGHT = (0.06, 0.05), (0.12, -0.05)  # feet in double support [m], section 4.2

# From angles, rates and accelerations (N, J) and the torso's shares on both legs (N, 2): torques (N, J) [Nm].
Torques = Callable[[Array, Array, Array, Array], Array]


def compute_torque_changes(problem: GaitProblem, x: Sequence[float]) -> dict[str, float]:
    """Return the largest torque change by candidate [Nm]; those that are options of the problem are not among them.

    Args:
        problem: double support as printed.
        x: variables.
    """
    arrays = problem.signals(problem.check_x(x)).arrays
    q, qd, qdd, hip, step = arrays["q"], arrays["qd"], arrays["qdd"], arrays["hip"], float(arrays["t"][1])
    still, body = np.zeros_like(q), make_nao(str(problem.options["robot"]))
    torques, chain = _make_torques(body, whole=False), _make_torques(body, whole=True)
    across = np.column_stack([LEFT[1] - hip[:, 1], hip[:, 1] - RIGHT[1]]) / (LEFT[1] - RIGHT[1])  # (28), (29)
    along = np.column_stack([hip[:, 0] - LEFT[0], RIGHT[0] - hip[:, 0]]) / (RIGHT[0] - LEFT[0])
    all_of_it, whole_robot = np.ones_like(across), body.robot.mass_kg / body.robot.links[body.robot.root].mass_kg
    tau, shares = torques(q, qd, qdd, across), (q, qd, qdd)
    yaw = [JOINTS.index(name) for name in YAW_PITCHES]
    one_motor = np.column_stack([tau, tau[:, yaw].sum(axis=1)])
    before, after = (_differentiate(q, step, lead) for lead in (True, False))
    return {
        "torque of one joint over one interval, as here": _largest_change(tau),
        "sum over all joints": float(np.abs(np.diff(tau, axis=0)).sum(axis=1).max()),
        "over two intervals": float(np.abs(tau[2:] - tau[:-2]).max()),
        "greatest minus least over the phase": float(np.ptp(tau, axis=0).max()),
        "both hip yaw-pitch torques on one motor": _largest_change(one_motor),
        "gravity only": _largest_change(torques(q, still, still, across)),
        "backward differences from rest": _largest_change(torques(q, *before, across)),
        "forward differences to rest": _largest_change(torques(q, *after, across)),
        "shares by the distances along the walk": _largest_change(torques(*shares, along)),
        "half of the torso on each leg": _largest_change(torques(*shares, all_of_it / 2)),
        "the whole torso on each leg": _largest_change(torques(*shares, all_of_it)),
        "(28), (29) divide the weight of the robot": _largest_change(torques(*shares, whole_robot * across)),
        "one chain from the left to the right foot": _largest_change(chain(*shares, all_of_it)),
    }


def _largest_change(torque: Array) -> float:
    return float(np.abs(np.diff(torque, axis=0)).max())


def _differentiate(q: Array, step: float, lead: bool) -> tuple[Array, Array]:
    """Return rates and accelerations by one-sided differences; the sample without a neighbour is taken at rest."""

    def difference(values: Array) -> Array:
        change, rest = np.diff(values, axis=0) / step, np.zeros((1, values.shape[1]))
        return np.concatenate([rest, change] if lead else [change, rest])

    return difference(q), difference(difference(q))


def _make_torques(body: Body, *, whole: bool) -> Torques:
    """Return the torques of both legs from their own feet, or of the whole robot from the left foot."""
    q, qd, qdd, share = (ca.SX.sym(name, size) for name, size in (("q", 22), ("qd", 22), ("qdd", 22), ("share", 2)))
    rows = zip(*(ca.vertsplit(part) for part in (q, qd, qdd)), strict=True)
    motions = {name: Motion(*row) for name, row in zip(JOINTS, rows, strict=True)}
    found: Mapping[str, ca.SX] = {}
    chains = [("left", tuple(body.robot.joints))] if whole else [(BOTH_FEET[s], body.leg_joints[s]) for s in BOTH_FEET]
    for k, (foot, joints) in enumerate(chains):
        carried = {body.robot.root: share[k]}
        found = {**found, **body.compute_torques(body.robot.feet[foot].link, joints, motions, carried)[0]}
    function = ca.Function("torques", [q, qd, qdd, share], [ca.vertcat(*(found[name] for name in JOINTS))])

    def evaluate(*inputs: Array) -> Array:
        return np.array(function.map(len(inputs[0]))(*(part.T for part in inputs))).T

    return evaluate
