"""Solvers over many problems: mean ranks with Friedman's test and the critical difference, wins against others."""

import math
from collections.abc import Sequence
from dataclasses import dataclass

from compare.analysis.comparison import Comparison, index_solvers
from compare.analysis.record_statistics import SIGNIFICANT, tie
from compare.analysis.units import name_solver

# Of a solver than which the subject is significantly better, from which it does not differ, or than which it is worse.
MARKS = {1: "+", 0: "=", -1: "-"}


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


def tabulate_problems(
    comparisons: Sequence[Comparison], subject: str | None = None
) -> tuple[str, list[tuple[str, ...]]]:
    """Return a solver, and a header and rows: median gaps on each problem, marked by the test of this solver against others.

    By default it is the first of the user's solvers, else that with the best mean rank. The last rows count the marks, and give
    mean ranks.
    """
    ranks = rank_over_problems(comparisons).mean_ranks
    by_name, _ = index_solvers(comparisons)
    names = list(dict.fromkeys([*ranks, *(name for solvers in by_name for name in solvers)]))
    subject = subject or [*list_user_solvers(comparisons), *names][0]
    rows = [("problem", *map(name_solver, names))]
    for comparison, solvers in zip(comparisons, by_name, strict=True):
        marks = {name: MARKS[result] for name, result in comparison.compare_with_others(subject).items()}
        gaps = {name: comparison.gap(solver.median_cost) for name, solver in solvers.items()}
        cells = {n: comparison.format_gap(gap) if math.isfinite(gap) else "infeasible" for n, gap in gaps.items()}
        rows.append((comparison.problem, *(f"{cells.get(name, '-')} {marks.get(name, '')}".strip() for name in names)))
    scores = {score.other: f"{score.wins}/{score.ties}/{score.losses}" for score in count_wins(comparisons, subject)}
    rows.append(("wins/ties/losses", *(scores.get(name, "-") for name in names)))
    rows.append(("mean rank", *(f"{ranks[name]:.2f}" if name in ranks else "-" for name in names)))
    return name_solver(subject), rows


def explain_marks(subject: str) -> str:
    """Return what the marks of ``tabulate_problems`` mean."""
    return (
        f"Median gap to the best known value. {subject} is significantly better (+), worse (-) or not different (=): two-sided "
        f"rank-sum test at {SIGNIFICANT:g}, Holm-corrected over all pairs on the problem. Ranks are those of the medians, of "
        "solvers that ran on all problems."
    )


def describe_tests(ranking: Ranking) -> str:
    """Return Friedman's test and the critical difference in a sentence; empty if neither applies."""
    if ranking.friedman is None or ranking.critical_difference is None:
        return ""
    return (
        f"Friedman's test: p = {ranking.friedman:.2g}; mean ranks that differ by less than {ranking.critical_difference:.2f} "
        "do not differ at 5 % (Nemenyi)."
    )
