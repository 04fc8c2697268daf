"""Bhardwaj, Mishra, Sukavanam, Balasubramanian, reproduced: Tables III and IV, Figs. 3, 6 to 29, next to IPOPT and searches."""

from __future__ import annotations

from pathlib import Path

from compare.papers.paper_runs import run_all
from compare.papers.stairs import stairs_replay as stairs_replay
from compare.papers.stairs import stairs_runs as stairs_runs
from compare.papers.stairs.report import document
from compare.papers.stairs.stairs_runs import Effort, first_tasks, other_computations, track_tasks
from compare.papers.stairs.stairs_tables import Findings
from compare.report.writing import write_document
from compare.study.store import Store
from nlp_gait.files import writable_folder
from nlp_gait.progress import Progress

FULL = Effort()
STEPS = FULL.steps


def reproduce(out: Path, *, progress: Progress, effort: Effort = FULL) -> None:
    """Write the report (HTML, Markdown), tables (CSV) and figures (PNG, SVG).

    Args:
        out: folder; finished runs in ``out/records`` and other results in ``out/store`` are reused.
        progress: told about each run and each step, ``effort.steps`` times.
        effort: how much is computed.

    Raises:
        OutputError: the folder cannot be written to.
    """
    folder = writable_folder(out)
    runs = run_all(folder, first_tasks(effort), progress)
    runs |= run_all(folder, track_tasks(effort, runs), progress)
    todo = other_computations(effort, runs)
    results = Store(folder).compute_all(todo, code=[stairs_runs, stairs_replay], progress=progress)
    progress("figures, tables and report")
    write_document(folder, document(Findings(effort=effort, runs=runs, steps=results)))
