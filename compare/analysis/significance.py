"""Tests of all pairs of solvers on one problem."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import combinations

from compare.analysis.comparison import Comparison, SolverRuns
from compare.analysis.statistics.inference import a12, holm, rank_sum, signed_rank
from compare.study.record import RunRecord
from compare.study.task import FUNCTION


@dataclass(frozen=True, kw_only=True)
class Pair:
    """Two solvers; p-values are Holm-corrected over all pairs of the problem.

    Attributes:
        first: solver with the better median.
        second: the other.
        rank_sum: p-value over all runs of both.
        signed_rank: p-value over the runs that both have; None if fewer than two or if they do not share starting points.
        a12: probability that a run of the first is better.
        paired_runs: their number.
    """

    first: str
    second: str
    rank_sum: float
    signed_rank: float | None
    a12: float
    paired_runs: int


def compare_pairs(comparison: Comparison) -> list[Pair]:
    """Test every pair of solvers with at least two runs each."""
    pairs = list(combinations([s for s in comparison.solvers if len(s.records) > 1], 2))
    if not pairs:
        return []
    sums = holm([rank_sum(a.costs, b.costs) for a, b in pairs])
    paired = [_paired_costs(a, b) for a, b in pairs]
    tested = [index for index, (first, _) in enumerate(paired) if len(first) > 1]
    signed = dict(zip(tested, holm([signed_rank(*paired[index]) for index in tested]), strict=True))
    return [
        Pair(
            first=a.name,
            second=b.name,
            rank_sum=float(sums[index]),
            signed_rank=float(signed[index]) if index in signed else None,
            a12=a12(a.costs, b.costs),
            paired_runs=len(paired[index][0]),
        )
        for index, (a, b) in enumerate(pairs)
    ]


def _paired_costs(a: SolverRuns, b: SolverRuns) -> tuple[list[float], list[float]]:
    """Return the costs of runs with equal seeds, which share their starting points; gradient methods do not."""
    first = {r.seed: cost for r, cost in zip(a.records, a.costs, strict=True) if _shares_start(r)}
    second = {r.seed: cost for r, cost in zip(b.records, b.costs, strict=True) if _shares_start(r)}
    seeds = sorted(first.keys() & second.keys())
    return [first[seed] for seed in seeds], [second[seed] for seed in seeds]


def _shares_start(record: RunRecord) -> bool:
    if record.settings.get("kind") == FUNCTION:  # it receives no starting points
        return False
    return "handling" in record.definition or "polishes" in record.definition
