"""Runs without a result, or without a known number of evaluations."""

from collections.abc import Sequence
from dataclasses import dataclass

from compare.analysis.comparison import Comparison
from compare.study.record import RunRecord


def describe_unknown(comparison: Comparison) -> list[str]:
    """Return a sentence for each solver with runs whose evaluations are unknown."""
    sentences = []
    for solver in comparison.solvers:
        runs = [r.run for r in solver.records if not r.evaluations]
        if runs:
            which = f"run {runs[0]}" if len(runs) == 1 else f"runs {_join_numbers(runs)}"
            sentences.append(
                f"{solver.name}, {which} of {len(solver.records)}: the number of evaluations is unknown; all statistics of "
                f"evaluations exclude {solver.name}."
            )
    return sentences


def _join_numbers(numbers: Sequence[int]) -> str:
    """Return ascending numbers with their gaps: ``0 to 3, 7``."""
    parts: list[list[int]] = []
    for number in numbers:
        if parts and number == parts[-1][-1] + 1:
            parts[-1].append(number)
        else:
            parts.append([number])
    return ", ".join(f"{part[0]}" if len(part) == 1 else f"{part[0]} to {part[-1]}" for part in parts)


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
