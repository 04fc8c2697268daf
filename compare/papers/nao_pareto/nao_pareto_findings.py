"""Findings of power against stability: all runs, measured against the true front."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from compare.papers.nao_pareto.nao_pareto_runs import Case, ParetoEffort, Run
from compare.questions.pareto.competing import CompetingObjective
from compare.questions.pareto.front import Bends, FrontPoint, find_bends, select_front
from compare.questions.pareto.pareto_front import SEARCH_NAMES
from compare.questions.pareto.searches import REFERENCE, Challenge, Scale
from metaheuristics.array import Array
from nlp_gait.formulation import GaitProblem

EVEN_POINTS = 200  # of the true front, which distances are measured from
NAMES = {**SEARCH_NAMES, "CMOEAD": "CMOEA/D"}  # as the paper writes them


@dataclass(frozen=True, kw_only=True, eq=False)
class Measures:
    """Measures of R runs of one search with one budget at L looks."""

    evaluations: Array  # (L,) before each look
    # (R, L) share of the true front's, both ranges being 1 and the reference 1.1; 0 without a feasible point
    hypervolume: Array
    # (R, L) mean distance from a point of the true front, evenly along it, to the nearest one found; infinite without one
    igd: Array
    feasible: Array  # (R,) share of the evaluated points that are feasible
    first_feasible: Array  # (R,) number of the first of these; infinite without one
    time_s: Array  # (R,) processor time [s]
    objective_time_s: Array  # (R,) of it in the objectives [s]

    def until(self, share: float) -> Array:
        """Return (R,) evaluations at the first look with at least a share of the hypervolume; infinite if never."""
        reached = self.hypervolume >= share
        at = np.where(reached.any(axis=1), self.evaluations[reached.argmax(axis=1)], np.inf)
        return np.asarray(at)

    def find_look(self, evaluations: float) -> int:
        """Return the number of the last look within some evaluations, or of the first look."""
        return max(0, int(np.count_nonzero(self.evaluations <= evaluations)) - 1)


@dataclass(frozen=True, kw_only=True, eq=False)
class PhaseFindings:
    """Results of one support phase."""

    problem: GaitProblem  # the phase, without its constraint on the criterion
    criterion: CompetingObjective  # the second objective
    first_front: Sequence[FrontPoint]  # of the gradient method alone, whose ranges count as 1 in the searches
    answer: Challenge  # the front after solving from the searches' best points
    runs: Mapping[Case, Sequence[Run]]

    @property
    def front(self) -> tuple[FrontPoint, ...]:
        """The best known front."""
        return self.answer.front

    @cached_property
    def bends(self) -> Bends:
        """Knees of the front."""
        return find_bends(self.front)

    @cached_property
    def budgets(self) -> tuple[int, ...]:
        """Budgets of the runs."""
        return tuple(dict.fromkeys(budget for _, budget in self.runs))

    @cached_property
    def measures(self) -> dict[Case, Measures]:
        """Measures by search and budget."""
        return {case: self._measure(runs) for case, runs in self.runs.items()}

    def points(self, algorithm: str, budget: int) -> tuple[Array, Array]:
        """Return criterion and power [W] of all points at the ends of all runs."""
        scale = Scale(self.first_front)
        return scale.undo(np.concatenate([run[-1].F for run in self.runs[algorithm, budget]]))

    def _measure(self, runs: Sequence[Run]) -> Measures:
        from pymoo.indicators.hv import HV
        from pymoo.indicators.igd import IGD

        first, scale = Scale(self.first_front), Scale(self.front)
        values, powers = (np.array([getattr(p, key) for p in self.front]) for key in ("value", "power_W"))
        true = scale(values, powers)
        hypervolume, distance = HV(ref_point=np.full(2, REFERENCE)), IGD(spread_evenly(true))
        whole = float(hypervolume(true))
        fronts = [[scale(*first.undo(look.F)) for look in run] for run in runs]
        ends = [run[-1] for run in runs]
        return Measures(
            evaluations=np.array([look.evaluations for look in runs[0]], dtype=float),
            hypervolume=np.array([[float(hypervolume(F)) / whole if len(F) else 0.0 for F in row] for row in fronts]),
            igd=np.array([[float(distance(F)) if len(F) else math.inf for F in row] for row in fronts]),
            feasible=np.array([end.feasible / end.evaluations for end in ends]),
            first_feasible=np.array([math.inf if e.first_feasible is None else e.first_feasible for e in ends]),
            time_s=np.array([end.time_s for end in ends]),
            objective_time_s=np.array([end.objective_time_s for end in ends]),
        )


@dataclass(frozen=True, kw_only=True, eq=False)
class ParetoFindings:
    """All results."""

    phases: tuple[PhaseFindings, ...]  # single and double support
    effort: ParetoEffort  # what was computed


def spread_evenly(front: Array) -> Array:
    """Return (EVEN_POINTS, 2) points evenly along the lines between a front's (k, 2), which crowd near the searches' best."""
    along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(front, axis=0).T))])
    places = np.linspace(0.0, along[-1], EVEN_POINTS)
    return np.column_stack([np.interp(places, along, column) for column in front.T])


def collect_points(front: Sequence[FrontPoint], runs: Iterable[Run]) -> list[FrontPoint]:
    """Return the points of all runs that no other point dominates."""
    scale = Scale(front)
    found = []
    for run in runs:
        values, powers = scale.undo(run[-1].F)
        for value, power, x in zip(values.tolist(), powers.tolist(), run[-1].X.tolist(), strict=True):
            found.append(FrontPoint(demanded=value, value=value, power_W=power, violation=0.0, x=tuple(x)))
    return select_front(found)
