"""Runs as logs in IOHprofiler's JSON, which iohinspector reads.

The logged value is the relative gap to the best known objective, positive if worse, and ``NOTHING_FEASIBLE`` before the first
feasible point. Evaluations are equivalent ones, in which derivatives count as forward differences would.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from compare.analysis.comparison import Comparison, SolverRuns
from nlp_gait.files import make_file_name, make_writable_folder, write_json, write_text

__all__ = ["NOTHING_FEASIBLE", "Trace", "make_traces", "write_ioh"]

# Gap before the first feasible point: formats of unconstrained benchmarks have no value for it.
NOTHING_FEASIBLE = 1e10
# Smallest gap: readers take logarithms.
SMALLEST = 1e-12
IOH_VERSION = "0.3.18"  # of ioh, whose layout is written


@dataclass(frozen=True, kw_only=True)
class Trace:
    """Best so far of a run."""

    run: int  #: its number
    x: tuple[float, ...]  #: (n,) final point; empty if there is none
    #: Evaluations and gap, each time the best improves; the first is at one evaluation, as readers expect
    lines: tuple[tuple[int, float], ...]
    total: int  #: evaluations of the whole run

    @property
    def best(self) -> tuple[int, float]:
        """Evaluations at which the best was found, and its gap."""
        return self.lines[-1]


def make_traces(solver: SolverRuns) -> Iterator[Trace]:
    """Yield the trace of every run of a solver on one problem; none if the evaluations of a run are unknown."""
    if not solver.has_costs("evaluations"):
        return
    for record, curve in zip(solver.records, solver.curves, strict=True):
        best = {1: NOTHING_FEASIBLE}
        for evaluations, gap in zip(curve.evaluations.tolist(), curve.gap.tolist(), strict=True):
            if max(gap, SMALLEST) < next(reversed(best.values())):
                best[max(1, math.ceil(evaluations))] = max(gap, SMALLEST)
        total = max(1, math.ceil(curve.total_cost()))
        yield Trace(run=record.run, x=tuple(record.x.values()), lines=tuple(best.items()), total=total)


def write_ioh(comparisons: Sequence[Comparison], folder: Path) -> list[Path]:
    """Write ``<solver>/IOHprofiler_f<k>_<problem>.json`` and a data file for each solver and problem k.

    Raises OutputError.
    """
    return [
        path
        for number, comparison in enumerate(comparisons, start=1)
        for solver in comparison.solvers
        if (runs := tuple(make_traces(solver)))
        for path in _write_log(folder / make_file_name(solver.name), number, comparison, solver.name, runs)
    ]


def _write_log(
    folder: Path, number: int, comparison: Comparison, solver: str, runs: Sequence[Trace]
) -> tuple[Path, Path]:
    stem = f"f{number}_{make_file_name(comparison.problem)}"
    dimension = int(np.max([len(record.x) for record in comparison.records], initial=1))
    data = Path(f"data_{stem}") / f"IOHprofiler_f{number}_DIM{dimension}.dat"
    lines = ["evaluations raw_y", *(f"{count} {gap!r}" for run in runs for count, gap in run.lines)]
    content: dict[str, Any] = {
        "version": IOH_VERSION,
        "suite": "nlp-gait",
        "function_id": number,
        "function_name": comparison.problem,
        "maximization": False,
        "algorithm": {"name": solver, "info": "gap to the best known objective, relative"},
        "attributes": ["evaluations", "raw_y"],
        "scenarios": [
            {
                "dimension": dimension,
                "path": data.as_posix(),
                "runs": [
                    {
                        "instance": run.run + 1,
                        "evals": run.total,
                        "best": {"evals": run.best[0], "y": run.best[1], "x": list(run.x)},
                    }
                    for run in runs
                ],
            }
        ],
    }
    path, header = folder / data, folder / f"IOHprofiler_{stem}.json"
    make_writable_folder(path.parent)
    write_text(path, "\n".join(lines) + "\n")
    write_json(header, content)
    return header, path
