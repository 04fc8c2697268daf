"""Solvers over many problems at all budgets: probability of being best, area over the convergence curve, anytime dominance.

A problem's budget is the largest number of evaluations that a run with a history took; gradient methods have their end alone.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from compare.analysis.comparison import Comparison, SolverRuns, index_solvers
from compare.analysis.record_statistics import ECDF_TARGETS, TARGETS, Curve
from nlp_gait.formulation import Array

EQUIVALENT = 1e-3  # medians of gaps that differ by no more count as equally good
SHARES = (0.01, 0.1, 1.0)  # of the budget, at which gaps are given
GRID = np.geomspace(0.01, 1.0, 41)  # shares of the budget at which solvers are compared for dominance
PRIOR, SWEEPS, WARMING_UP, SEED = 1.0, 4000, 500, 0  # of the Gibbs sampler


@dataclass(frozen=True, kw_only=True)
class AnytimeScore:
    """A solver over the problems on which all solvers ran."""

    solver: str
    best: float  #: probability of being best on a further problem, posterior mean
    interval: tuple[float, float]  #: of it, 95 %
    area: float  #: over the convergence curve, from 0 (never within 100 % of the best known) to 1 (within 1e-6 at once)
    gaps: tuple[float, ...]  #: medians over problems of the median gap over runs, at ``SHARES`` of the budget
    costs: tuple[
        float, ...
    ]  #: medians over problems of the expected running time to each of ``TARGETS``; may be infinite
    dominates: int  #: pairs of problem and other solver that is nowhere better and somewhere worse, by median gap
    dominated: int  #: pairs of problem and other solver that dominates this one


def score_anytime(comparisons: Sequence[Comparison]) -> list[AnytimeScore]:
    """Score the solvers that ran on all problems and whose evaluations are known, the most probably best first."""
    found, shared = index_solvers(comparisons)
    names = [name for name in shared if all(solvers[name].has_costs("evaluations") for solvers in found)]
    if not names:
        return []
    budgets = [compute_budget(comparison) for comparison in comparisons]
    tables = [
        np.array([_compute_median_gaps(s[name], budget) for name in names])
        for s, budget in zip(found, budgets, strict=True)
    ]
    finals = [[c.gap(s[name].median_cost) for name in names] for c, s in zip(comparisons, found, strict=True)]
    shares = sample_best(np.nan_to_num(finals, nan=math.inf, posinf=math.inf))
    low, high = np.quantile(shares, (0.025, 0.975), axis=0)
    worse = np.array([(table[:, None] <= table).all(axis=2) & (table[:, None] < table).any(axis=2) for table in tables])
    at = [int(np.argmin(np.abs(GRID - share))) for share in SHARES]
    scores = [
        AnytimeScore(
            solver=name,
            best=float(shares[:, k].mean()),
            interval=(float(low[k]), float(high[k])),
            area=float(
                np.mean([compute_area(c, b) for s, b in zip(found, budgets, strict=True) for c in s[name].curves])
            ),
            gaps=tuple(float(np.median([table[k, column] for table in tables])) for column in at),
            costs=tuple(float(np.median([s[name].expected_cost(target) for s in found])) for target in TARGETS),
            dominates=int(worse[:, k].sum()),
            dominated=int(worse[:, :, k].sum()),
        )
        for k, name in enumerate(names)
    ]
    return sorted(scores, key=lambda score: -score.best)


def rank_at_budgets(comparisons: Sequence[Comparison]) -> dict[str, Array]:
    """Return the mean rank of each solver that ran on all problems, by median gap at each of ``SHARES``; equals share a rank."""
    from scipy.stats import rankdata

    found, names = index_solvers(comparisons)
    ranks = [
        rankdata([[read_median_gap(s[name], share * compute_budget(c)) for name in names] for share in SHARES], axis=1)
        for c, s in zip(comparisons, found, strict=True)
    ]
    return dict(zip(names, np.mean(ranks, axis=0).T, strict=True))


def read_median_gap(solver: SolverRuns, cost: float) -> float:
    """Return the median gap of a solver's runs after some evaluations, infinite where half of them have nothing feasible."""
    return float(np.median([read_gap(curve, cost) for curve in solver.curves]))


