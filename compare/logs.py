"""Runs as the logs that other packages read: IOHprofiler's JSON, and the files of COCO.

The logged value is the relative gap to the best known objective, positive if worse, and ``NOTHING_FEASIBLE`` before the first
feasible point. Evaluations are equivalent ones, in which derivatives count as forward differences would.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from compare.analysis.comparison import Comparison, SolverRuns
from nlp_gait.files import make_file_name, make_writable_folder, write_json, write_text

__all__ = ["NOTHING_FEASIBLE", "Trace", "make_traces", "write_coco", "write_ioh"]

# Gap before the first feasible point: formats of unconstrained benchmarks have no value for it.
NOTHING_FEASIBLE = 1e10
# Smallest gap: readers take logarithms.
SMALLEST = 1e-12
IOH_VERSION = "0.3.18"  # of ioh, whose layout is written
COCO_PRECISION = 1e-8
# Before each run, as in COCO; the gap of the optimum is zero.
COCO_HEADER = (
    "% f evaluations | g evaluations | best noise-free fitness - Fopt (0.000000000000e+00) + sum g_i+ | measured fitness | "
    "best measured fitness or single-digit g-values"
)


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


def write_ioh(comparisons: Sequence[Comparison], folder: Path, suite: str = "nlp-gait") -> list[Path]:
    """Write ``<solver>/IOHprofiler_f<k>_<problem>.json`` and a data file for each solver and problem; see ``_write_logs``."""
    return _write_logs(comparisons, folder, partial(_write_ioh, suite))


def write_coco(comparisons: Sequence[Comparison], folder: Path, suite: str = "nlp-gait") -> list[Path]:
    """Write ``<solver>/f<k>_<problem>.info`` and a data file for each solver and problem; see ``_write_logs``."""
    return _write_logs(comparisons, folder, partial(_write_coco, suite))


@dataclass(frozen=True, kw_only=True)
class _Log:
    """Runs of one solver on one problem."""

    folder: Path
    stem: str  #: of the files' names
    number: int  #: of the problem, a function in these formats
    problem: str
    dimension: int  #: number of variables; 1 if no run has a point
    solver: str
    runs: tuple[Trace, ...]  #: traces of all runs


def _write_logs(comparisons: Sequence[Comparison], folder: Path, write: Callable[[_Log], Sequence[Path]]) -> list[Path]:
    """Write the log of each solver with known evaluations on each problem, problem k as function k, from 1; return all files.

    Raises OutputError.
    """
    return [
        path
        for number, comparison in enumerate(comparisons, start=1)
        for solver in comparison.solvers
        if (runs := tuple(make_traces(solver)))
        for path in write(
            _Log(
                folder=folder / make_file_name(solver.name),
                stem=f"f{number}_{make_file_name(comparison.problem)}",
                number=number,
                problem=comparison.problem,
                dimension=int(np.max([len(record.x) for record in comparison.records], initial=1)),
                solver=solver.name,
                runs=runs,
            )
        )
    ]


def _write_ioh(suite: str, log: _Log) -> tuple[Path, Path]:
    data = Path(f"data_{log.stem}") / f"IOHprofiler_f{log.number}_DIM{log.dimension}.dat"
    lines = ["evaluations raw_y", *(f"{at} {gap!r}" for run in log.runs for at, gap in run.lines)]
    content: dict[str, Any] = {
        "version": IOH_VERSION,
        "suite": suite,
        "function_id": log.number,
        "function_name": log.problem,
        "maximization": False,
        "algorithm": {"name": log.solver, "info": "gap to the best known objective, relative"},
        "attributes": ["evaluations", "raw_y"],
        "scenarios": [
            {
                "dimension": log.dimension,
                "path": data.as_posix(),
                "runs": [
                    {
                        "instance": run.run + 1,
                        "evals": run.total,
                        "best": {"evals": run.best[0], "y": run.best[1], "x": list(run.x)},
                    }
                    for run in log.runs
                ],
            }
        ],
    }
    path, header = _write_data(log, data, lines), log.folder / f"IOHprofiler_{log.stem}.json"
    write_json(header, content)
    return header, path


def _write_coco(suite: str, log: _Log) -> tuple[Path, Path]:
    data = Path(f"data_{log.stem}") / f"bbobexp_f{log.number}_DIM{log.dimension}.dat"
    lines: list[str] = []
    for run in log.runs:
        lines.append(COCO_HEADER)
        lines += [f"{at} {at} {gap!r} {gap!r} {gap!r}" for at, gap in run.lines]
        if run.total > run.best[0]:  # COCO ends each run with its last evaluation
            lines.append(f"{run.total} {run.total} {run.best[1]!r} {run.best[1]!r} {run.best[1]!r}")
    ends = ", ".join(f"{run.run + 1}:{run.total}|{run.best[1]:.6e}" for run in log.runs)
    path, info = _write_data(log, data, lines), log.folder / f"{log.stem}.info"
    write_text(
        info,
        f"suite = '{suite}', funcId = {log.number}, DIM = {log.dimension}, Precision = {COCO_PRECISION:.3e}, "
        f"algId = '{log.solver}', coco_version = '', logger = 'bbob', data_format = 'bbob-new2'\n"
        f"% {log.problem}: relative gap to the best known objective, written by nlp-gait\n"
        f"{data.as_posix()}, {ends}\n",
    )
    return info, path


def _write_data(log: _Log, data: Path, lines: Sequence[str]) -> Path:
    path = log.folder / data
    make_writable_folder(path.parent)
    write_text(path, "\n".join(lines) + "\n")
    return path
