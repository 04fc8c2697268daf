"""Runs without a result, by solver, with the reason of the first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from compare.study.record import RunRecord


@dataclass(frozen=True, kw_only=True)
class Failure:
    """Failed runs of one solver on one problem.

    Attributes:
        problem: title.
        solver: title.
        failed: number of runs without a point.
        runs: number of runs.
        reason: status of the first.
    """

    problem: str
    solver: str
    failed: int
    runs: int
    reason: str

    @property
    def sentence(self) -> str:
        """The failures as one sentence."""
        return (
            f"{self.problem}, {self.solver}: {self.failed} of {self.runs} runs have no result; the first {self.reason}"
        )


def find_failures(records: Sequence[RunRecord]) -> list[Failure]:
    """Return the solvers with failed runs, in the order of their records."""
    found = []
    for problem, solver in dict.fromkeys((record.problem, record.solver) for record in records):
        own = [record for record in records if (record.problem, record.solver) == (problem, solver)]
        failed = [record for record in own if not record.x]
        if failed:
            found.append(
                Failure(problem=problem, solver=solver, failed=len(failed), runs=len(own), reason=failed[0].status)
            )
    return found
