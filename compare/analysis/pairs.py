"""Tests of all pairs of solvers on one problem."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations, count

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
