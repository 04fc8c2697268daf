"""Where the print of the 12-joint walk cannot be meant: what each misprint or simplification does, measured."""

from __future__ import annotations

import math
from typing import get_args

import numpy as np

import nlp_gait
from compare.papers.walk12.paper import F1MAX, TABLE_3, row_of
from compare.papers.walk12.runs import Run, best_by_ipopt, judged, walk, weighted
from nlp_gait.backends.exact import exact_model
from nlp_gait.problems.walk12.locomotion import locomotion
from nlp_gait.problems.walk12.model import Zmp
from nlp_gait.problems.walk12.robot import point_mass_biped

CORNER_M = 0.13
STEP_M = 1e-4


def errata() -> Run:
    """All measurements, as plain data."""
    return {
        "f1": {reading: _f1_of_table_3(reading) for reading in get_args(Zmp)},
        "moment_free_optimum": [best_by_ipopt(weighted(w, F1MAX, walk(zmp="moment-free"))) for w in (0.15, 1.0)],
        "stable": [_stable(row.x) for row in TABLE_3],
        "corner_slopes": _corner_slopes(),
        "corner_start": _from_corner(),
        "hip_miss_m": _hip_miss(point_mass_biped().leg_m - 2 * CORNER_M),
    }


def _f1_of_table_3(reading: Zmp) -> list[float]:
    """f1 at each row of Table III under a reading of the ZMP, on the dense grid."""
    problem = walk(zmp=reading)
    return [judged(problem, row.x)["dense"]["f1_per_m2s"] for row in TABLE_3]


def _stable(x: tuple[float, ...]) -> Run:
    """Share of the step in which (8) holds, and the first and the last such time."""
    robot = point_mass_biped()
    arrays = locomotion(robot, np.array(x), steps=1, intervals=1000).arrays
    zmp_x, zmp_y = arrays["zmp_foot"].T
    inside = (-robot.foot_back_m <= zmp_x) & (zmp_x <= robot.foot_front_m) & (np.abs(zmp_y) <= robot.foot_width_m / 2)
    times = arrays["t"][inside]
    return {"share": float(inside.mean()), "first_s": float(times.min()), "last_s": float(times.max())}


def _corner_slopes() -> dict[str, float]:
    """Change of f per metre from the corner (0.13, 0.13, 0.13, 0.13) inward along each variable, lambda 0.15, 400 intervals."""
    problem = weighted(row_of(0.15).weight, F1MAX, walk().dense(20))
    function, corner = exact_model(problem).function, np.full(4, CORNER_M)

    def f(x: np.ndarray) -> float:
        return -float(function(x, problem.p)[0])

    shifts = dict(zip(problem.names, STEP_M * np.eye(4), strict=True))
    return {name: (f(corner - shift) - f(corner)) / STEP_M for name, shift in shifts.items()}


def _from_corner() -> Run:
    """Where IPOPT ends that starts in the corner."""
    solution = nlp_gait.solve(weighted(0.15, F1MAX), starts=1, x0=[CORNER_M] * 4)
    return {"f": solution.objective, "x": list(solution.x.values())}


def _hip_miss(distance: float) -> float:
    """Distance between the hip and where the angles of the printed (2) put it, for a vertical leg of that length [m].

    (2) takes theta_B, the complement of the angle at the ankle, from an arccosine that is never negative; below
    sqrt(d1^2 - d2^2) that angle exceeds a right one.
    """
    robot = point_mass_biped()
    d1, d2 = robot.thigh_m, robot.shank_m
    theta_a = math.acos((d1**2 + d2**2 - distance**2) / (2 * d1 * d2))
    ankle = math.pi / 2 - math.acos(d1 * math.sin(theta_a) / distance)
    thigh = ankle - (math.pi - theta_a)
    along = d2 * math.sin(ankle) + d1 * math.sin(thigh)
    up = d2 * math.cos(ankle) + d1 * math.cos(thigh)
    return math.hypot(along, up - distance)
