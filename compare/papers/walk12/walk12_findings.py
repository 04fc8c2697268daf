"""Findings of the reproduced 12-joint walk, and errata: the effect of each misprint or simplification, as a number."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from compare.papers.paper_runs import Runs, choose_best
from compare.papers.walk12.walk12_paper import F1MAX, F2MAX, TABLE_3
from compare.papers.walk12.walk12_runs import (
    CORNER_M,
    PAPER,
    PathPoint,
    Walk12Effort,
    compute_f1,
    find_f1max,
    title_table_3,
)
from compare.papers.walk12.walk12_walks import WalkedGait
from compare.study.record import RunRecord
from compare.study.task import IPOPT
from nlp_gait.gaits.walk12.point_mass_biped import load_point_mass_biped
from nlp_gait.gaits.walk12.walk12_steps import JOINTS, compute_steps


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
