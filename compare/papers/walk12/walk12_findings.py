"""Findings of the reproduced 12-joint walk, and errata: the effect of each misprint or simplification, as a number."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cache, cached_property

import casadi as ca
import numpy as np
from casadi import SX

from compare.papers.paper_runs import Runs, choose_best, compute_range
from compare.papers.walk12.walk12_paper import F1MAX, F2MAX, TABLE_3
from compare.papers.walk12.walk12_runs import (
    CORNER_M,
    PAPER,
    PathPoint,
    Walk12Effort,
    WalkedGait,
    compute_f1,
    find_f1max,
    load_walk12,
    title_table_3,
)
from compare.study.record import RunRecord
from compare.study.task import IPOPT
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.formulation import Array
from nlp_gait.gaits.walk12.point_mass_biped import PointMassBiped, load_point_mass_biped
from nlp_gait.gaits.walk12.walk12_model import GRAVITY, compute_legs, compute_mass_motion, list_masses
from nlp_gait.gaits.walk12.walk12_problem import make_rule
from nlp_gait.gaits.walk12.walk12_steps import JOINTS, compute_steps
from nlp_gait.symbolic.nonsmooth import Exact

STEP_M = 1e-4  # of a difference quotient
ROD_SHARE = 0.1  # of the actuators' mass: section 6 gives 5 to 10 %


@dataclass(frozen=True, kw_only=True)
class Walk12Findings:
    """All results of the reproduction."""

    effort: Walk12Effort  # what was computed
    runs: Runs  # by title of the problem and solver
    weighted: Sequence[PathPoint]  # optima of the weighted sum over lambda
    front: Sequence[PathPoint]  # largest f1 for each step length
    printed_step: Mapping[str, float]  # optimal f with the paper's integration step, by lambda
    walks: Sequence[WalkedGait]  # in the engine; none without it
    f1_of_table_3: Sequence[float] = field(default_factory=lambda: [compute_f1(row) for row in TABLE_3])

    def records(self, label: str, weight: float, solver: str) -> Sequence[RunRecord]:
        """Return the runs of a solver at a lambda under a normalisation."""
        return self.runs[title_table_3(label, weight), solver]

    def optimum(self, label: str, weight: float) -> RunRecord:
        """Return IPOPT's best start at a lambda under a normalisation."""
        return choose_best(self.records(label, weight, IPOPT))

    @cached_property
    def own_f1max(self) -> float:
        """The model's largest f1 [1/(m^2 s)]."""
        return find_f1max(self.runs, title_table_3(PAPER, 1.0))

    @cached_property
    def stable(self) -> Sequence[StableShare]:
        """When each gait of Table III satisfies (8)."""
        return [compute_stable_share(row.x) for row in TABLE_3]

    @cached_property
    def f1_changes(self) -> Mapping[str, tuple[float, float]]:
        """Least and greatest change of f1 over Table III [%] by what is read in another way."""
        known = [compute_f1_variants(row.x) for row in TABLE_3]
        return {
            name: compute_range(100 * (f1[name] / f1["ours"] - 1) for f1 in known)
            for name in known[0]
            if name != "ours"
        }

    def f_of_printed_gaits(self, label: str) -> list[float]:
        """Return f of the printed gaits in the model under a normalisation."""
        f1max = F1MAX if label == PAPER else self.own_f1max
        known = zip(TABLE_3, self.f1_of_table_3, strict=True)
        return [row.weight * f1 / f1max + (1 - row.weight) * row.x[0] / F2MAX for row, f1 in known]


@dataclass(frozen=True, kw_only=True)
class StableShare:
    """Share of a step in which (8) is satisfied, and the first and the last such time [s]."""

    share: float
    first_s: float
    last_s: float


def compute_stable_share(x: tuple[float, ...]) -> StableShare:
    """Return when a gait is statically stable."""
    robot = load_point_mass_biped()
    arrays = compute_steps(robot, np.array(x), steps=1, intervals=1000).arrays
    zmp_x, zmp_y = arrays["zmp_foot"].T
    inside = (-robot.foot_back_m <= zmp_x) & (zmp_x <= robot.foot_front_m) & (np.abs(zmp_y) <= robot.foot_width_m / 2)
    times = arrays["t"][inside]
    return StableShare(share=float(inside.mean()), first_s=float(times.min()), last_s=float(times.max()))


def compute_f1_variants(x: tuple[float, ...]) -> dict[str, float]:
    """Return f1 [1/(m^2 s)] at T = 1 s by (14), as in the problem and with what the paper leaves open read in another way.

    "ground": heights of the masses from the ground, with an ankle at the height L of the foot's mass above it; "g": 9.8 m/s^2;
    "foot": the foot's mass stays at the height L above its ankle; "moments": (13) with M of uniform rods for thighs and shanks,
    a tenth of the actuators' mass in all.
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
            turning += ROD_SHARE / 4 * m.sum() / 12 * np.cross(rod[:, :, 0], rod_a[:, :, 0])  # I u x u''
    return {
        "ours": f1(P, A),
        "ground": f1(P, A, base=up),
        "g": f1(P, A, g=9.8),
        "foot": f1(P_foot, A_foot),
        "moments": f1(P, A, moments=turning[:, [1, 0]] * [-1.0, 1.0]),
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


def compute_hip_miss() -> float:
    """Return the distance between the hip and where the angles of the printed (2) put it, for a vertical leg in the corner [m].

    (2) takes theta_B, the complement of the angle at the ankle, from an arccosine that is never negative; below
    sqrt(d1^2 - d2^2) that angle exceeds a right one.
    """
    robot = load_point_mass_biped()
    d1, d2, distance = robot.thigh_m, robot.shank_m, robot.leg_m - 2 * CORNER_M
    theta_a = math.acos((d1**2 + d2**2 - distance**2) / (2 * d1 * d2))
    ankle = math.pi / 2 - math.acos(d1 * math.sin(theta_a) / distance)
    thigh = ankle - (math.pi - theta_a)
    along = d2 * math.sin(ankle) + d1 * math.sin(thigh)
    up = d2 * math.cos(ankle) + d1 * math.cos(thigh)
    return math.hypot(along, up - distance)


def compute_straightest_knee(x: Sequence[float]) -> float:
    """Return the least angle of a knee in a step [rad]."""
    arrays = compute_steps(load_point_mass_biped(), np.array(x), steps=1, intervals=1000).arrays
    knees = [JOINTS.index(name) for name in ("theta_3", "theta_10")]
    return float(arrays["q"][:, knees].min())
