"""What is logged of a run, whatever the format."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from compare.analysis.comparison import Comparison, SolverRuns
from compare.analysis.statistics.run_length import Curve
from compare.study.record import RunRecord
from nlp_gait.files import make_file_name

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
    total = max(1, math.ceil(curve.total_cost()))
    return Trace(run=record.run, x=tuple(record.x.values()), lines=tuple(lines), total=total)


@dataclass(frozen=True, kw_only=True)
class Log:
    """Runs of one solver on one problem, to be written.

    Attributes:
        folder: of the solver.
        stem: of the files' names.
        number: of the problem, which is a function in these formats.
        problem: label.
        dimension: number of variables.
        solver: label.
        runs: all.
    """

    folder: Path
    stem: str
    number: int
    problem: str
    dimension: int
    solver: str
    runs: tuple[Trace, ...]


# Writes a log, and returns its files.
Writer = Callable[[Log], Sequence[Path]]


def dimension(comparison: Comparison) -> int:
    """Number of variables, from the records that have a point; 1 if none has."""
    return int(np.max([len(record.x) for record in comparison.records], initial=1))


def write_logs(comparisons: Sequence[Comparison], folder: Path, write: Writer) -> list[Path]:
    """Write the log of each solver on each problem into the solver's folder.

    Args:
        comparisons: one a problem; problem k is function k, from 1.
        folder: gets a folder for each solver.
        write: writes one log in its format.

    Returns:
        All files.

    Raises:
        OutputError: the folder cannot be written to.
    """
    return [
        path
        for number, comparison in enumerate(comparisons, start=1)
        for solver in comparison.solvers
        for path in write(
            Log(
                folder=folder / make_file_name(solver.name),
                stem=f"f{number}_{make_file_name(comparison.problem)}",
                number=number,
                problem=comparison.problem,
                dimension=dimension(comparison),
                solver=solver.name,
                runs=tuple(traces(solver)),
            )
        )
    ]
