"""Errata of the paper on the 12-joint walk: the effect of each misprint or simplification, as a number."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np

from compare.papers.walk12.walk12_paper import F1MAX
from compare.papers.walk12.walk12_runs import CORNER_M, load_walk12
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.gaits.walk12.locomotion import locomotion
from nlp_gait.gaits.walk12.robot import point_mass_biped

STEP_M = 1e-4


@dataclass(frozen=True, kw_only=True)
class StableShare:
    """Share of a step in which (8) is satisfied, and the first and the last such time [s]."""

    share: float
    first_s: float
    last_s: float


def compute_stable_share(x: tuple[float, ...]) -> StableShare:
    """Return when a gait is statically stable."""
    robot = point_mass_biped()
    arrays = locomotion(robot, np.array(x), steps=1, intervals=1000).arrays
    zmp_x, zmp_y = arrays["zmp_foot"].T
    inside = (-robot.foot_back_m <= zmp_x) & (zmp_x <= robot.foot_front_m) & (np.abs(zmp_y) <= robot.foot_width_m / 2)
    times = arrays["t"][inside]
    return StableShare(share=float(inside.mean()), first_s=float(times.min()), last_s=float(times.max()))


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


def compute_hip_miss() -> float:
    """Return the distance between the hip and where the angles of the printed (2) put it, for a vertical leg in the corner [m].

    (2) takes theta_B, the complement of the angle at the ankle, from an arccosine that is never negative; below
    sqrt(d1^2 - d2^2) that angle exceeds a right one.
    """
    robot = point_mass_biped()
    d1, d2, distance = robot.thigh_m, robot.shank_m, robot.leg_m - 2 * CORNER_M
    theta_a = math.acos((d1**2 + d2**2 - distance**2) / (2 * d1 * d2))
    ankle = math.pi / 2 - math.acos(d1 * math.sin(theta_a) / distance)
    thigh = ankle - (math.pi - theta_a)
    along = d2 * math.sin(ankle) + d1 * math.sin(thigh)
    up = d2 * math.cos(ankle) + d1 * math.cos(thigh)
    return math.hypot(along, up - distance)
