"""The runs of all solvers on one problem on a common scale, and on several problems: ranks, wins and tests."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from statistics import median

import numpy as np

from compare.analysis.record_statistics import (
    SIGNIFICANT,
    Curve,
    Pair,
    compare_pairs,
    compute_running_time,
    describe_power,
    find_best_known,
    make_curve,
    tie,
)
from compare.analysis.units import FOUND, ZERO, compute_gap, format_gap, is_zero, name_solver, with_unit
from compare.study.record import RunRecord, find_best, group_by
from compare.study.references import BETTER, OWN, Reference, find_reference
from compare.study.run import GRADIENT_SOLVERS
from nlp_gait.errors import InputError
from nlp_gait.formulation import Objective

SMALLEST_GAP = 1e-8  # that is shown; points may differ from the best known value by less in their last digits


@dataclass(frozen=True, kw_only=True, eq=False)
class SolverRuns:
    """All runs of one solver, by number."""

    name: str
    records: tuple[RunRecord, ...]  #: ascending in the run's number
    curves: tuple[Curve, ...]

    @property
    def title(self) -> str:
        """Name as the field writes it."""
        return name_solver(self.name)

    @cached_property
    def costs(self) -> tuple[float, ...]:
        """Judge's objective of each run, to be minimised; infinite where it is not feasible."""
        return tuple(record.cost for record in self.records)

    @property
    def feasible(self) -> list[float]:
        """Costs of the feasible runs, best first."""
        return sorted(cost for cost in self.costs if math.isfinite(cost))

    @property
    def median_cost(self) -> float:
        """Over all runs, infinite if half of them or more are infeasible."""
        return median(self.costs)

    @property
    def is_gradient(self) -> bool:
        """Whether its runs are starts of a gradient method."""
        return all(r.inputs.solver in GRADIENT_SOLVERS for r in self.records)

    @property
    def is_user_defined(self) -> bool:
        """Whether it is the user's own: code, a program, or imported results."""
        return any(r.inputs.imported or r.inputs.code for r in self.records)

    @property
    def best(self) -> RunRecord | None:
        """Best feasible run, None without one."""
        return find_best(self.records)

    def has_costs(self, axis: str) -> bool:
        """Return whether the cost of every run is known, in evaluations or seconds; imported results may lack it."""
        return all(bool(np.isfinite(getattr(curve, axis)).all()) for curve in self.curves)

    def expected_cost(self, target: float, axis: str = "evaluations") -> float:
        """Return the expected running time to a relative gap, in equivalent evaluations or seconds; NaN for unknown costs."""
        if not self.has_costs(axis):
            return math.nan
        reached = [c.cost_to_reach(target, axis) for c in self.curves]
        return compute_running_time(reached, [c.total_cost(axis) for c in self.curves])


