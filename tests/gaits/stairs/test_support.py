"""Balance with the load on both feet: against ``compute_loads`` on a flat stance foot, and by the mechanical energy."""

import casadi as ca
import numpy as np
import pytest
from casadi import SX

import nlp_gait
from nlp_gait.formulation import GaitProblem, Grid
from nlp_gait.gaits.stairs.plan_samples import PlannedStep
from nlp_gait.gaits.stairs.planar_biped import (
    GRAVITY,
    compute_loads,
    load_toe_foot_biped,
    locate_centres,
    locate_points,
)
from nlp_gait.symbolic.nonsmooth import Exact

NEAR_BEST = (0.69, 0.09, 0.24, 0.09, 0.7, 1.45, 0.58, 0.8, 1.3, 0.32)


def load() -> GaitProblem:
    return nlp_gait.load("stairs-plan", balance="polygon", intervals=16)


def test_torques_and_pressure_are_those_of_the_flat_stance_foot() -> None:
    """With the share that was found on the rear toe, another derivation has the same torques and centre of pressure."""
    behind = (*NEAR_BEST[:2], 0.2, *NEAR_BEST[3:])  # the ZMP starts near the rear foot
    arrays = load().signals(np.array(behind)).arrays
    q, v, a, force = (SX.sym(name, size) for name, size in (("q", 7), ("v", 7), ("a", 7), ("force", 2)))
    found = compute_loads(q, v, a, {"T": force})
    at = ca.Function("loads", [q, v, a, force], [found.torque, found.stance_force, found.stance_pressure])
    shares = []
    for k in range(len(arrays["t"])):
        links = [arrays[f"link_{name}"][k] for name in ("q", "qd", "qdd")]
        whole = np.array(at(*links, [0, 0])[1]).ravel()
        share = 1 - arrays["stance_force"][k, 1] / whole[1]
        torque, stance, pressure = (np.array(part).ravel() for part in at(*links, share * whole))
        assert arrays["stance_force"][k] == pytest.approx(stance, abs=1e-8)
        # The rear force acts at the toe but while the rear sole stands.
        if arrays["t"][k] > NEAR_BEST[6] + 1e-9:
            assert arrays["tau"][k] == pytest.approx(torque, abs=1e-8)
            assert arrays["stance_pressure"][k, 0] == pytest.approx(pressure[0], abs=1e-9)
            shares.append(share)
    assert max(shares) > 0.05 and shares[-1] == pytest.approx(0.0, abs=1e-12)


def test_power_of_all_joints_is_the_change_of_mechanical_energy() -> None:
    """Ground forces act on points that stand still."""
    parts = 200
    planned = PlannedStep(phase_grid=Grid(intervals=parts), balance="polygon")
    samples = planned.samples(load().at(NEAR_BEST), Exact())
    time, power, q = (np.array(ca.evalf(part)) for part in (samples.time, samples.power, samples.q))
    foot = place = np.zeros((2, q.shape[1]))
    angles, ankle = SX.sym("q", 9), SX.sym("ankle", 2)
    middles = locate_centres(locate_points(angles, ankle))
    centre = ca.Function("centres", [angles, ankle], [ca.vertcat(*middles.values())])
    masses, spins = (
        np.array([getattr(link, name) for link in load_toe_foot_biped().links]) for name in ("mass_kg", "inertia_kgm2")
    )
    checked = 0
    for phase in range(4):
        these = slice(phase * (parts + 1), (phase + 1) * (parts + 1))
        t, q9 = time[0, these], np.vstack([q, foot])[:, these]
        at = np.array(centre.map(parts + 1)(q9, place[:, these])).reshape(9, 2, -1)
        speed, turn = np.gradient(at, t, axis=2), np.gradient(q9, t, axis=1)
        energy = masses @ ((speed**2).sum(axis=1) / 2 + GRAVITY * at[:, 1]) + spins @ turn**2 / 2
        change, inner = np.gradient(energy, t), slice(3, -3)
        error = np.abs(change - power[:, these].sum(axis=0))[inner] / np.abs(power[:, these]).max()
        assert error.max() < 3e-3
        checked += len(error)
    assert checked > 700
