"""The tracked step as printed for many x at once: nine links hang from the hip, six contacts, PD control, explicit quanta.

A joint angle needs, by d'Alembert, what its link and all links that it moves give to the virtual work; no Lagrangian, no symbols.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import NamedTuple

import numpy as np

from tests.referee.series import Array
from tests.referee.stairs import EDGE, FOOT, FRICTION, GRAVITY, MOVING, QUANTUM, RODS, SETBACK, T3, _planned, _posed

LINKS = tuple(RODS)
# Links from the hip to the far end of each link.
CHAINS = {"HK": ("HK",), "KA": ("HK", "KA"), "HK'": ("HK'",), "K'A'": ("HK'", "K'A'"), "UH": ("UH",)}
CHAINS |= {"AS": (*CHAINS["KA"], "AS"), "A'S'": (*CHAINS["K'A'"], "A'S'")}
CHAINS |= {"ST": (*CHAINS["AS"], "ST"), "S'T'": (*CHAINS["A'S'"], "S'T'")}
ENDS = ("KA", "AS", "ST", "K'A'", "A'S'", "S'T'")  # ankles, soles and toes
KNEES = (("KA", "HK"), ("K'A'", "HK'"))
K_S, K_D, DISTURBANCE, WORTH = 5e4, 500.0, 1 / 70, 100.0
LARGEST = 1e3  # a state beyond this has diverged
MASS = sum(mass for _, mass in RODS.values())


class Plan(NamedTuple):
    """The planned step at both ends of every quantum, origin at the stance ankle."""

    hip: Array  # (2, m + 1, 2) place, velocity
    q: Array  # (m + 1, 9) angles of links but the torso's


def plan_quanta(values: Mapping[str, float], quanta: int, run: float, rise: float) -> Plan:
    """The planned step in single instants; ``values`` by the names of ``_planned``."""
    x = {name: np.array([value]) for name, value in values.items()}
    ends = np.array([[0.0], x["t1"], x["t2"], x["t_bc"], [T3]])
    places, angles = [], []
    for k in range(quanta + 1):
        phase = int(np.searchsorted(ends[1:4, 0], k * QUANTUM, side="right"))
        at = _planned(phase, np.full((1, 1), k * QUANTUM), ends, x, run, rise)
        posed, _ = _posed(at, np.zeros(1))
        places.append([at.hip.d(i)[:, 0, 0] for i in range(2)])
        angles.append([posed[link].d(0)[0, 0] for link in MOVING] + [0.0, 0.0])
    return Plan(np.array(places).transpose(1, 0, 2), np.array(angles))


def track(X: Array, values: Mapping[str, float], quanta: int, run: float, rise: float) -> dict[str, Array]:
    """Objective, rows and indexes by name, each (P,), at X (P, 3): K_p, K_d and torso pitch."""
    plan, count = plan_quanta(values, quanta, run, rise), len(X)
    kp, kd, torso = (column[:, None] for column in X.T)
    joints = np.eye(9)
    for link, thigh in KNEES:  # (27), (28)
        joints[LINKS.index(link), LINKS.index(thigh)] = -1.0
    desired = np.tile(plan.q, (count, 1, 1))
    desired[:, :, LINKS.index("UH")] = torso
    differences = np.diff(plan.q, axis=0) / QUANTUM
    rates = np.tile(np.vstack([differences[:1], differences]), (count, 1, 1))
    q, v = desired[:, 0], rates[:, 0]
    errors, powers, torques, places, finite = [], [], [], [], np.zeros(count)
    for k in range(quanta):
        torque = kp * ((desired[:, k] - q) @ joints.T) + kd * ((rates[:, k] - v) @ joints.T)  # (50) to (52)
        driven = (torque + DISTURBANCE * np.sin(2 * k * QUANTUM)) @ joints
        lift = (plan.hip[1, k + 1] - plan.hip[1, k]) / QUANTUM
        a = _accelerate(q, v, driven, plan.hip[:, k], lift, run, rise)
        places.append(_zmp(q, v, a, plan.hip[0, k], lift, rise / run))
        q, v = q + v * QUANTUM + a * QUANTUM**2 / 2, v + a * QUANTUM  # (47), (48)
        finite += np.abs(q.sum(axis=1) + v.sum(axis=1)) < LARGEST
        errors.append(np.hstack([(q - desired[:, k + 1]) @ joints.T, (v - rates[:, k + 1]) @ joints.T]))
        powers.append(torque * (v @ joints.T))
        torques.append(torque)
    parts = (np.stack(part, axis=1) for part in (errors, powers, torques, places))
    return _judge(*parts, values["t2"], run) | {"quanta_before_divergence": finite}


def _judge(errors: Array, power: Array, torque: Array, zmp: Array, t2: float, run: float) -> dict[str, Array]:
    """Rows and indexes from (P, m, ...) of all quanta."""
    quanta = zmp.shape[1]
    now = np.arange(1, quanta + 1) * QUANTUM
    margin = np.minimum(zmp - np.where(now < t2, FOOT - run, 0.0), FOOT - zmp).min(axis=1)
    tracking, effort = (np.abs(part).sum(axis=(1, 2)) for part in (errors, power))
    found = {f"zmp[x, {k + 1}]": zmp[:, k] for k in range(quanta)}
    found |= {"controller_cost": (tracking + effort) / quanta, "tracking_cost": tracking / quanta}
    found |= {"cost": (tracking + effort) / quanta - WORTH * margin, "energy_J": effort * QUANTUM}
    found |= {"largest_error_rad": np.abs(errors[:, :, :9]).max(axis=(1, 2)), "zmp_margin_min_m": margin}
    return found | {"peak_torque_Nm": np.abs(torque).max(axis=(1, 2))}


def _turn(q: Array) -> tuple[Array, Array]:
    """Directions of the links and their derivatives by the angles, (P, 9, 2) each."""
    up = np.where(np.array(LINKS) == "UH", 1.0, -1.0)
    return np.stack([np.cos(q), up * np.sin(q)], axis=2), np.stack([-np.sin(q), up * np.cos(q)], axis=2)


def _arms(*, middle: bool) -> Array:
    """(9, 9) [m]: how far the far end, or the middle, of link i is moved by the direction of link j."""
    arms = np.zeros((9, 9))
    for i, link in enumerate(LINKS):
        for j in CHAINS[link]:
            arms[i, LINKS.index(j)] = RODS[j][0] * (0.5 if middle and j == link else 1.0)
    return arms


def _accelerate(q: Array, v: Array, driven: Array, hip: Array, lift: Array, run: float, rise: float) -> Array:
    """Accelerations (P, 9) of the links, driven by torques on them, with the hip's place and velocity, and its acceleration."""
    along, aside = _turn(q)
    middle, masses = _arms(middle=True), np.array([mass for _, mass in RODS.values()])
    inertia = np.diag([mass * length**2 / 12 for length, mass in RODS.values()])
    coupled = np.einsum("i,ij,ik->jk", masses, middle, middle)
    mass = coupled * np.einsum("pja,pka->pjk", aside, aside) + inertia  # (36) to (42)
    carried = lift + np.array([0.0, GRAVITY]) - np.einsum("ik,pka,pk->pia", middle, along, v**2)
    force = driven - np.einsum("i,ij,pja,pia->pj", masses, middle, aside, carried)
    whole = _arms(middle=False)
    for end in ENDS:
        arm = whole[LINKS.index(end)]
        x, z = (hip[0] + np.einsum("j,pja->pa", arm, along)).T
        vx, vz = (hip[1] + np.einsum("j,pja,pj->pa", arm, aside, v)).T
        steps = sum(1.0 / (1.0 + np.exp(-(x + SETBACK - edge) / EDGE)) for edge in (0.0, run))
        depth = z - rise * (steps - 1.0)
        normal = np.where(depth <= 0.0, -K_S * depth - K_D * vz, 0.0)  # (33)
        ground = np.stack([-FRICTION * np.sign(vx) * normal, normal], axis=1)  # (34)
        force += arm * np.einsum("pja,pa->pj", aside, ground)  # (35)
    return np.linalg.solve(mass, force[:, :, None])[:, :, 0]


def _zmp(q: Array, v: Array, a: Array, hip: Array, lift: Array, slope: float) -> Array:
    """(49): no spin, one slope; NaN where the robot falls freely."""
    (along, aside), middle = _turn(q), _arms(middle=True)
    masses = np.array([mass for _, mass in RODS.values()])
    at = hip + np.einsum("ij,pja->pia", middle, along)
    moved = lift + np.einsum("ij,pja,pj->pia", middle, aside, a) - np.einsum("ij,pja,pj->pia", middle, along, v**2)
    vertical = masses * (moved[:, :, 1] + GRAVITY)
    pull = masses * moved[:, :, 0]
    load = vertical.sum(axis=1) - slope * pull.sum(axis=1)
    moment = (at[:, :, 0] * vertical - at[:, :, 1] * pull).sum(axis=1)
    return np.where(load > 0.01 * MASS * GRAVITY, moment / load, np.nan)
