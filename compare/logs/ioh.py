"""IOHprofiler's JSON and data files, as ``ioh`` writes them and ``iohinspector`` and IOHanalyzer read them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from compare.analysis.comparison import Comparison, SolverRuns
from compare.logs.trace import Trace, dimension, file_safe, traces
from nlp_gait.files import writable_folder, write_json, write_text

VERSION = "0.3.18"  # of ioh, whose layout this is


def write_ioh(comparisons: Sequence[Comparison], folder: Path, suite: str = "nlp-gait") -> list[Path]:
    """Write ``<solver>/IOHprofiler_f<k>_<problem>.json`` and its data file for each solver and problem; returns the files.

    Args:
        comparisons: one a problem; problem k is function k, from 1.
        folder: gets a folder for each solver.
        suite: name.

    Raises:
        OutputError: the folder cannot be written to.
    """
    return [
        path
        for number, comparison in enumerate(comparisons, start=1)
        for solver in comparison.solvers
        for path in _write(folder / file_safe(solver.name), number, comparison, solver, suite)
    ]


def _write(folder: Path, number: int, comparison: Comparison, solver: SolverRuns, suite: str) -> tuple[Path, Path]:
    n, stem = dimension(comparison), f"f{number}_{file_safe(comparison.problem)}"
    runs = list(traces(solver))
    data = Path(f"data_{stem}") / f"IOHprofiler_f{number}_DIM{n}.dat"
    path = folder / data
    writable_folder(path.parent)
    lines = ["evaluations raw_y", *(f"{at} {gap!r}" for run in runs for at, gap in run.lines)]
    write_text(path, "\n".join(lines) + "\n")
    header = folder / f"IOHprofiler_{stem}.json"
    write_json(
        header,
        {
            "version": VERSION,
            "suite": suite,
            "function_id": number,
            "function_name": comparison.problem,
            "maximization": False,
            "algorithm": {"name": solver.name, "info": "gap to the best known objective, relative"},
            "attributes": ["evaluations", "raw_y"],
            "scenarios": [{"dimension": n, "path": data.as_posix(), "runs": [_run(run) for run in runs]}],
        },
    )
    return header, path


def _run(trace: Trace) -> dict[str, Any]:
    evaluations, gap = trace.best
    return {
        "instance": trace.run + 1,
        "evals": trace.total,
        "best": {"evals": evaluations, "y": gap, "x": list(trace.x)},
    }
