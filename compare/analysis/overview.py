"""Solvers over many problems: mean ranks with Friedman's test and the critical difference, wins against others."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from compare.analysis.comparison import Comparison, index_solvers
from compare.analysis.record_statistics import SIGNIFICANT, tie


@dataclass(frozen=True, kw_only=True)
class Ranking:
    """Solvers that ran on all problems, by their ranks on each.

    Source:
        Demsar (2006), Statistical comparisons of classifiers over multiple data sets, section 3.2.2.
    """

    mean_ranks: dict[str, float]  #: of the median over all runs, best first; equals share a rank
    friedman: float | None  #: p-value of Friedman's test; None for fewer than three solvers or two problems
    critical_difference: float | None  #: mean ranks that differ by less do not differ at 5 % (Nemenyi); likewise


@dataclass(frozen=True, kw_only=True)
class Score:
    """A solver against another one: on how many problems the rank-sum test, Holm-corrected on each, finds a difference."""

    other: str
    wins: int
    ties: int
    losses: int


def rank_over_problems(comparisons: Sequence[Comparison]) -> Ranking:
    """Rank the solvers that ran on all problems by their medians on each, equal within the judge's tolerance."""
    from scipy.stats import friedmanchisquare, rankdata, studentized_range

    solvers_by_name, names = index_solvers(comparisons)
    if not names:
        return Ranking(mean_ranks={}, friedman=None, critical_difference=None)
    medians = [
        [cost for (cost,) in tie([[solvers[name].median_cost] for name in names], comparison.reference)]
        for comparison, solvers in zip(comparisons, solvers_by_name, strict=True)
    ]
    ranks = rankdata(medians, axis=1)
    means = {name: float(column.mean()) for name, column in zip(names, ranks.T, strict=True)}
    n, k = ranks.shape
    testable = n > 1 and k > 2
    p = float(friedmanchisquare(*ranks.T).pvalue) if testable else None
    quantile = float(studentized_range.ppf(1.0 - SIGNIFICANT, k, math.inf)) / math.sqrt(2.0) if testable else 0.0
    return Ranking(
        mean_ranks=dict(sorted(means.items(), key=lambda item: item[1])),
        friedman=1.0 if p is not None and math.isnan(p) else p,  # all equal
        critical_difference=quantile * math.sqrt(k * (k + 1) / (6.0 * n)) if testable else None,
    )


def count_wins(comparisons: Sequence[Comparison], solver: str) -> list[Score]:
    """Return how often a solver is significantly better or worse than each other one that has as many runs to test."""
    tested: dict[str, list[int]] = {}
    for comparison in comparisons:
        for other, result in comparison.compare_with_others(solver).items():
            tested.setdefault(other, []).append(result)
    return [Score(other=other, wins=r.count(1), ties=r.count(0), losses=r.count(-1)) for other, r in tested.items()]


def list_user_solvers(comparisons: Sequence[Comparison]) -> list[str]:
    """Return the names of solvers that are the user's own."""
    return list(dict.fromkeys(s.name for c in comparisons for s in c.solvers if s.is_user_defined))


def describe_tests(ranking: Ranking) -> str:
    """Return Friedman's test and the critical difference in a sentence; empty if neither applies."""
    if ranking.friedman is None or ranking.critical_difference is None:
        return ""
    return (
        f"Friedman's test: p = {ranking.friedman:.2g}; mean ranks that differ by less than {ranking.critical_difference:.2f} "
        "do not differ at 5 % (Nemenyi)."
    )
