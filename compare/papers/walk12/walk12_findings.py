"""Findings of the reproduced 12-joint walk, and errata: the effect of each misprint or simplification, as a number."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import product
from typing import Any, get_args

import numpy as np

from compare.papers.paper_runs import Runs, choose_best, list_objectives
from compare.papers.walk12 import walk12_runs
from compare.papers.walk12.walk12_paper import F1MAX, TABLE_3, TABLE_4_DIGITS, PaperRow
from compare.papers.walk12.walk12_runs import PAPER, PathPoint, compute_f, compute_f1, title_table_3
from compare.study.record import RunRecord
from compare.study.task import IPOPT
from nlp_gait.formulation import Array
from nlp_gait.gaits.walk12.walk12_model import Zmp, load_point_mass_biped
from nlp_gait.gaits.walk12.walk12_steps import JOINTS, compute_steps

KNEES = ("theta_3", "theta_10")


@dataclass(frozen=True, kw_only=True)
class Walk12Findings:
    """All results of the reproduction."""

    runs: Runs  # by title of the problem and solver
    weighted: Sequence[PathPoint]  # optima of the weighted sum over lambda
    front: Sequence[PathPoint]  # largest f1 for each step length
    printed_step: Mapping[str, float]  # optimal f with the paper's integration step, by lambda

    def best(self, title: str, solver: str = IPOPT) -> RunRecord:
        """Return IPOPT's best start on a problem, or a search's run of median f, of which infeasible runs are the least."""
        runs = self.runs[title, solver]
        if solver == IPOPT:
            return choose_best(runs)
        return runs[int(np.argsort(list_f(runs), kind="stable")[(len(runs) - 1) // 2])]

    def records(self, label: str, weight: float, solver: str) -> Sequence[RunRecord]:
        """Return the runs of a solver at a lambda under a normalisation."""
        return self.runs[title_table_3(label, weight), solver]

    def optimum(self, label: str, weight: float) -> RunRecord:
        """Return IPOPT's best start at a lambda under a normalisation."""
        return self.best(title_table_3(label, weight))

    @cached_property
    def own_f1max(self) -> float:
        """The model's largest f1 [1/(m^2 s)]."""
        return walk12_runs.find_f1max(self.runs, title_table_3(PAPER, 1.0))

    @cached_property
    def stable(self) -> Sequence["StableShare"]:
        """When each gait of Table III satisfies (8)."""
        return [compute_stable_share(row.x) for row in TABLE_3]

    def f1_by(self, zmp: Zmp = "exact") -> Sequence[float]:
        """Return f1 of the printed gaits of Table III by a reading of the ZMP [1/(m^2 s)]."""
        return [compute_f1(row, zmp=zmp) for row in TABLE_3]

    def describe_f1_change(self, zmp: Zmp, by: Zmp = "exact") -> str:
        """Return the least and greatest change of f1 of the printed gaits from a reading of the ZMP to another, as words."""
        changes = 100 * (np.array(self.f1_by(zmp)) / np.array(self.f1_by(by)) - 1)
        return f"{changes.min():+z.2f} % to {changes.max():+z.2f} %"

    def f_of_printed_gaits(self, label: str, zmp: Zmp = "exact") -> list[float]:
        """Return f of the printed gaits in the model under a normalisation."""
        f1max = F1MAX if label == PAPER else self.own_f1max
        return [compute_f(row, f1max, zmp=zmp) for row in TABLE_3]

    def list_optima(self, zmp: Zmp) -> list[float]:
        """Return the optimal f by a reading of the ZMP at each lambda where it is solved, under the paper's f1max."""
        if zmp == "exact":
            return list_objectives(self.optimum(PAPER, row.weight) for row in TABLE_3)
        return list_objectives(self.best(f"{zmp}-{weight:g}") for weight in walk12_runs.READINGS[zmp])


@dataclass(frozen=True, kw_only=True)
class StableShare:
    """Share of a step in which (8) is satisfied, and the first and the last such time [s]."""

    share: float
    first_s: float
    last_s: float


def compute_stable_share(x: tuple[float, ...]) -> StableShare:
    """Return when a gait is statically stable."""
    robot = load_point_mass_biped()
    arrays = follow(x, steps=1, intervals=1000)
    zmp_x, zmp_y = arrays["zmp_foot"].T
    inside = (-robot.foot_back_m <= zmp_x) & (zmp_x <= robot.foot_front_m) & (np.abs(zmp_y) <= robot.foot_width_m / 2)
    times = arrays["t"][inside]
    return StableShare(share=float(inside.mean()), first_s=float(times.min()), last_s=float(times.max()))


def follow(x: Sequence[float], **options: Any) -> Mapping[str, Array]:
    """Return the time histories of a gait, see ``compute_steps``."""
    return compute_steps(load_point_mass_biped(), np.array(x), **options).arrays


def list_f(records: Sequence[RunRecord]) -> list[float]:
    """Return f at the end of each run; minus infinity without a feasible gait."""
    return [r.verdict.objective if r.verdict.feasible else -math.inf for r in records]


def list_rounded(row: PaperRow) -> list[PaperRow]:
    """Return a row of Table IV as printed, and with half the last digit more or less of each variable, in all combinations."""
    corners = [(0, 0, 0, 0), *product((-1, 1), repeat=4)]
    shifted = (np.array(row.x) + np.array(signs) * TABLE_4_DIGITS for signs in corners)
    return [replace(row, x=tuple(np.maximum(x, 1e-3).tolist())) for x in shifted]


def compute_zmp_error(x: tuple[float, ...], zmp: Zmp) -> float:
    """Return the largest distance over a step between the ZMP by a reading and the point without moment [m]."""
    points = [follow(x, steps=1, intervals=400, zmp=reading)["zmp_foot"] for reading in (zmp, get_args(Zmp)[-1])]
    return float(np.linalg.norm(points[0] - points[1], axis=1).max())


def compute_knees(x: Sequence[float], intervals: int = 1000) -> Array:
    """Return the angles of both knees over a step (m, 2) [rad]."""
    return follow(x, steps=1, intervals=intervals)["q"][:, [JOINTS.index(name) for name in KNEES]]
