"""Median gaps of solvers after a part of the budget.

A problem's budget is the largest number of evaluations that a run with a history took; gradient methods have their end alone.
"""

import math
from collections.abc import Sequence

import numpy as np

from compare.analysis.comparison import Comparison, SolverRuns, index_solvers
from compare.analysis.record_statistics import ECDF_TARGETS, Curve
from nlp_gait.formulation import Array

SHARES = (0.01, 0.1, 1.0)  # of the budget, at which gaps are given


def compute_gaps(comparisons: Sequence[Comparison]) -> dict[str, Array]:
    """Return the median gaps (problems, ``SHARES``) of each solver that ran on all problems."""
    found, names = index_solvers(comparisons)
    budgets = [compute_budget(comparison) for comparison in comparisons]
    return {
        name: np.array(
            [
                [read_median_gap(solvers[name], share * budget) for share in SHARES]
                for solvers, budget in zip(found, budgets, strict=True)
            ]
        )
        for name in names
    }


def rank_at_budgets(comparisons: Sequence[Comparison]) -> dict[str, Array]:
    """Return the mean rank of each solver that ran on all problems, by median gap at each of ``SHARES``; equals share a rank."""
    from scipy.stats import rankdata

    gaps = compute_gaps(comparisons)
    ranks = rankdata(list(gaps.values()), axis=0).mean(axis=1)
    return dict(zip(gaps, ranks, strict=True))


def read_median_gap(solver: SolverRuns, cost: float) -> float:
    """Return the median gap of a solver's runs after some evaluations, infinite where half of them have nothing feasible."""
    return float(np.median([read_gap(curve, cost) for curve in solver.curves]))


def compute_budget(comparison: Comparison) -> float:
    """Return the largest number of evaluations of a run with a history; of all runs if none has one."""
    curves = [curve for solver in comparison.solvers for curve in solver.curves if len(curve.gap)]
    return max(curve.total_cost() for curve in [c for c in curves if len(c.gap) > 1] or curves)


def read_gap(curve: Curve, cost: float) -> float:
    """Return the gap of a run after some evaluations, not below that of the last target; infinite if nothing is feasible."""
    k = int(np.searchsorted(curve.evaluations, cost * (1 + 1e-9), side="right"))
    gap = float(curve.gap[k - 1]) if k else math.inf
    return math.inf if math.isnan(gap) else max(gap, ECDF_TARGETS[-1])
