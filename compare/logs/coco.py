"""Data like that of COCO's bbob logger: an ``.info`` file for each solver and problem, and its ``.dat`` file."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial
from pathlib import Path

from compare.analysis.comparison import Comparison
from compare.logs.trace import Log, write_logs
from nlp_gait.files import make_writable_folder, write_text

PRECISION = 1e-8
# Before each run, as COCO has it; the optimum's gap is zero.
HEADER = (
    "% f evaluations | g evaluations | best noise-free fitness - Fopt (0.000000000000e+00) + sum g_i+ | measured fitness | "
    "best measured fitness or single-digit g-values"
)


def write_coco(comparisons: Sequence[Comparison], folder: Path, suite: str = "nlp-gait") -> list[Path]:
    """Write ``<solver>/f<k>_<problem>.info`` and its data file for each solver and problem; see ``write_logs``."""
    return write_logs(comparisons, folder, partial(_write, suite))


def _write(suite: str, log: Log) -> tuple[Path, Path]:
    data = Path(f"data_{log.stem}") / f"bbobexp_f{log.number}_DIM{log.dimension}.dat"
    path = log.folder / data
    make_writable_folder(path.parent)
    lines: list[str] = []
    for run in log.runs:
        lines.append(HEADER)
        lines += [f"{at} {at} {gap!r} {gap!r} {gap!r}" for at, gap in run.lines]
        if run.total > run.best[0]:  # COCO ends each run with its last evaluation
            lines.append(f"{run.total} {run.total} {run.best[1]!r} {run.best[1]!r} {run.best[1]!r}")
    write_text(path, "\n".join(lines) + "\n")
    info = log.folder / f"{log.stem}.info"
    ends = ", ".join(f"{run.run + 1}:{run.total}|{run.best[1]:.6e}" for run in log.runs)
    write_text(
        info,
        f"suite = '{suite}', funcId = {log.number}, DIM = {log.dimension}, Precision = {PRECISION:.3e}, "
        f"algId = '{log.solver}', coco_version = '', logger = 'bbob', data_format = 'bbob-new2'\n"
        f"% {log.problem}: relative gap to the best known objective, written by nlp-gait\n"
        f"{data.as_posix()}, {ends}\n",
    )
    return info, path
