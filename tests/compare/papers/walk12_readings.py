"""What the paper of the 12-joint walk leaves open about the ZMP, read in other ways for a printed gait."""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache
from itertools import product

import casadi as ca
import numpy as np
from casadi import SX
from scipy.stats import qmc

from compare.papers.walk12.walk12_paper import F1MAX, F2MAX, PaperRow
from compare.papers.walk12.walk12_runs import CORNER_M, compute_f1, load_walk12
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.kernel.compiled import compile_objective
from nlp_gait.formulation import Array
from nlp_gait.gaits.walk12.walk12_model import (
    GRAVITY,
    PointMassBiped,
    compute_legs,
    compute_mass_motion,
    list_masses,
    load_point_mass_biped,
)
from nlp_gait.gaits.walk12.walk12_problem import make_rule
from nlp_gait.symbolic.nonsmooth import Exact

STEP_M = 1e-4  # of a difference quotient
SAMPLES = 4096  # points within the bounds (7)
DIGIT_M, DIGIT_F = 5e-4, 5e-4  # half the last printed digit
ROD_SHARE = 0.1  # of the actuators' mass: section 6 gives 5 to 10 %


def compute_f1_variants(x: tuple[float, ...]) -> dict[str, float]:
    """Return f1 [1/(m^2 s)] at T = 1 s by (14), as in the problem and with what the paper leaves open read in another way.

    "ground": heights of the masses from the ground, with an ankle at the height L of the foot's mass above it; "g": 9.8 m/s^2;
    "foot": the foot's mass stays at the height L above its ankle; "rods": (13) with M of uniform rods for thighs and shanks,
    a tenth of the actuators' mass in all. "rods_mm" is the greatest shift of the ZMP by these moments [mm].
    """
    robot, (phases, weights) = load_point_mass_biped(), (np.array(part).ravel() for part in make_rule("gauss", 20))
    m, up = np.array(list_masses(robot)).ravel(), robot.foot_com_height_m
    sample = _make_mass_function(robot)
    samples = [[np.array(value) for value in sample(np.array(x), phase)] for phase in phases]
    P, A, ankle, ankle_a = (np.array(values) for values in zip(*samples, strict=True))  # (n, 3, 7) and (n, 3, 1)

    def f1(P: Array, A: Array, g: float = GRAVITY, base: float = 0.0, moments: Array | float = 0.0) -> float:
        xy = P[:, :2] * (A[:, 2:] + g) - (P[:, 2:] + base) * A[:, :2]
        return float(1 / (weights @ (((xy @ m + moments) / (g * m.sum())) ** 2).sum(axis=1)))

    P_foot, A_foot = P.copy(), A.copy()
    P_foot[:, :, [0]], A_foot[:, :, [0]] = np.array([[0.0], [0.0], [up]]), 0.0
    P_foot[:, :, [6]], A_foot[:, :, [6]] = ankle + np.array([[0.0], [0.0], [up]]), ankle_a
    still, turning = np.zeros_like(ankle), np.zeros((len(phases), 3))
    feet = ((still, still), (ankle, ankle_a))
    for (foot, foot_a), knee, hip in zip(feet, (1, 5), (2, 4), strict=True):
        for rod, rod_a in (
            (P[:, :, [knee]] - foot, A[:, :, [knee]] - foot_a),
            (P[:, :, [hip]] - P[:, :, [knee]], A[:, :, [hip]] - A[:, :, [knee]]),
        ):
            spin = np.cross(rod[:, :, 0], rod_a[:, :, 0])  # l^2 u x u''
            turning += ROD_SHARE / 4 * m.sum() / 12 * spin
    return {
        "ours": f1(P, A),
        "ground": f1(P, A, base=up),
        "g": f1(P, A, g=9.8),
        "foot": f1(P_foot, A_foot),
        "rods": f1(P, A, moments=turning[:, [1, 0]] * [-1.0, 1.0]),
        "rods_mm": 1e3 * np.hypot(*turning[:, :2].T).max() / (GRAVITY * m.sum()),
    }


@cache
def _make_mass_function(robot: PointMassBiped) -> ca.Function:
    """Return the function of (x, phase) to positions and accelerations of the masses and of the swing ankle, at T = 1 s."""
    x, phase = SX.sym("x", 4), SX.sym("phase")
    stance, swing = compute_legs(x, phase, SX(1), SX(0), SX(0), robot, Exact())
    masses = compute_mass_motion(stance, swing, robot)
    ankle = swing.ankle
    return ca.Function("masses", [x, phase], [masses.position, masses.acceleration, ankle.position, ankle.acceleration])


