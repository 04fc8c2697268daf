"""Solvers over many problems: mean ranks with Friedman's test and the critical difference, wins against others, the verdict."""

import math
from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from statistics import median

from compare.analysis.comparison import Comparison, SolverRuns, index_solvers
from compare.analysis.record_statistics import tie
from compare.analysis.units import format_percent, join_words
from compare.analysis.verdict import FOUND, SIGNIFICANT, Pair, compare_pairs
from compare.study.definition import SOURCE


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

    found, names = index_solvers(comparisons)
    if not names:
        return Ranking(mean_ranks={}, friedman=None, critical_difference=None)
    medians = [
        [cost for (cost,) in tie([[solvers[name].median_cost] for name in names], comparison.reference)]
        for comparison, solvers in zip(comparisons, found, strict=True)
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
    tested: dict[str, list[Pair]] = {}
    for comparison in comparisons:
        for pair in compare_pairs(comparison):
            if solver in (pair.first, pair.second):
                tested.setdefault(pair.second if pair.first == solver else pair.first, []).append(pair)
    scores = []
    for other, pairs in tested.items():
        better = Counter(pair.first for pair in pairs if pair.rank_sum < SIGNIFICANT)
        wins, losses = better[solver], better[other]
        scores.append(Score(other=other, wins=wins, ties=len(pairs) - wins - losses, losses=losses))
    return scores


def _compute_median_gap(comparison: Comparison, solver: SolverRuns) -> float:
    """Return the gap of the median, infinite if half of the runs or more are infeasible."""
    return comparison.gap(solver.median_cost) if math.isfinite(solver.median_cost) else math.inf


def list_user_solvers(comparisons: Sequence[Comparison]) -> list[str]:
    """Return the names of solvers that are the user's own: code, a program, or imported results."""
    records = [record for comparison in comparisons for record in comparison.records]
    own = (r.solver for r in records if "imported" in r.definition or SOURCE in (r.definition.get("solver") or {}))
    return list(dict.fromkeys(own))


def write_overall_verdict(comparisons: Sequence[Comparison], ranking: Ranking) -> tuple[str, ...]:
    """Return at most five sentences over many problems."""
    found, names = index_solvers(comparisons)
    sentences = []
    if ranking.mean_ranks:
        ranks = join_words(f"{name} {rank:.2f}" for name, rank in ranking.mean_ranks.items())
        sentences.append(
            f"Mean rank of the medians over {len(comparisons)} problems: {ranks}. {describe_tests(ranking)}".strip()
        )
        gaps = {
            name: [_compute_median_gap(c, s[name]) for c, s in zip(comparisons, found, strict=True)] for name in names
        }
        middle = ((name, median(gaps[name])) for name in ranking.mean_ranks)
        typical = join_words(
            f"{name} {format_percent(0.0 if gap <= FOUND else gap) if math.isfinite(gap) else 'mostly infeasible'}"
            for name, gap in middle
        )
        sentences.append(f"Median over the problems of the median gap: {typical}.")
    reached = Counter(s.name for c in comparisons for s in c.solvers if s.feasible and c.gap(s.feasible[0]) <= FOUND)
    best = join_words(f"{name} on {number}" for name, number in reached.most_common())
    sentences.append(f"Best known value reached to 1e-6, of {len(comparisons)} problems: {best or 'none'}.")
    for solver in list_user_solvers(comparisons)[:1]:
        against = join_words(f"{r.wins}-{r.ties}-{r.losses} against {r.other}" for r in count_wins(comparisons, solver))
        sentences += [f"Wins, ties and losses of {solver}: {against}."] if against else []
    better = join_words(c.problem for c in comparisons if c.better is not None)
    return (*sentences, *([f"A new best known value was found on {better}."] if better else []))


def describe_tests(ranking: Ranking) -> str:
    """Return Friedman's test and the critical difference in a sentence; empty if neither applies."""
    if ranking.friedman is None or ranking.critical_difference is None:
        return ""
    return (
        f"Friedman's test: p = {ranking.friedman:.2g}; mean ranks that differ by less than {ranking.critical_difference:.2f} "
        "do not differ at 5 % (Nemenyi)."
    )
