"""Tests of all pairs of solvers on one problem."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations

from compare.analysis.record_statistics import compute_a12, compute_rank_sum, compute_signed_rank, correct_by_holm

SIGNIFICANT = 0.05


@dataclass(frozen=True, kw_only=True)
class Sample:
    """Final costs of the runs of a solver."""

    solver: str
    costs: Sequence[
        float
    ]  #: infinite where a run is not feasible; equal where they differ within the judge's tolerance
    paired: Mapping[int, float]  #: by seed, of runs whose starting points all searches with that seed share


@dataclass(frozen=True, kw_only=True)
class Pair:
    """Two solvers; p-values are Holm-corrected over all pairs of the problem."""

    first: str  #: solver with the better median
    second: str  #: the other
    rank_sum: float  #: p-value over all runs of both
    #: p-value over the runs that both have; None if fewer than two or if they do not share starting points
    signed_rank: float | None
    a12: float  #: probability that a run of the first is better
    paired_runs: int

    @property
    def is_significant(self) -> bool:
        """Whether the rank-sum test finds a difference."""
        return self.rank_sum < SIGNIFICANT


def compare_pairs(samples: Sequence[Sample]) -> list[Pair]:
    """Test every pair of samples of at least two runs each, given with the best median first."""
    pairs = list(combinations([sample for sample in samples if len(sample.costs) > 1], 2))
    if not pairs:
        return []
    sums = correct_by_holm([compute_rank_sum(a.costs, b.costs) for a, b in pairs])
    seeds = [sorted(a.paired.keys() & b.paired.keys()) for a, b in pairs]
    tested = [index for index, shared in enumerate(seeds) if len(shared) > 1]
    signed = [
        compute_signed_rank([pairs[k][0].paired[s] for s in seeds[k]], [pairs[k][1].paired[s] for s in seeds[k]])
        for k in tested
    ]
    corrected = dict(zip(tested, correct_by_holm(signed), strict=True))
    return [
        Pair(
            first=a.solver,
            second=b.solver,
            rank_sum=float(sums[index]),
            signed_rank=float(corrected[index]) if index in corrected else None,
            a12=compute_a12(a.costs, b.costs),
            paired_runs=len(seeds[index]),
        )
        for index, (a, b) in enumerate(pairs)
    ]