def compute_corner_slopes() -> dict[str, float]:
    """Return the change of f per metre from the corner (0.13, 0.13, 0.13, 0.13) inward along each variable.

    Lambda is 0.15, on 400 intervals.
    """
    dense = load_walk12().dense(20)
    assert dense is not None  # its grid can be refined
    problem = dense.with_values(**{"lambda": 0.15, "f1max": F1MAX})
    function, corner = build_exact_model(problem).function, np.full(4, CORNER_M)

    def f(x: np.ndarray) -> float:
        return -float(function(x, problem.p)[0])

    shifts = dict(zip(problem.names, STEP_M * np.eye(4), strict=True))
    return {name: (f(corner - shift) - f(corner)) / STEP_M for name, shift in shifts.items()}


def compute_hip_miss(distance: float | None = None) -> float:
    """Return the distance between the hip and where the angles of the printed (2) put it, for a vertical leg [m].

    (2) takes theta_B, the complement of the angle at the ankle, from an arccosine that is never negative; below
    sqrt(d1^2 - d2^2) that angle exceeds a right one. Without a distance between hip and ankle [m] the leg is that of the corner.
    """
    robot = load_point_mass_biped()
    d1, d2, distance = robot.thigh_m, robot.shank_m, distance or robot.leg_m - 2 * CORNER_M
    theta_a = math.acos((d1**2 + d2**2 - distance**2) / (2 * d1 * d2))
    ankle = math.pi / 2 - math.acos(d1 * math.sin(theta_a) / distance)
    thigh = ankle - (math.pi - theta_a)
    along = d2 * math.sin(ankle) + d1 * math.sin(thigh)
    up = d2 * math.cos(ankle) + d1 * math.cos(thigh)
    return math.hypot(along, up - distance)


def compute_shares() -> dict[str, float]:
    """Return shares of the gaits within the bounds (7) [%].

    "limit": they break the limit of reach, by the problem. By (4) and (6) in NumPy, "out_of_reach": a leg does not reach;
    "too_close": hip and ankle come so close that (2) misses.
    """
    problem, robot = load_walk12(), load_point_mass_biped()
    points = qmc.scale(qmc.Sobol(len(problem.names), rng=0).random(SAMPLES), problem.lower, problem.upper)
    _, violation = compile_objective(problem, threads=1)(points)
    (s, n, lift, bend), t = points.T[:, :, None], np.linspace(0.0, 1.0, 21)
    hip_x = s / 4 * np.sin(np.pi * (t - 0.5))
    hip_y = n * np.sin(np.pi / 2 * (np.sin(np.pi * t / 2) + 1)) * np.sin(np.pi * t)
    lifted = lift * np.sin(np.pi * (np.sin(np.pi * (t - 0.5)) / 2 + 0.5))
    hip_z = robot.leg_m - bend
    stance, swing = (
        np.sqrt(hip_x**2 + hip_y**2 + z**2) for z in (hip_z, hip_z - lifted)
    )  # the swing hip is as far behind its ankle as the stance hip before its own, and mirrored
    far, close = np.maximum(stance, swing).max(axis=1), np.minimum(stance, swing).min(axis=1)
    least = abs(robot.thigh_m - robot.shank_m)
    return {
        "limit": 100 * float(np.mean(violation > 0.0)),
        "out_of_reach": 100 * float(np.mean((far > robot.leg_m) | (close < least))),
        "too_close": 100 * float(np.mean(close < np.sqrt(robot.thigh_m**2 - robot.shank_m**2))),
    }


def is_rounding(row: PaperRow) -> bool:
    """Return whether the printed f is that of a gait whose variables have the printed digits."""
    corners = [PaperRow(weight=row.weight, x=_shift(row, signs), f=row.f) for signs in product((-1, 0, 1), repeat=4)]
    f = [c.weight * compute_f1(c) / F1MAX + (1 - c.weight) * c.x[0] / F2MAX for c in corners]
    return min(f) - DIGIT_F <= row.f <= max(f) + DIGIT_F


def _shift(row: PaperRow, signs: Sequence[int]) -> tuple[float, float, float, float]:
    s, n, lift, bend = (value + sign * DIGIT_M for value, sign in zip(row.x, signs, strict=True))
    return s, n, lift, bend