def compute_budget(comparison: Comparison) -> float:
    """Return the largest number of evaluations of a run with a history; of all runs if none has one."""
    curves = [curve for solver in comparison.solvers for curve in solver.curves if len(curve.gap)]
    return max(curve.total_cost() for curve in [c for c in curves if len(c.gap) > 1] or curves)


def _compute_median_gaps(solver: SolverRuns, budget: float) -> Array:
    """Return the median gap over the runs at each share of the budget."""
    return np.array([read_median_gap(solver, share * budget) for share in GRID])


def read_gap(curve: Curve, cost: float) -> float:
    """Return the gap of a run after some evaluations, not below that of the last target; infinite if nothing is feasible."""
    k = int(np.searchsorted(curve.evaluations, cost * (1 + 1e-9), side="right"))
    gap = float(curve.gap[k - 1]) if k else math.inf
    return math.inf if math.isnan(gap) else max(gap, ECDF_TARGETS[-1])


def compute_area(curve: Curve, budget: float) -> float:
    """Return the area over a run's convergence curve: mean over the budget of log(gap), from 100 % (0) to 1e-6 (1), clipped.

    Source:
        Van Stein, Bäck (2024), LLaMEA, section 4 (AOCC); here of relative gaps, and of the targets of the distributions.
    """
    steps = np.append(np.clip(curve.evaluations, 0.0, budget), budget)
    logs = np.log10(np.clip(np.nan_to_num(curve.gap, nan=math.inf), ECDF_TARGETS[-1], ECDF_TARGETS[0]))
    return float(np.sum(np.diff(steps) * logs / math.log10(ECDF_TARGETS[-1])) / budget)


def sample_best(gaps: Array) -> Array:
    """Return (draws, K) probabilities of being best: draws of Plackett-Luce weights, by gaps (problems, K) of K solvers.

    Gaps that differ by at most ``EQUIVALENT`` from the least of their group are equal; their order is drawn again in each sweep.
    The weights have gamma priors of shape and rate 1, so that two solvers have the prior of a uniform probability.

    Source:
        Caron, Doucet (2012), Efficient Bayesian inference for generalized Bradley-Terry models, section 4 (Gibbs sampler);
        Calvo, Shir, Ceberio, Doerr, Wang, Bäck, Lozano (2019), Bayesian performance analysis for black-box optimization
        benchmarking (probability of being best).
    """
    rng, groups = np.random.default_rng(SEED), np.array([_group(row) for row in gaps])
    problems, solvers = groups.shape
    weights, draws = np.ones(solvers), []
    for sweep in range(WARMING_UP + SWEEPS):
        order = np.lexsort((rng.random(groups.shape), groups), axis=1)  # best first, equals in random order
        remaining = np.cumsum(weights[order][:, ::-1], axis=1)[:, ::-1][:, :-1]  # weight of those not yet chosen
        waiting = np.cumsum(
            rng.exponential(1.0 / remaining), axis=1
        )  # until each was chosen, summed over earlier choices
        rates, counts = np.full(solvers, PRIOR), np.full(solvers, PRIOR)
        np.add.at(rates, order, np.hstack([waiting, waiting[:, -1:]]))
        np.add.at(counts, order[:, :-1], 1.0)
        weights = rng.gamma(counts, 1.0 / rates)
        if sweep >= WARMING_UP:
            draws.append(weights / weights.sum())
    return np.array(draws)


def _group(gaps: Array) -> Array:
    """Return the number of the group of equivalent gaps that each belongs to, 0 for the least."""
    groups, begin, number = np.zeros(len(gaps), dtype=int), -math.inf, -1
    for k in np.argsort(gaps, kind="stable"):
        if gaps[k] > begin + EQUIVALENT:
            begin, number = gaps[k], number + 1
        groups[k] = number
    return groups
