"""The 12-joint walk of Goswami, Vadakkepat, Phung (2008) for many x at once: point masses by exact forward kinematics."""

from typing import NamedTuple

import numpy as np
from scipy.special import roots_legendre

from tests.referee.series import Array, Series, atan2, sincos, sqrt, stack, time

# Table I.
KNEE, WAIST, FOOT, HIP = 0.07, 0.02, 0.14, 0.21
THIGH, SHANK, WIDTH, SOLE = 0.19, 0.15, 0.12, 0.02
BACK, FRONT, BREADTH = 0.03, 0.07, 0.055
GRAVITY = 9.81
F1_MAX, F2_MAX = 442.522, 0.13  # section 7
INTERVALS = 20  # of the metrics; every second one is an instant of the reach
PANELS, NODES = 10, 16  # of Gauss's rule for (9)


class Leg(NamedTuple):
    """Points of a leg (3, N) and the cosine of its knee."""

    sole: Series
    knee: Series
    hip: Series
    cosine: Array


def walk(X: Array, weight: float = 0.15, T: float = 1.0, static_load: bool = False) -> dict[str, Array]:
    """Objective, rows and metrics by name, each (P,), at X (P, 4): s, n, H, h.

    Args:
        X: variables.
        weight: lambda of eq. (11).
        T: time of a step [s].
        static_load: the weight alone is the ground's load, as eq. (14) has it, without the masses' vertical acceleration.
    """
    s, n, H, h = X.T[:, None, :]
    nodes, weights = roots_legendre(NODES)
    instants = [np.linspace(0.0, 1.0, INTERVALS + 1), *((k + (nodes + 1) / 2) / PANELS for k in range(PANELS))]
    phases = np.concatenate(instants)[:, None]
    t = time(T * np.broadcast_to(phases, (len(phases), len(X))), 2)
    # (4), (6) over the first step; P0 stands at the origin.
    swing_x = sincos((t - T / 2) * (np.pi / T))[0] * (s / 2)
    swing = stack([swing_x, -WIDTH, sincos((swing_x / s + 0.5) * np.pi)[0] * H])
    shift = sincos((sincos(t * (np.pi / (2 * T)))[0] + 1.0) * (np.pi / 2))[0]
    hip = stack(
        [sincos((t - T / 2) * (np.pi / T))[0] * (s / 4), shift * sincos(t * (np.pi / T))[0] * n, THIGH + SHANK - h]
    )
    far_hip = hip + np.array([0.0, -WIDTH, 0.0])[:, None, None]
    stance, moved = _leg(t.like(np.zeros((3, 1, 1))) + t * 0.0, hip), _leg(swing, far_hip)
    middle = (hip + far_hip) / 2.0
    masses = np.array([FOOT, KNEE, HIP, WAIST, HIP, KNEE, FOOT])[:, None, None]
    points = [stance.sole, stance.knee, stance.hip, middle, moved.hip, moved.knee, moved.sole]
    p, a = (np.stack([point.d(order) for point in points]) for order in (0, 2))
    vertical = masses * (GRAVITY + a[:, 2])
    load = GRAVITY * masses.sum() if static_load else vertical.sum(axis=0)
    zmp = [(p[:, k] * vertical - masses * a[:, k] * p[:, 2]).sum(axis=0) / load for k in (0, 1)]  # (14)
    squares = (zmp[0] ** 2 + zmp[1] ** 2)[INTERVALS + 1 :]
    Q = T * np.tile(weights, PANELS) @ squares / (2 * PANELS)  # (9)
    zmp = [part[: INTERVALS + 1] for part in zmp]
    margin = np.min([zmp[0] + BACK, FRONT - zmp[0], zmp[1] + BREADTH / 2, BREADTH / 2 - zmp[1]], axis=0)  # (8)
    found = {"f": weight / Q / F1_MAX + (1 - weight) * X[:, 0] / F2_MAX, "f1_per_m2s": 1 / Q, "Q_m2s": Q}  # (10), (11)
    found |= {"hip_speed_m_s": X[:, 0] / (2 * T), "zmp_margin_min_m": margin.min(axis=0)}
    stable = (margin >= 0.0).astype(float)
    found["stable_share"] = (stable.sum(axis=0) - (stable[0] + stable[-1]) / 2) / INTERVALS
    for letter, value in zip("xy", zmp, strict=True):
        found |= {f"zmp_{letter}_min_m": value.min(axis=0), f"zmp_{letter}_max_m": value.max(axis=0)}
    for name, leg in (("stance", stance), ("swing", moved)):
        found |= {
            f"reach[{name} leg, {k / INTERVALS:g} T]": cosine for k, cosine in enumerate(leg.cosine[: INTERVALS + 1])
        }
    return found


def _leg(ankle: Series, hip: Series) -> Leg:
    """By (2), (3) as lengths and angles: the leg's plane is turned about x, the knee lies in front of the line."""
    line = hip - ankle
    up = sqrt(line[1] * line[1] + line[2] * line[2])
    length = sqrt(line[0] * line[0] + up * up)
    cosine = (length * length - (THIGH**2 + SHANK**2)) / (2 * THIGH * SHANK)
    # The knee is where the shank and the thigh meet, off the line from ankle to hip: a triangle's foot and height.
    along = (length * length + (SHANK**2 - THIGH**2)) / (2.0 * length)
    height = sqrt(SHANK**2 - along * along)
    forward = atan2(line[0], up)
    sine, rest = sincos(forward)
    ahead, above = along * sine + height * rest, along * rest - height * sine
    knee = ankle + stack([ahead, above * line[1] / up, above * line[2] / up])
    return Leg(ankle + (knee - ankle) * (SOLE / SHANK), knee, hip, cosine.d(0))
