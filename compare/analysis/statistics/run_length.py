"""The cost at which a run reaches a target, and distributions over runs, targets and problems."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from compare.analysis.best_known import is_zero, relative_gap
from compare.study.record import RunRecord
from nlp_gait.formulation import Array, Objective
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE

# Relative distances from the best known objective for which reports give the expected running time.
TARGETS = (1e-2, 1e-3, 1e-4, 1e-6)
# Targets of the distribution: from 100 % above the best known to 1e-6, evenly in logarithm.
ECDF_TARGETS: tuple[float, ...] = tuple(float(target) for target in np.logspace(0, -6, 31))


@dataclass(frozen=True, kw_only=True)
class Weighting:
    """Weight of each kind of call, in evaluations of objective and constraints at one point.

    The defaults count derivatives like forward differences, objective and constraints separately: n + 1 for a first
    derivative, (n + 1)(n + 2) / 2 for the second. This never favours gradient methods.
    """

    f: float = 1.0  #: of the objective (in searches with all constraints)
    g: float = 1.0  #: of the constraints alone
    gradient: float | None = None  #: of the objective's gradient; None for n + 1
    jacobian: float | None = None  #: of the constraints' Jacobian; None for n + 1
    hessian: float | None = None  #: of the Lagrangian's Hessian; None for (n + 1)(n + 2) / 2

    def of_kind(self, n: int) -> dict[str, float]:
        """Return the weight of each kind of call for n variables."""
        second = (n + 1) * (n + 2) / 2
        defaults = {"f": 1.0, "g": 1.0, "gradient": n + 1.0, "jacobian": n + 1.0, "hessian": second}
        return {
            kind: default if getattr(self, kind) is None else getattr(self, kind) for kind, default in defaults.items()
        }

    def equivalent(self, calls: Mapping[str, int], n: int) -> float:
        """Return the equivalent evaluations of counted calls."""
        weights = self.of_kind(n)
        return float(sum(weights[kind] * count for kind, count in calls.items()))


@dataclass(frozen=True, kw_only=True, eq=False)
class Curve:
    """Best so far of one run against what it cost.

    A gradient method has one entry, its end, as it may be infeasible earlier.
    """

    evaluations: Array  #: (G,) equivalent evaluations; NaN where they are unknown, as of some imported results
    seconds: Array  #: (G,) wall time of the solve; likewise
    gap: Array  #: (G,) relative distance from the reference, infinite while nothing was feasible; negative if better

    def cost_to_reach(self, target: float, axis: str = "evaluations") -> float:
        """Return the cost at which the gap is first at most the target; infinite if never."""
        hit = np.flatnonzero(self.gap <= target)
        return float(getattr(self, axis)[hit[0]]) if hit.size else math.inf

    def total_cost(self, axis: str = "evaluations") -> float:
        """Return the cost of the whole run; 0 if it failed before its first evaluation."""
        costs = getattr(self, axis)
        return float(costs[-1]) if len(costs) else 0.0


def make_curve(record: RunRecord, objective: Objective, reference: float, weighting: Weighting) -> Curve:
    """Return the best so far of a run, with gaps from a reference objective; its end alone if its evaluations are unknown."""
    if not record.evaluations:
        gap = relative_gap(record.verdict.objective, reference, objective) if record.verdict.feasible else math.inf
        return Curve(evaluations=np.array([math.nan]), seconds=np.array([record.time_s.solve]), gap=np.array([gap]))
    evaluations = np.array(record.history.evaluations, dtype=float)
    if evaluations.size:  # derivatives are counted at the end
        evaluations[-1] = max(evaluations[-1], weighting.equivalent(record.evaluations, len(record.x)))
    values = np.array([math.nan if value is None else value for value in record.history.objective], dtype=float)
    if not record.verdict.feasible:
        values[:] = math.nan  # an infeasible result has reached no target
    gaps = np.array([relative_gap(value, reference, objective) for value in values])
    return Curve(evaluations=evaluations, seconds=np.array(record.time_s.history, dtype=float), gap=gaps)


def tie(samples: Sequence[Sequence[float]], reference: float) -> list[list[float]]:
    """Return samples of costs in which those that differ by at most the judge's tolerance are equal.

    Every cost becomes the least one of its group; a group begins at the least cost that belongs to no earlier one. Infinite costs
    stay. The tolerance is relative to the reference, absolute if that is near zero.
    """
    tolerance = FEASIBILITY_TOLERANCE * (1.0 if is_zero(reference) or math.isnan(reference) else abs(reference))
    least: dict[float, float] = {}
    begin = -math.inf
    for cost in sorted({cost for sample in samples for cost in sample}):
        begin = begin if cost - begin <= tolerance else cost
        least[cost] = begin
    return [[least[cost] for cost in sample] for sample in samples]


def find_best_known(records: Sequence[RunRecord], objective: Objective) -> float:
    """Return the best objective of the feasible records; NaN without any."""
    costs = [objective.sign * r.verdict.objective for r in records if r.verdict.feasible]
    return objective.sign * min(costs) if costs else math.nan


def expected_running_time(reached: Sequence[float], totals: Sequence[float]) -> float:
    """Return the cost of all runs until the target or their end, divided by the number that reached it.

    ``reached`` (R,) is the cost at which each run reached the target, infinite if never; ``totals`` (R,) that of each whole run.

    Source:
        Hansen, Auger, Ros, Mersmann, Tusar, Brockhoff (2021), COCO: a platform for comparing continuous optimizers in a
        black-box setting, section 4 (ERT, there also aRT).
    """
    hits = [cost for cost in reached if math.isfinite(cost)]
    if not hits:
        return math.inf
    spent = sum(cost if math.isfinite(cost) else total for cost, total in zip(reached, totals, strict=True))
    return spent / len(hits)


def ecdf(costs: Array) -> tuple[Array, Array]:
    """Return (K,) costs, ascending, at which the share of solved pairs of run and target rises, and (K,) the shares.

    ``costs`` (pairs,) are those at which each pair was solved, infinite if never.

    Source:
        Hansen et al. (2021), COCO, section 4 (runtime distributions).
    """
    solved = np.sort(costs[np.isfinite(costs)])
    at, counts = np.unique(solved, return_counts=True)
    return at, np.cumsum(counts) / max(len(costs), 1)


def performance_profile(costs: Mapping[str, Sequence[float]]) -> dict[str, tuple[Array, Array]]:
    """Return ``ecdf`` of each solver's costs as factors of the cheapest solver's.

    ``costs`` by solver are those of each instance (I,), in the same order; infinite if not solved. Instances that no solver
    solves count as unsolved for all.

    Source:
        Dolan, More (2002), Benchmarking optimization software with performance profiles.
    """
    table = np.array([list(row) for row in costs.values()], dtype=float)
    cheapest = table.min(axis=0)
    known = np.isfinite(cheapest)
    ratios = np.full_like(table, np.inf)
    ratios[:, known] = table[:, known] / cheapest[known]
    return {solver: ecdf(row) for solver, row in zip(costs, ratios, strict=True)}


def compute_band(costs: Sequence[Array], gaps: Sequence[Array], grid: Array) -> tuple[Array, Array, Array]:
    """Return the least, median and greatest gap of all runs at each cost of a grid, three arrays (K,).

    A run has ascending costs (G,) and its best gaps so far (G,), infinite while nothing was feasible; the last one stays.
    """
    rows = np.full((len(costs), len(grid)), np.inf)
    for row, cost, gap in zip(rows, costs, gaps, strict=True):
        position = np.searchsorted(cost, grid, side="right") - 1
        row[position >= 0] = gap[position[position >= 0]]
    # The lower one of the two middle runs, so that the median is a run and never half an infinity.
    return rows.min(axis=0), np.sort(rows, axis=0)[(len(rows) - 1) // 2], rows.max(axis=0)
