"""Balance with the load on both feet: against ``compute_loads`` on a flat stance foot, and while that foot lands on its toe."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from casadi import SX

import nlp_gait
from nlp_gait.errors import InputError
from nlp_gait.formulation import GaitProblem, Signals
from nlp_gait.gaits.stairs.plan_samples import PlannedStep
from nlp_gait.gaits.stairs.planar_biped import (
    GRAVITY,
    compute_loads,
    load_toe_foot_biped,
    locate_centres,
    locate_points,
)
from nlp_gait.symbolic.nonsmooth import Exact

FOOT, TREAD = load_toe_foot_biped().foot_m, 0.254
NEAR_BEST = (0.69, 0.09, 0.24, 0.09, 0.7, 1.45, 0.58, 0.8, 1.3, 0.32)
FIRST = (0.70, 0.13, 0.07, 0.10, 0.5, 1.45, 0.58, 1.2, 2.0, 0.32)


def load(step: str) -> GaitProblem:
    return nlp_gait.load("stairs-plan", step=step, balance="polygon", intervals=16)


def move(step: str, x: tuple[float, ...]) -> Signals:
    return load(step).signals(np.array(x))


def test_torques_and_pressure_are_those_of_the_flat_stance_foot() -> None:
    """With the share that was found on the rear toe, another derivation has the same torques and centre of pressure."""
    behind = (*NEAR_BEST[:2], 0.2, *NEAR_BEST[3:])  # the ZMP starts near the rear foot
    arrays = move("next", behind).arrays
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


def test_the_printed_zmp_differs_by_the_spin_of_links_only() -> None:
    polygon, feet = (nlp_gait.load("stairs-plan", balance=rule, intervals=16) for rule in ("polygon", "feet"))
    arrays = polygon.signals(np.array(NEAR_BEST)).arrays
    ours = feet.signals(np.array([*NEAR_BEST, 0.1])).arrays
    apart = np.abs(arrays["zmp"] - ours["zmp"])
    assert 0.0 < apart.max() < 0.02
    assert np.ptp(ours["support"]) == 0.0 and polygon.names == feet.names[:-1]


def test_the_landing_foot_turns_about_its_toe() -> None:
    arrays = move("landing", NEAR_BEST).arrays
    q, foot, ankle = SX.sym("q", 7), SX.sym("foot", 2), SX.sym("ankle", 2)
    found = locate_points(ca.vertcat(q, foot), ankle)
    at = ca.Function("points", [q, foot, ankle], [found["T'"], found["H"], found["A"]])
    for k in range(len(arrays["t"])):
        toe, hip, swing = (
            np.array(part).ravel()
            for part in at(arrays["link_q"][k], arrays["stance_foot"][k], arrays["stance_ankle"][k])
        )
        assert toe == pytest.approx([FOOT, 0.0], abs=1e-9)
        assert hip == pytest.approx(arrays["hip"][k], abs=1e-9)
        assert swing == pytest.approx(arrays["ankle"][k], abs=1e-9)
    flat = arrays["t"] >= NEAR_BEST[7]
    assert np.abs(arrays["stance_foot"][flat]).max() < 1e-12 < np.abs(arrays["stance_foot"][~flat]).max()
    # On its toe the foot carries with its toe only.
    early = arrays["t"] < NEAR_BEST[7] - NEAR_BEST[6] - 1e-9
    loaded = early & (arrays["stance_force"][:, 1] > 100.0)
    assert arrays["stance_pressure"][loaded, 0] == pytest.approx(FOOT, abs=1e-9)
    assert arrays["support"][0] == pytest.approx([0.12 - TREAD, FOOT])


def test_power_of_all_joints_is_the_change_of_mechanical_energy() -> None:
    """Also of the standing toe: ground forces act on points that stand still."""
    parts = 200
    planned = PlannedStep(per_phase=parts, kind="landing", balance="polygon")
    samples = planned.samples(load("landing").at(NEAR_BEST), Exact())
    fields = (samples.time, samples.power, samples.q, samples.stance_foot, samples.stance_ankle)
    time, power, q, foot, place = (np.array(ca.evalf(part)) for part in fields)
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
        smooth = np.abs(t - (NEAR_BEST[7] - NEAR_BEST[6]))[inner] > 0.02  # the landing foot's acceleration jumps there
        assert error[smooth].max() < 3e-3
        checked += smooth.sum()
    assert checked > 700


def test_the_first_step_starts_at_rest_above_the_zmp_and_ends_on_the_next_step() -> None:
    arrays = move("first", FIRST).arrays
    assert arrays["ankle"][0] == pytest.approx([0.0, 0.0], abs=1e-9)
    assert arrays["hip"][[0, -1]] == pytest.approx(np.array([[FIRST[2], FIRST[0]], [FIRST[1], FIRST[0]]]), abs=1e-9)
    assert arrays["ankle"][-1, 1] > 0.5 * 0.7 * TREAD
    assert np.ptp(arrays["stance_foot"]) == 0.0


def test_a_landing_foot_needs_the_polygon() -> None:
    with pytest.raises(InputError, match="needs balance 'polygon'"):
        nlp_gait.load("stairs-plan", step="landing")
