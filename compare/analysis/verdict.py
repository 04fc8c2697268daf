"""Tests of all pairs of solvers, and the verdict in three sentences: best known value, median gaps, costs."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import combinations

from compare.analysis.best_known import compute_gap, describe_bound
from compare.analysis.comparison import Comparison, SolverRuns
from compare.analysis.record_statistics import compute_a12, compute_rank_sum, compute_signed_rank, correct_by_holm
from compare.analysis.solver_table import count
from compare.analysis.units import join_words, with_unit
from compare.study.record import RunRecord
from compare.study.task import FUNCTION

# A run with at most this gap has found the best known value.
FOUND = 1e-6
SIGNIFICANT = 0.05


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


def compare_pairs(comparison: Comparison) -> list[Pair]:
    """Test every pair of solvers with at least two runs each; differences within the judge's tolerance are ties."""
    tied = [replace(s, costs=tuple(c)) for s, c in zip(comparison.solvers, comparison.tied_costs, strict=True)]
    pairs = list(combinations([s for s in tied if len(s.records) > 1], 2))
    if not pairs:
        return []
    sums = correct_by_holm([compute_rank_sum(a.costs, b.costs) for a, b in pairs])
    paired = [_list_paired_costs(a, b) for a, b in pairs]
    tested = [index for index, (first, _) in enumerate(paired) if len(first) > 1]
    signed = dict(zip(tested, correct_by_holm([compute_signed_rank(*paired[index]) for index in tested]), strict=True))
    return [
        Pair(
            first=a.name,
            second=b.name,
            rank_sum=float(sums[index]),
            signed_rank=float(signed[index]) if index in signed else None,
            a12=compute_a12(a.costs, b.costs),
            paired_runs=len(paired[index][0]),
        )
        for index, (a, b) in enumerate(pairs)
    ]


def find_leaders(comparison: Comparison) -> set[str]:
    """Return the solver with the best median and those that do not differ from it significantly; empty without any test."""
    leader = comparison.solvers[0].name
    p_values = {pair.second: pair.rank_sum for pair in compare_pairs(comparison) if pair.first == leader}
    return {leader, *(name for name, p in p_values.items() if p >= SIGNIFICANT)} if p_values else set()


def _list_paired_costs(a: SolverRuns, b: SolverRuns) -> tuple[list[float], list[float]]:
    """Return the costs of runs with equal seeds, which share their starting points; gradient methods do not."""
    first = {r.seed: cost for r, cost in zip(a.records, a.costs, strict=True) if _shares_start(r)}
    second = {r.seed: cost for r, cost in zip(b.records, b.costs, strict=True) if _shares_start(r)}
    seeds = sorted(first.keys() & second.keys())
    return [first[seed] for seed in seeds], [second[seed] for seed in seeds]


def _shares_start(record: RunRecord) -> bool:
    if record.settings.get("kind") == FUNCTION:  # it receives no starting points
        return False
    return "handling" in record.definition or "polishes" in record.definition


def write_verdict(comparisons: Sequence[Comparison]) -> tuple[str, str, str]:
    """Return three sentences over all problems."""
    known = [c for c in comparisons if math.isfinite(c.reference)]
    if not known:
        names = ", ".join(c.problem for c in comparisons)
        return (
            f"No solver found a feasible point of {names}.",
            "There are no gaps to compare.",
            "The failed runs below give the reasons.",
        )
    return (
        "Best known: " + "; ".join(f"on {c.problem} {describe_best_known(c)}" for c in known) + ".",
        "Median gap to the best known value: " + "; ".join(_describe_distance(c) for c in known) + ".",
        "Expected cost to reach a gap of 0.1 %: " + "; ".join(_describe_cost(c) for c in known) + ".",
    )


def describe_best_known(comparison: Comparison) -> str:
    """Return the best known value, its source, the solvers that reach it, and what is proven."""
    if not math.isfinite(comparison.reference):
        return "no feasible point was found"
    counts = [(s, sum(len(c.gap) > 0 and c.gap.min() <= FOUND for c in s.curves)) for s in comparison.solvers]
    finders = [f"{s.name} in {n} of {len(s.curves)} runs" for s, n in counts if n]
    best = with_unit(comparison.reference, comparison.objective.unit)
    reached = f"reached to 1e-6 by {join_words(finders)}" if finders else "not reached to 1e-6"
    text = f"{comparison.objective.name} {best} ({comparison.known.source}), {reached}"
    bound = comparison.known.bound
    proof = "" if bound is None else describe_bound(bound, comparison.reference, comparison.objective.unit)
    return ", and ".join(filter(None, (text, proof, describe_better(comparison))))


def _describe_distance(comparison: Comparison) -> str:
    parts = []
    for solver in comparison.solvers:
        gap = comparison.gap(solver.median_cost)
        parts.append(f"{solver.name} {comparison.format_gap(gap) if math.isfinite(gap) else 'mostly infeasible'}")
    pairs = compare_pairs(comparison)
    different = sum(pair.rank_sum < SIGNIFICANT for pair in pairs)
    tests = f" ({different} of {len(pairs)} pairs differ at the 5 % level, Holm-corrected)" if pairs else ""
    return f"on {comparison.problem} {join_words(parts)}{tests}"


def _describe_cost(comparison: Comparison) -> str:
    target = 1e-3
    costs = [(s, s.expected_cost(target), s.expected_cost(target, "seconds")) for s in comparison.solvers]
    reached = sorted((item for item in costs if math.isfinite(item[1])), key=lambda item: item[1])
    never = [solver.name for solver, cost, _ in costs if math.isinf(cost)]
    unknown = [solver.name for solver, cost, _ in costs if math.isnan(cost)]
    parts = [
        f"{solver.name} {count(cost)} evaluations" + ("" if math.isnan(seconds) else f" or {seconds:.2g} s")
        for solver, cost, seconds in reached
    ]
    text = f"on {comparison.problem} {join_words(parts) or 'no solver'}"
    text += f", never by {join_words(never)}" if never else ""
    return text + (f", unknown for {join_words(unknown)}" if unknown else "")


def describe_better(comparison: Comparison) -> str:
    """Say that a run is better than the shipped best known value; empty if none is."""
    run = comparison.better
    if run is None:
        return ""
    value, gap = run.verdict.objective, compute_gap(run.verdict.objective, comparison.reference, comparison.objective)
    found = f"{with_unit(value, comparison.objective.unit)} by {run.solver}, run {run.run}"
    return f"a new best known value was found: {found}, {-100 * gap:.2g} % better than the shipped one"
