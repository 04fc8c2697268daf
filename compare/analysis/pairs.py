"""Tests of all pairs of solvers on one problem."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

from compare.analysis.record_statistics import compute_a12, compute_rank_sum, correct_by_holm

SIGNIFICANT = 0.05


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
