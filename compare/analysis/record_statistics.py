"""Statistics of records, pure functions with their sources: costs to targets and their distributions; tests of two solvers.

Tests take costs to be minimised, infinite where a run found nothing feasible.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, count

import numpy as np

from compare.analysis.units import compute_gap, is_zero
from compare.study.record import RunRecord, find_best
from nlp_gait.formulation import Array, Objective
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE

# Relative distances from the best known objective for which reports give the expected running time.
TARGETS = (1e-2, 1e-3, 1e-4, 1e-6)
# Targets of the distribution: from 100 % above the best known to 1e-6, evenly in logarithm.
ECDF_TARGETS: tuple[float, ...] = tuple(float(target) for target in np.logspace(0, -6, 31))
SIGNIFICANT = 0.05  # p-values below it are a difference


def list_weights(n: int) -> dict[str, float]:
    """Return the weight of each kind of call, in evaluations of objective and constraints at one point, for n variables.

    Derivatives count like forward differences, objective and constraints separately. This never favours gradient methods.
    """
    return {"f": 1.0, "g": 1.0, "gradient": n + 1.0, "jacobian": n + 1.0, "hessian": (n + 1) * (n + 2) / 2}


def count_equivalent(calls: Mapping[str, int], n: int) -> float:
    """Return the equivalent evaluations of counted calls for n variables."""
    weights = list_weights(n)
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


def make_curve(record: RunRecord, objective: Objective, reference: float) -> Curve:
    """Return the best so far of a run, with gaps from a reference objective; its end alone if its evaluations are unknown."""
    if not record.counts:
        gap = compute_gap(objective.sign * record.cost, reference, objective)
        return Curve(evaluations=np.array([math.nan]), seconds=np.array([record.time_s.solve]), gap=np.array([gap]))
    evaluations = np.array(record.history.evaluations, dtype=float)
    if evaluations.size:  # derivatives are counted at the end
        evaluations[-1] = max(evaluations[-1], count_equivalent(record.counts, len(record.x)))
    values = np.array([math.nan if value is None else value for value in record.history.objective], dtype=float)
    if not record.feasible:
        values[:] = math.nan  # an infeasible result has reached no target
    gaps = np.array([compute_gap(value, reference, objective) for value in values])
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


def find_best_known(records: Sequence[RunRecord]) -> float:
    """Return the best objective of the feasible records; NaN without any."""
    best = find_best(records)
    return math.nan if best is None else best.objective


def compute_running_time(reached: Sequence[float], totals: Sequence[float]) -> float:
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


def compute_ecdf(costs: Array) -> tuple[Array, Array]:
    """Return (K,) costs, ascending, at which the share of solved pairs of run and target rises, and (K,) the shares.

    ``costs`` (pairs,) are those at which each pair was solved, infinite if never.

    Source:
        Hansen et al. (2021), COCO, section 4 (runtime distributions).
    """
    solved = np.sort(costs[np.isfinite(costs)])
    steps, counts = np.unique(solved, return_counts=True)
    return steps, np.cumsum(counts) / max(len(costs), 1)


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


MOST_EXACT = 8  # values of the smaller sample


def compute_rank_sum(a: Sequence[float], b: Sequence[float]) -> float:
    """Two-sided p-value of Wilcoxon's rank-sum test (Mann and Whitney's U): neither sample tends to be smaller.

    Exact if one sample has 8 values or fewer and there are no ties, else normal with tie and continuity correction; 1 if
    all values are equal.

    Source:
        Mann, Whitney (1947), On a test of whether one of two random variables is stochastically larger than the other.
    """
    # SciPy's ``mannwhitneyu``, whose import takes longer than all other statistics of a study.
    pooled = np.concatenate([a, b])
    m, n, total = len(a), len(b), len(pooled)
    _, inverse, counts = np.unique(pooled, return_inverse=True, return_counts=True)
    if len(counts) == 1:
        return 1.0
    ranks = (np.cumsum(counts) - 0.5 * (counts - 1))[inverse]
    first = float(ranks[:m].sum()) - m * (m + 1) / 2
    u = max(first, m * n - first)
    if min(m, n) <= MOST_EXACT and (counts == 1).all():
        ways = _count_rank_sums(m, n)
        return min(2.0 * float(ways[int(u) :].sum() / ways.sum()), 1.0)
    ties = float(((counts**3) - counts).sum()) / (total * (total - 1))
    z = (u - m * n / 2 - 0.5) / math.sqrt(m * n / 12 * (total + 1 - ties))
    return min(math.erfc(z / math.sqrt(2.0)), 1.0)


def _count_rank_sums(m: int, n: int) -> Array:
    """Return (m n + 1,) the number of orders of m and n distinct values with each value of U."""
    ways = np.zeros(m * n + 1)
    ways[0] = 1.0
    for k in range(1, m + 1):  # the Gaussian binomial coefficient: times (1 - q^(n + k)), divided by (1 - q^k)
        ways[n + k :] -= ways[: max(len(ways) - n - k, 0)].copy()
        for place in range(k, len(ways)):
            ways[place] += ways[place - k]
    return ways


def correct_by_holm(p: Sequence[float]) -> Array:
    """P-values (T,) of a family of tests, adjusted so that rejecting below alpha keeps the family-wise error at alpha.

    Source:
        Holm (1979), A simple sequentially rejective multiple test procedure.
    """
    values = np.asarray(p, dtype=float)
    order = np.argsort(values, kind="stable")
    factors = len(values) - np.arange(len(values))
    adjusted = np.empty_like(values)
    adjusted[order] = np.minimum(np.maximum.accumulate(factors * values[order]), 1.0)
    return adjusted


def compute_a12(a: Sequence[float], b: Sequence[float]) -> float:
    """Probability that a run of the first solver is better than one of the second, ties counting half.

    0.5 is no difference; 0.56, 0.64 and 0.71 are called small, medium and large.

    Source:
        Vargha, Delaney (2000), A critique and improvement of the CL common language effect size statistics.
    """
    first, second = np.asarray(a)[:, None], np.asarray(b)[None, :]
    return float(np.mean((first < second) + 0.5 * (first == second)))


@dataclass(frozen=True, kw_only=True)
class Pair:
    """Two solvers and the rank-sum test of their final costs."""

    first: str  #: solver with the better median
    second: str  #: the other
    rank_sum: float  #: p-value over all runs of both, Holm-corrected over all pairs of the problem
    a12: float  #: probability that a run of the first is better

    @property
    def is_significant(self) -> bool:
        """Whether the test finds a difference."""
        return self.rank_sum < SIGNIFICANT


def compare_pairs(costs: Mapping[str, Sequence[float]]) -> list[Pair]:
    """Test every pair of solvers with at least two runs each, given with the best median first; infeasible costs are infinite."""
    pairs = list(combinations([name for name, values in costs.items() if len(values) > 1], 2))
    if not pairs:
        return []
    corrected = correct_by_holm([compute_rank_sum(costs[a], costs[b]) for a, b in pairs])
    return [
        Pair(first=a, second=b, rank_sum=float(p), a12=compute_a12(costs[a], costs[b]))
        for (a, b), p in zip(pairs, corrected, strict=True)
    ]


def describe_power(runs: Sequence[int]) -> str:
    """Say that too few runs of each solver allow no significant difference, and how many do; empty if they suffice."""
    pairs = list(combinations([number for number in runs if number > 1], 2))
    if not pairs:
        return ""

    def find_least(first: int, second: int) -> float:
        return len(pairs) * compute_rank_sum(range(first), range(first, first + second))

    least = min(find_least(*pair) for pair in pairs)
    if least < SIGNIFICANT:
        return ""
    enough = next(number for number in count(2) if find_least(number, number) < SIGNIFICANT)
    return (
        f"with these numbers of runs and {len(pairs)} pair{'s' * (len(pairs) > 1)} of solvers, no difference can be significant: "
        f"the least possible p-value is {min(least, 1.0):.2g}; {enough} runs of each solver allow one"
    )


def approximate_rank_sum(a: Sequence[float], b: Sequence[float]) -> float:
    """Return the two-sided p-value of Wilcoxon's (1945) rank-sum test by the normal approximation, as papers print it.

    Equal to MATLAB's ``ranksum(a, b, 'method', 'approximate')``: ties share their mean rank, with continuity correction.
    """
    from scipy.stats import mannwhitneyu

    return 1.0 if len({*a, *b}) == 1 else float(mannwhitneyu(a, b, method="asymptotic").pvalue)
