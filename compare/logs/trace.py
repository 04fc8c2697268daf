"""What is logged of a run, whatever the format."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from compare.analysis.comparison import Comparison, SolverRuns
from compare.analysis.statistics.run_length import Curve
from compare.study.record import RunRecord

# Gap that is logged while nothing feasible was found: formats of unconstrained benchmarks have no word for it.
NOTHING_FEASIBLE = 1e10
# Gap that is logged where the best known is met or beaten: readers take logarithms.
SMALLEST = 1e-12


@dataclass(frozen=True, kw_only=True)
class Trace:
    """Best so far of a run.

    Attributes:
        run: its number.
        x: (n,) where it ended; empty if it has no point.
        lines: evaluations and gap, each time the best improves; the first is at one evaluation, as readers expect.
        total: evaluations of the whole run.
    """

    run: int
    x: tuple[float, ...]
    lines: tuple[tuple[int, float], ...]
    total: int

    @property
    def best(self) -> tuple[int, float]:
        """Evaluations at which the best was found, and its gap."""
        return self.lines[-1]


def traces(solver: SolverRuns) -> Iterator[Trace]:
    """Trace of every run of a solver on one problem."""
    for record, curve in zip(solver.records, solver.curves, strict=True):
        yield trace_of(record, curve)


def trace_of(record: RunRecord, curve: Curve) -> Trace:
    """Trace of a run."""
    lines = [(1, NOTHING_FEASIBLE)]
    for evaluations, gap in zip(curve.evaluations.tolist(), curve.gap.tolist(), strict=True):
        gap = max(gap, SMALLEST)
        if not gap < lines[-1][1]:
            continue
        at = max(1, math.ceil(evaluations))
        if at == lines[-1][0]:  # both in one evaluation: the better one
            lines.pop()
        lines.append((at, gap))
    total = max(1, math.ceil(curve.total()))
    return Trace(run=record.run, x=tuple(record.x.values()), lines=tuple(lines), total=total)


def dimension(comparison: Comparison) -> int:
    """Number of variables, from the records that have a point; 1 if none has."""
    return int(np.max([len(record.x) for record in comparison.records], initial=1))


def file_safe(name: str) -> str:
    """Name of a problem or solver as part of a file's name."""
    return "".join(sign if sign.isalnum() or sign in "-_+." else "." for sign in name)
