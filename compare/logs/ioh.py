"""IOHprofiler's JSON and data files, as ``ioh`` writes them and ``iohinspector`` and IOHanalyzer read them."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path
from typing import Any

from compare.analysis.comparison import Comparison
from compare.logs.trace import Log, Trace, write_logs
from nlp_gait.files import make_writable_folder, write_json, write_text

VERSION = "0.3.18"  # of ioh, whose layout this is


def write_ioh(comparisons: Sequence[Comparison], folder: Path, suite: str = "nlp-gait") -> list[Path]:
    """Write ``<solver>/IOHprofiler_f<k>_<problem>.json`` and its data file for each solver and problem; see ``write_logs``."""
    return write_logs(comparisons, folder, partial(_write, suite))


def _write(suite: str, log: Log) -> tuple[Path, Path]:
    data = Path(f"data_{log.stem}") / f"IOHprofiler_f{log.number}_DIM{log.dimension}.dat"
    path = log.folder / data
    make_writable_folder(path.parent)
    lines = ["evaluations raw_y", *(f"{at} {gap!r}" for run in log.runs for at, gap in run.lines)]
    write_text(path, "\n".join(lines) + "\n")
    header = log.folder / f"IOHprofiler_{log.stem}.json"
    write_json(
        header,
        {
            "version": VERSION,
            "suite": suite,
            "function_id": log.number,
            "function_name": log.problem,
            "maximization": False,
            "algorithm": {"name": log.solver, "info": "gap to the best known objective, relative"},
            "attributes": ["evaluations", "raw_y"],
            "scenarios": [
                {"dimension": log.dimension, "path": data.as_posix(), "runs": [_run(run) for run in log.runs]}
            ],
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
