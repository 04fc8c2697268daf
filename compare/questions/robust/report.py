"""Table and picture of robust optima."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from compare.drawing.figures import legend_below, new_figure, save, style
from compare.questions.robust.playback import Played
from compare.questions.robust.study import Robust
from nlp_gait.files import csv_text, write_text

if TYPE_CHECKING:
    from matplotlib.figure import Figure

NOMINAL, ROBUST = "0.72", "#0072B2"


def robust_csv(found: Sequence[Robust]) -> str:
    """One row for each box."""
    table: list[Sequence[object]] = []
    names = list(found[0].x)
    table.append(
        ["uncertain", "scenarios", "nominal_W", "violation_of_nominal", "unit", "row", "robust_W", "robust_worst_W"]
        + ["violation_of_robust", "violation_of_robust_in_random_corners", *names, "settled"]
    )
    for r in found:
        nominal = (repr(r.nominal_W), repr(r.nominal_worst.violation), r.nominal_worst.unit, r.nominal_worst.row)
        own = (r.power_W, r.worst_W, r.worst.violation, r.random_worst.violation, *r.x.values())
        table.append([r.name, len(r.corners), *nominal, *map(repr, own), str(r.settled).lower()])
    return csv_text(table)


def robust_figure(found: Sequence[Robust], runs: Sequence[Played]) -> Figure:
    """Left: power with the nominal robot and in the worst corner. Right: lateral margins in model and engine, if played."""
    with style():
        figure = new_figure(7.2 if runs else 4.2, 2.7)
        grid = figure.subplots(1, 2 if runs else 1, squeeze=False, width_ratios=(1.15, 1.0) if runs else None)
        left, *others = grid[0]
        names = ["none", *(r.name for r in found)]
        places = np.arange(len(names))
        left.barh(places - 0.19, [r.power_W for r in _with_nominal(found)], 0.36, color=ROBUST, label="nominal robot")
        left.barh(places + 0.19, [r.worst_W for r in _with_nominal(found)], 0.36, color="#D55E00", label="worst corner")
        left.set_yticks(places, names)
        left.invert_yaxis()
        left.grid(visible=False, axis="y")
        left.set_xlim(left=0.8 * found[0].nominal_W)
        left.set_xlabel("power [W], axis cut off")
        left.set_title("uncertain")
        legend_below(figure)
        for axes in others:
            for gait, colour, marker in (("nominal", NOMINAL, "s"), ("robust", ROBUST, "o")):
                own = [run for run in runs if run.gait == gait]
                at = [1000 * run.predicted_margin_m for run in own], [1000 * run.margin_m for run in own]
                axes.plot(*at, marker, color=colour, label=f"{gait} gait")
            low, high = axes.get_xlim()
            axes.plot((low, high), (low, high), color="0.4", linewidth=0.6)
            axes.set_xlabel("mean lateral margin in the model [mm]")
            axes.set_ylabel("in MuJoCo [mm]")
            axes.legend()
    return figure


class _Nominal:
    """The nominal optimum as the first pair of bars."""

    def __init__(self, power_W: float) -> None:
        self.power_W = self.worst_W = power_W


def _with_nominal(found: Sequence[Robust]) -> list[Robust | _Nominal]:
    return [_Nominal(found[0].nominal_W), *found]


def write_robust(folder: Path, problem: str, found: Sequence[Robust], runs: Sequence[Played]) -> list[Path]:
    """Write table and picture; returns their paths."""
    stem = folder / f"{problem}-robust"
    table = stem.with_name(f"{stem.name}.csv")
    write_text(table, robust_csv(found))
    return [table, *save(robust_figure(found, runs), stem)]
