"""Goswami, Vadakkepat, Phung (2008), reproduced: Tables III and IV, Figs. 8 to 10 and 12 to 17, the trade-off, a circle."""

from __future__ import annotations

import math
from collections.abc import Callable
from pathlib import Path

import numpy as np

from compare.drawing.figures import save
from compare.papers.tables import write_csv
from compare.papers.walk12 import errata as walk12_errata
from compare.papers.walk12 import figures
from compare.papers.walk12 import runs as walk12_runs
from compare.papers.walk12.paper import F1MAX, TABLE_3, row_of
from compare.papers.walk12.report import write_report
from compare.papers.walk12.runs import (
    FRONT_LENGTHS_M,
    HORIZONS,
    STARTS,
    SWEEP_WEIGHTS,
    front,
    model_f1max,
    table_3_runs,
    table_4_runs,
    walk,
    weighted_sum,
)
from compare.papers.walk12.tables import MODEL, PAPER, Findings
from compare.study.steps import Steps, fingerprint
from nlp_gait.files import writable_folder
from nlp_gait.problems.walk12.locomotion import JOINTS, locomotion
from nlp_gait.problems.walk12.robot import point_mass_biped

TURN_RAD = math.radians(8.0)  # the largest that the paper allows
TURNING_WEIGHT = 0.9  # on circles the paper keeps lambda >= 0.7
ZMP_FIGURES = {"fig12-13": 0.15, "fig14-15": 1.0, "fig16-17": 0.1}

STEPS = (
    2 * 3 * len(TABLE_3) + 6
)  # three solvers at each lambda under both normalisations, and six more, the writing included


def reproduce(out: Path, *, progress: Callable[[str], None]) -> None:
    """Write tables (Markdown, CSV), figures (PNG, SVG), joint trajectories (CSV) and ``report.md``.

    Args:
        out: folder; results of finished steps are kept in ``out/steps`` and used again.
        progress: told about each step, ``STEPS`` times.

    Raises:
        OutputError: the folder cannot be written to.
    """
    folder = writable_folder(out)
    steps = Steps(folder, progress, code=(walk12_runs, walk12_errata))
    inputs = {**fingerprint(walk()), "starts": STARTS}
    readings = [fingerprint(walk(zmp=reading)) for reading in ("appendix", "appendix-as-printed", "moment-free")]
    own_f1max = float(steps("model-f1max", inputs, lambda: model_f1max(walk())))
    findings = Findings(
        own_f1max=own_f1max,
        table_3={
            label: [table_3_runs(steps, label, row.weight, f1max) for row in TABLE_3]
            for label, f1max in ((PAPER, F1MAX), (MODEL, own_f1max))
        },
        table_4=steps("table4", {**inputs, "horizons": [fingerprint(walk(h)) for h in HORIZONS]}, table_4_runs),
        weighted=steps("weighted-sum", {**inputs, "weights": SWEEP_WEIGHTS}, lambda: weighted_sum(F1MAX)),
        front=steps("front", {**inputs, "lengths_m": FRONT_LENGTHS_M}, front),
        errata=steps("errata", {**inputs, "readings": readings}, walk12_errata.errata),
    )
    progress("figures, tables and report")
    _figures(folder, findings)
    _trajectories(folder, findings)
    write_report(folder, findings)


def _figures(folder: Path, findings: Findings) -> None:
    runs = findings.runs(PAPER, 0.15)
    save(figures.fitness_figure(runs["ga"], runs["ipopt"]), folder / "fig08")
    gaits = _gaits(findings, 0.15)
    save(figures.angles_figure(gaits, figures.FIGURE_9), folder / "fig09")
    save(figures.angles_figure(gaits, figures.FIGURE_10), folder / "fig10")
    for name, weight in ZMP_FIGURES.items():
        save(figures.zmp_figure(_gaits(findings, weight)), folder / name)
    save(figures.tradeoff_figure(findings.front, findings.weighted), folder / "tradeoff")
    turning = findings.runs(PAPER, TURNING_WEIGHT)["ipopt"]["x"]
    save(figures.circle_figure(turning, TURN_RAD), folder / "circle")


def _gaits(findings: Findings, weight: float) -> figures.Gaits:
    """The paper's gait and IPOPT's at a lambda, by label."""
    return {"paper's gait": row_of(weight).x, "IPOPT": findings.runs(PAPER, weight)["ipopt"]["x"]}


def _trajectories(folder: Path, findings: Findings) -> None:
    """Two steps of IPOPT's gaits as CSV: straight, and on a circle."""
    for name, weight, turn in (("walk-straight", 0.15, 0.0), ("walk-circle", TURNING_WEIGHT, TURN_RAD)):
        x = np.array(findings.runs(PAPER, weight)["ipopt"]["x"])
        arrays = locomotion(point_mass_biped(), x, intervals=50, turn_rad=turn).arrays
        header = ["t_s", *(f"{joint}_rad" for joint in JOINTS), "zmp_x_m", "zmp_y_m", "left_stance"]
        table = np.column_stack([arrays[name] for name in ("t", "q", "zmp", "left_stance")])
        write_csv(folder / f"{name}.csv", header, table.tolist())
