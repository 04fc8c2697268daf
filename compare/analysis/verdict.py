"""The verdict in three sentences: who found the best known value, the median gaps, the costs."""

from __future__ import annotations

import math
from collections.abc import Sequence

from compare.analysis.comparison import Comparison
from compare.analysis.proven import proven_of
from compare.analysis.significance import compare_pairs
from compare.analysis.solver_table import count, percent
from compare.analysis.units import join_words, with_unit

# A run with at most this gap has found the best known value.
FOUND = 1e-6
SIGNIFICANT = 0.05


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
        "Best known: " + "; ".join(_found(c) for c in known) + ".",
        "Median gap to the best known value: " + "; ".join(_distance(c) for c in known) + ".",
        "Expected cost to reach a gap of 0.1 %: " + "; ".join(_cost(c) for c in known) + ".",
    )


def _found(comparison: Comparison) -> str:
    counts = [(s, sum(len(c.gap) > 0 and c.gap.min() <= FOUND for c in s.curves)) for s in comparison.solvers]
    finders = [f"{s.name} in {n} of {len(s.curves)} runs" for s, n in counts if n]
    best, words = with_unit(comparison.reference, comparison.objective.unit), proven_of(comparison)
    text = f"on {comparison.problem} {comparison.objective.name} {best}, reached to 1e-6 by {join_words(finders) or 'one run'}"
    return text + (f", and {words}" if words else "")


def _distance(comparison: Comparison) -> str:
    parts = []
    for solver in comparison.solvers:
        gap = comparison.gap(solver.median_cost)
        parts.append(f"{solver.name} {percent(gap) if math.isfinite(gap) else 'mostly infeasible'}")
    pairs = compare_pairs(comparison)
    different = sum(pair.rank_sum < SIGNIFICANT for pair in pairs)
    tests = f" ({different} of {len(pairs)} pairs differ at the 5 % level, Holm-corrected)" if pairs else ""
    return f"on {comparison.problem} {join_words(parts)}{tests}"


def _cost(comparison: Comparison) -> str:
    target = 1e-3
    costs = [(s, s.expected_cost(target), s.expected_cost(target, "seconds")) for s in comparison.solvers]
    reached = sorted((item for item in costs if math.isfinite(item[1])), key=lambda item: item[1])
    never = [solver.name for solver, cost, _ in costs if not math.isfinite(cost)]
    parts = [
        f"{solver.name} {count(cost)} evaluations" + ("" if math.isnan(seconds) else f" or {seconds:.2g} s")
        for solver, cost, seconds in reached
    ]
    text = f"on {comparison.problem} {join_words(parts) or 'no solver'}"
    return text + (f", never by {join_words(never)}" if never else "")
