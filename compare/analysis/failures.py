"""Runs without a result, or without a known number of evaluations."""

from collections.abc import Sequence
from dataclasses import dataclass

from compare.analysis.comparison import Comparison
from compare.study.record import RunRecord


def describe_unknown(comparison: Comparison) -> list[str]:
    """Return a sentence for each solver with runs whose evaluations are unknown."""
    unknown = {s.name: (sum(not r.evaluations for r in s.records), len(s.records)) for s in comparison.solvers}
    return [
        f"{name}: the number of evaluations of {count} of {runs} runs is unknown; all statistics of evaluations exclude {name}."
        for name, (count, runs) in unknown.items()
        if count
    ]


@dataclass(frozen=True, kw_only=True)
class Failure:
    """Failed runs of one solver on one problem."""

    problem: str
    solver: str
    failed: int  #: number of runs without a point
    runs: int
    reason: str  #: status of the first

    @property
    def sentence(self) -> str:
        """The failures as one sentence."""
        runs = f"{self.failed} of {self.runs} runs"
        return f"{self.problem}, {self.solver}: {runs} have no result; the first {self.reason}"


def find_failures(records: Sequence[RunRecord]) -> list[Failure]:
    """Return the solvers with failed runs, in the order of their records."""
    groups: dict[tuple[str, str], list[RunRecord]] = {}
    for record in records:
        groups.setdefault((record.problem, record.solver), []).append(record)
    failures = []
    for (problem, solver), group in groups.items():
        failed = [record for record in group if not record.x]
        if failed:
            status = failed[0].status
            failures.append(Failure(problem=problem, solver=solver, failed=len(failed), runs=len(group), reason=status))
    return failures
