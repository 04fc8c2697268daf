"""The 12-joint walk in plain NumPy, straight from the paper's print: written apart from the package, to check it."""

from typing import Any, NamedTuple

import numpy as np

Array = np.ndarray[Any, np.dtype[np.float64]]

M1, M2, M3, M4 = 0.07, 0.02, 0.14, 0.21
D1, D2, W, L = 0.19, 0.15, 0.12, 0.02
GRAVITY = 9.81
MASSES = np.array([M3, M1, M4, M2, M4, M1, M3])


class Leg(NamedTuple):
    """Ankle (3,), hip (3,) and theta of ankle roll, ankle pitch, knee, hip pitch, hip roll."""

    ankle: Array
    hip: Array
    theta: Array


def legs(x: Array, t: float, T: float = 1.0) -> tuple[Leg, Leg]:
    """Stance and swing leg by (1)-(6)."""
    s, n, H, h = x
    p12x = s / 2 * np.sin(np.pi / T * (t - T / 2))
    p12 = np.array([p12x, -W, H * np.sin(np.pi * (p12x / s + 0.5))])
    p6y = n * np.sin(np.pi / 2 * (np.sin(t * np.pi / 2 / T) + 1)) * np.sin(np.pi * t / T)
    p6 = np.array([s / 4 * np.sin(np.pi / T * (t - T / 2)), p6y, D1 + D2 - h])
    return _leg(np.zeros(3), p6, -p6[0]), _leg(p12, p6 - [0, W, 0], p12x - p6[0])


def _leg(ankle: Array, hip: Array, along: float) -> Leg:
    y, z = -hip[1] + (ankle[1] if ankle[1] else 0.0), ankle[2] - hip[2]
    r = np.sqrt(along**2 + y**2 + z**2)
    theta_a = np.arccos((D1**2 + D2**2 - r**2) / (2 * D1 * D2))
    theta_b = np.arccos(np.clip(D1 * np.sin(theta_a) / r, -1, 1))
    knee = np.pi - theta_a
    hip_pitch = np.pi / 2 - theta_a + theta_b + np.arcsin(along / r)
    roll = np.arctan(y / z)
    return Leg(ankle, hip, np.array([roll, knee - hip_pitch, knee, hip_pitch, -roll]))


def shank(leg: Leg, distance: float) -> Array:
    """Point of the shank by forward kinematics."""
    roll, pitch = leg.theta[:2]
    up = np.array([np.sin(pitch), np.cos(pitch) * np.sin(roll), np.cos(pitch) * np.cos(roll)])
    return np.asarray(leg.ankle + distance * up)


def hip_by_forward_kinematics(leg: Leg) -> Array:
    """Hip from the ankle through both links."""
    roll, pitch, knee = leg.theta[:3]
    thigh = pitch - knee
    up = np.array([np.sin(thigh), np.cos(thigh) * np.sin(roll), np.cos(thigh) * np.cos(roll)])
    return np.asarray(shank(leg, D2) + D1 * up)


def appendix_shank(leg: Leg, distance: float) -> Array:
    """The same by (A3)-(A6), with theta_B from (2)."""
    line = leg.ankle - leg.hip
    r = np.linalg.norm(line)
    theta_a = np.arccos((D1**2 + D2**2 - r**2) / (2 * D1 * D2))
    theta_b = np.arccos(np.clip(D1 * np.sin(theta_a) / r, -1, 1))
    roll, pitch = leg.theta[:2]
    up = np.array([np.cos(theta_b) * np.cos(roll), np.sin(theta_b) * np.sin(roll), np.cos(roll) * np.cos(pitch)])
    return np.asarray(leg.ankle + distance * up)


def points(x: Array, t: float, T: float = 1.0, shank: Any = shank) -> Array:
    """(7, 3) point masses in the order of MASSES."""
    stance, swing = legs(x, t, T)
    near, far = ([shank(leg, d) for d in (L, D2)] for leg in (stance, swing))
    return np.array([*near, stance.hip, (stance.hip + swing.hip) / 2, swing.hip, far[1], far[0]])


def accelerations(x: Array, t: float, T: float = 1.0, shank: Any = shank, step: float = 1e-3) -> Array:
    """(7, 3) by the five-point central difference."""
    p = [points(x, t + k * step, T, shank) for k in (-2, -1, 0, 1, 2)]
    return np.asarray((-p[0] + 16 * p[1] - 30 * p[2] + 16 * p[3] - p[4]) / (12 * step**2))
