"""Table and picture of a front of power against one criterion, with what the searches found."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from compare.drawing.figures import COLOURS, new_figure, save, style
from compare.drawing.labels import axis_label
from compare.questions.pareto.criteria import Criterion
from compare.questions.pareto.front import FrontPoint
from compare.questions.pareto.knees import Bends
from compare.questions.pareto.search import SearchFront
from nlp_gait.files import csv_text, write_text
from nlp_gait.problem import GaitProblem

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SEARCH_COLOURS = {"NSGA2": COLOURS["ga"], "CMOPSO": COLOURS["pso"]}
SEARCH_NAMES = {"NSGA2": "NSGA-II", "CMOPSO": "CMOPSO"}
MARKS = ("x", "+", ".")


def front_csv(front: Sequence[FrontPoint], problem: GaitProblem, criterion: Criterion) -> str:
    """Table of a front, one row a point, units in the header."""
    table: list[Sequence[object]] = []
    unit = criterion.unit.replace("/", "_")
    table.append([f"{criterion.name}_{unit}", "power_W", f"price_W_per_{unit}", "violation", *problem.names])
    for point in front:
        numbers = (point.value, point.power_W, point.price, point.violation, *point.x)
        table.append([repr(number) for number in numbers])
    return csv_text(table)


def front_figure(
    front: Sequence[FrontPoint],
    bent: Bends,
    searches: Sequence[SearchFront],
    problem: GaitProblem,
    criterion: Criterion,
) -> Figure:
    """The front as a line with its knees, and on the right its lower part; what searches found as points."""
    with style():
        figure = new_figure(7.2, 3.3)
        left, right = figure.subplots(1, 2)
        for axes in (left, right):
            _draw(axes, front, bent, searches)
            axes.set_xlabel(axis_label(criterion.name, criterion.unit))
            axes.locator_params(axis="x", nbins=6)
        left.set_ylabel("power [W]")
        values, powers = (np.array([getattr(p, key) for p in front]) for key in ("value", "power_W"))
        left.set_xlim(values[0] - 0.03 * np.ptp(values), values[-1] + 0.03 * np.ptp(values))
        left.set_ylim(0.0, powers[-1] * 1.06)
        first = bent.knees[0] if bent.knees else None
        end = values[0] + 0.5 * np.ptp(values) if first is None else first.value + 0.08 * np.ptp(values)
        top = float(np.interp(end, values, powers))
        right.set_xlim(values[0] - 0.03 * (end - values[0]), end)
        right.set_ylim(powers[0] - 0.08 * (top - powers[0]), top)
        right.set_title("the front's cheap part", loc="left")
        demanded = criterion.demanded(problem)
        if values[0] < demanded < values[-1]:
            for axes in (left, right):
                axes.axvline(
                    demanded, color="0.6", linestyle=":", linewidth=1.0, label="demanded in the paper's problem"
                )
        handles, labels = left.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=2)
        figure.set_figheight(3.3 + 0.19 * -(-len(labels) // 2))
    return figure


def _draw(axes: Axes, front: Sequence[FrontPoint], bent: Bends, searches: Sequence[SearchFront]) -> None:
    budgets = sorted({f.budget for f in searches})
    for algorithm, budget in sorted({(f.algorithm, f.budget) for f in searches}):
        chosen = [f for f in searches if (f.algorithm, f.budget) == (algorithm, budget)]
        values, powers = (np.concatenate([getattr(f, key) for f in chosen]) for key in ("values", "powers"))
        axes.plot(
            values,
            powers,
            MARKS[budgets.index(budget) % len(MARKS)],
            color=SEARCH_COLOURS[algorithm],
            markersize=2.5,
            markeredgewidth=0.5,
            alpha=0.45,
            label=f"{SEARCH_NAMES[algorithm]}, {budget:,} evaluations, {len(chosen)} runs",
            rasterized=True,
        )
    line = [(p.value, p.power_W) for p in front]
    axes.plot(*zip(*line, strict=True), "-", color=COLOURS["ipopt"], label=f"IPOPT, {len(front)} points")
    if bent.knees:
        axes.plot(
            [k.value for k in bent.knees],
            [k.power_W for k in bent.knees],
            "o",
            color="none",
            markeredgecolor=COLOURS["aco"],
            markersize=9,
            markeredgewidth=1.6,
            label="knee",
        )


def write_front(
    folder: Path,
    front: Sequence[FrontPoint],
    bent: Bends,
    searches: Sequence[SearchFront],
    problem: GaitProblem,
    criterion: Criterion,
) -> list[Path]:
    """Write the table and the picture of a front; returns their paths."""
    stem = folder / f"{problem.name}-front-{criterion.name}"
    table = stem.with_name(f"{stem.name}.csv")
    write_text(table, front_csv(front, problem, criterion))
    return [table, *save(front_figure(front, bent, searches, problem, criterion), stem)]
