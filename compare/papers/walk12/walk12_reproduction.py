"""Goswami, Vadakkepat, Phung (2008), reproduced: Tables III and IV, Figs. 8 to 10 and 12 to 17, the trade-off, a circle."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from compare.papers.paper_runs import point, run_all
from compare.papers.walk12 import walk12_runs as walk12_runs
from compare.papers.walk12.report import document
from compare.papers.walk12.walk12_figures import TURN_RAD, TURNING_WEIGHT
from compare.papers.walk12.walk12_runs import PAPER, Effort, PathPoint, first_tasks, paths, second_tasks
from compare.papers.walk12.walk12_tables import Findings
from compare.report.document import Table
from compare.report.writing import write_document, write_parts
from compare.study.store import Store
from nlp_gait.files import writable_folder
from nlp_gait.gaits.walk12.locomotion import JOINTS, locomotion
from nlp_gait.gaits.walk12.robot import point_mass_biped
from nlp_gait.progress import Progress

FULL = Effort()
STEPS = FULL.steps


def reproduce(out: Path, *, progress: Progress, effort: Effort = FULL) -> None:
    """Write the report (HTML, Markdown), tables and joint trajectories (CSV), and figures (PNG, SVG).

    Args:
        out: folder; finished runs in ``out/records`` and paths in ``out/store`` are reused.
        progress: told about each run and each step, ``effort.steps`` times.
        effort: how much is computed.

    Raises:
        OutputError: the folder cannot be written to.
    """
    folder = writable_folder(out)
    runs = run_all(folder, first_tasks(effort), progress)
    runs |= run_all(folder, second_tasks(effort, runs), progress)
    results = Store(folder).compute_all(paths(effort), code=[walk12_runs], progress=progress)
    weighted, front = ([PathPoint(**row) for row in rows] for rows in results.values())
    findings = Findings(runs=runs, weighted=weighted, front=front)
    progress("figures, tables and report")
    write_document(folder, document(findings, effort))
    write_parts(folder, [_trajectory("walk-straight", findings, 0.15, 0.0)])
    write_parts(folder, [_trajectory("walk-circle", findings, TURNING_WEIGHT, TURN_RAD)])


def _trajectory(name: str, findings: Findings, weight: float, turn_rad: float) -> Table:
    """Two steps of IPOPT's gait at a lambda."""
    x = np.array(point(findings.optimum(PAPER, weight)))
    arrays = locomotion(point_mass_biped(), x, intervals=50, turn_rad=turn_rad).arrays
    header = ["t_s", *(f"{joint}_rad" for joint in JOINTS), "zmp_x_m", "zmp_y_m", "left_stance"]
    rows = np.column_stack([arrays[name] for name in ("t", "q", "zmp", "left_stance")]).tolist()
    return Table(name=name, columns=dict.fromkeys(header, ""), rows=rows)