@dataclass(frozen=True, kw_only=True, eq=False)
class Comparison:
    """All solvers on one problem, the best median first."""

    problem: str
    objective: Objective
    #: Best known objective, from which gaps are measured: the shipped one, else the best of these runs; NaN without either
    reference: float
    known: Reference  #: the shipped value with its proven bound, and the source of ``reference`` in words
    solvers: tuple[SolverRuns, ...]

    @property
    def records(self) -> list[RunRecord]:
        """Of all solvers."""
        return [record for solver in self.solvers for record in solver.records]

    @cached_property
    def best(self) -> RunRecord | None:
        """Best feasible run of all solvers; None without one."""
        return find_best(self.records)

    @property
    def better(self) -> RunRecord | None:
        """Best run if it is better than the shipped best known value; else None."""
        best, known = self.best, self.known.objective
        is_better = (
            best is not None and known is not None and compute_gap(best.objective, known, self.objective) < -BETTER
        )
        return best if is_better else None

    def value(self, cost: float) -> float:
        """Return a cost as an objective in the problem's sense."""
        return self.objective.sign * cost

    @cached_property
    def pairs(self) -> list[Pair]:
        """Tests of all pairs of solvers; differences within the judge's tolerance are ties."""
        tied = tie([solver.costs for solver in self.solvers], self.reference)
        return compare_pairs({solver.name: costs for solver, costs in zip(self.solvers, tied, strict=True)})

    @property
    def power(self) -> str:
        """Why no difference can be significant, see ``describe_power``; empty if one can."""
        return describe_power([len(solver.records) for solver in self.solvers])

    def compare_with_others(self, solver: str) -> dict[str, int]:
        """Return 1, 0 or -1 by the name of each other solver: this one is significantly better, not different, or worse."""
        results: dict[str, int] = {}
        for pair in self.pairs:
            if pair.first == solver:
                results[pair.second] = +pair.is_significant
            elif pair.second == solver:
                results[pair.first] = -pair.is_significant
        return results

    def count_reached(self, solver: SolverRuns, target: float = FOUND) -> int:
        """Return the number of runs of a solver that end within a gap, by default at the best known value."""
        return sum(self.gap(cost) <= target for cost in solver.costs)

    def format_gap(self, gap: float | None) -> str:
        """Format a gap in percent, or in the objective's unit from a value near zero; ``FOUND`` is the least one shown."""
        if gap is None:
            return "-"
        if not is_zero(self.reference) or not math.isfinite(gap):
            return format_gap(gap)
        is_small = 0.0 < abs(gap) < ZERO
        return "< " * is_small + with_unit(ZERO if is_small else gap, self.objective.unit, ".2g")

    def gap(self, cost: float) -> float:
        """Return the distance of a cost from the best known objective, see ``compute_gap``; 0 if better within the tolerance."""
        gap = compute_gap(self.value(cost), self.reference, self.objective)
        return 0.0 if -BETTER <= gap < 0.0 else gap


def compare_problems(
    records: Sequence[RunRecord],
    references: Mapping[str, float] | None = None,
    folder: Path | None = None,
) -> list[Comparison]:
    """Return one comparison per problem among records, in their order; InputError if runs disagree on a problem's objective.

    Gaps are measured from a problem's entry in ``references``, else from the best known value of exactly this problem, shipped or
    proven in the folder, else from the best of the records.
    """
    groups = group_by(records, lambda record: record.problem).items()
    return [_make_comparison(name, group, (references or {}).get(name), folder) for name, group in groups]


def _make_comparison(
    problem: str, records: Sequence[RunRecord], reference: float | None, folder: Path | None
) -> Comparison:
    objective = records[0].inputs.objective
    for record in records:
        if record.inputs.objective != objective:
            raise InputError(f"records of {problem!r} disagree on the objective: {record.solver}, run {record.run}")
    known, best = find_reference(records[0].inputs.problem, folder), find_best_known(records)
    if known.bound is not None and compute_gap(best, known.bound, objective) < -BETTER:
        known = Reference(source=f"{OWN}; a run is better than the bound of {known.proven_as}, which is not used")
    if reference is None:
        reference = best if known.objective is None else known.objective
    solvers = []
    for name, group in group_by(records, lambda record: record.solver).items():
        runs = tuple(sorted(group, key=lambda record: record.run))
        curves = tuple(make_curve(record, objective, reference) for record in runs)
        solvers.append(SolverRuns(name=name, records=runs, curves=curves))
    solvers.sort(key=lambda s: (s.median_cost, min(s.costs), s.name))
    return Comparison(problem=problem, objective=objective, reference=reference, known=known, solvers=tuple(solvers))


def index_solvers(comparisons: Sequence[Comparison]) -> tuple[list[dict[str, SolverRuns]], list[str]]:
    """Return the solvers of each comparison by name, and the names of those that ran on all problems."""
    by_name = [{solver.name: solver for solver in comparison.solvers} for comparison in comparisons]
    return by_name, [name for name in by_name[0] if all(name in solvers for solvers in by_name)] if by_name else []


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
