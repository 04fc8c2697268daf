"""Runs without a result, or without a known number of evaluations."""

from compare.analysis.comparison import Comparison


def describe_unknown(comparison: Comparison) -> list[str]:
    """Return a sentence for each solver with runs whose evaluations are unknown."""
    unknown = {s.name: (sum(not r.evaluations for r in s.records), len(s.records)) for s in comparison.solvers}
    return [
        f"{name}: the number of evaluations of {count} of {runs} runs is unknown; all statistics of evaluations exclude {name}."
        for name, (count, runs) in unknown.items()
        if count
    ]


def describe_failures(comparison: Comparison) -> list[str]:
    """Return a sentence for each solver with runs that have no result."""
    sentences = []
    for solver in comparison.solvers:
        failed = [record for record in solver.records if not record.x]
        if failed:
            runs = f"{len(failed)} of {len(solver.records)} runs"
            first = failed[0].status
            sentences.append(f"{comparison.problem}, {solver.name}: {runs} have no result; the first {first}")
    return sentences
