"""Table and picture of the motors' variants."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from compare.drawing.figures import legend_below, new_figure, save, style
from compare.drawing.labels import axis_label
from compare.questions.motors.study import Variant
from nlp_gait.files import csv_text, write_text
from nlp_gait.problem import GaitProblem

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def motors_csv(found: Sequence[Variant]) -> str:
    """One row for each variant."""
    table: list[Sequence[object]] = []
    names, kinds = list(found[0].x), list(found[0].uses)
    table.append(
        ["variant", "motors", "power_W", "power_at_published_x_W", "violation_of_published_x", "power_as_published_W"]
        + [*names, *(f"share_of_{kind.replace(' ', '_')}" for kind in kinds), "success", "status"]
    )
    for v in found:
        numbers = (v.power_W, v.unchanged_power_W, v.unchanged_violation, v.published_power_W, *v.x.values())
        shares = [repr(v.uses[kind].share) for kind in kinds]
        table.append([v.name, v.features, *map(repr, numbers), *shares, str(v.success).lower(), v.status])
    return csv_text(table)


def motors_figure(found: Sequence[Variant], problem: GaitProblem) -> Figure:
    """Left: power at the optimum and at the published one. Right: where x* lies in its ranges."""
    places = np.arange(len(found))
    with style():
        figure = new_figure(7.6, 0.9 + 0.34 * len(found))
        left, right = figure.subplots(1, 2, width_ratios=(1.0, 1.15))
        left.barh(places - 0.19, [v.unchanged_power_W for v in found], 0.36, color="0.75", label="at the published x*")
        left.barh(places + 0.19, [v.power_W for v in found], 0.36, color="#0072B2", label="at the optimum")
        left.set_yticks(places, [v.name for v in found])
        left.invert_yaxis()
        left.grid(visible=False, axis="y")
        left.set_xlabel(axis_label("power", "W"))
        legend_below(figure)
        shares = np.array([(np.array(list(v.x.values())) - problem.lower) / problem.scale for v in found])
        image = right.imshow(shares, aspect="auto", cmap="viridis", vmin=0.0, vmax=1.0)
        units = {v.name: v.unit for v in problem.variables}
        words = [axis_label(name, units[name]).split(" [")[0] for name in problem.names]
        right.set_xticks(range(len(words)), words, rotation=40, ha="right")
        right.set_yticks([])
        right.grid(visible=False)
        figure.colorbar(image, ax=right, label="x* from lower to upper bound")
    return figure


def write_motors(folder: Path, found: Sequence[Variant], problem: GaitProblem) -> list[Path]:
    """Write table and picture; returns their paths."""
    stem = folder / f"{problem.name}-motors"
    table = stem.with_name(f"{stem.name}.csv")
    write_text(table, motors_csv(found))
    return [table, *save(motors_figure(found, problem), stem)]
