"""Table and picture of a sweep."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from compare.drawing.figures import COLOURS, new_figure, save, style
from compare.drawing.labels import axis_label, quantity
from compare.questions.sweep.study import SweepPoint
from nlp_gait.files import csv_text, write_text
from nlp_gait.problem import GaitProblem

if TYPE_CHECKING:
    from matplotlib.figure import Figure


def sweep_csv(points: Sequence[SweepPoint], problem: GaitProblem) -> str:
    """Table of all points, one row each, units in the header."""
    axes, names = list(points[0].at), list(problem.names)
    table: list[Sequence[object]] = []
    unit = problem.objective.unit
    objective = problem.objective.name + (f"_{unit}" if unit != "1" else "")
    # A variable may be an axis too; its column then says what the axis asked for, exactly.
    columns = [name for name in names if name not in axes]
    table.append([*axes, objective, "feasible", "violation", *columns, "evaluations", "time_s", "status"])
    for point in points:
        at = [repr(value) for value in point.at.values()]
        x = [repr(point.x[name]) for name in columns]
        numbers = [repr(point.objective), str(point.feasible).lower(), repr(point.violation)]
        table.append([*at, *numbers, *x, point.evaluations, f"{point.time_s:.4f}", point.status])
    return csv_text(table)


def sweep_figure(points: Sequence[SweepPoint], problem: GaitProblem, algorithm: str) -> Figure:
    """Optimum over the first axis, one line for each combination of the others; infeasible points as crosses at the bottom."""
    first, *others = points[0].at
    units = {v.name: v.unit for v in problem.variables} | {q.name: q.unit for q in problem.parameters}
    lines = dict.fromkeys(tuple(point.at[name] for name in others) for point in points)
    with style():
        import matplotlib

        shades = matplotlib.colormaps["viridis"](np.linspace(0.0, 0.85, len(lines)))
        figure = new_figure(4.2 if not others else 6.3, 3.0)
        axes = figure.subplots()
        for key, shade in zip(lines, shades, strict=True):
            line = [p for p in points if tuple(p.at[name] for name in others) == key]
            label = ", ".join(quantity(name, units[name], value) for name, value in zip(others, key, strict=True))
            values = [p.objective if p.feasible else np.nan for p in line]
            colour = shade if others else COLOURS.get(algorithm, shade)
            axes.plot([p.at[first] for p in line], values, "o-", color=colour, label=label or algorithm)
        infeasible = sorted({p.at[first] for p in points if not p.feasible})
        if infeasible:
            bottom = axes.get_xaxis_transform()
            axes.plot(
                infeasible, np.full(len(infeasible), 0.03), "x", color="0.4", label="infeasible", transform=bottom
            )
        axes.set_xlabel(axis_label(first, units[first]))
        axes.set_ylabel(
            "least " * (problem.objective.sign > 0) + axis_label(problem.objective.name, problem.objective.unit)
        )
        figure.legend(loc="outside right upper") if others else axes.legend()
    return figure


def write_sweep(folder: Path, points: Sequence[SweepPoint], problem: GaitProblem, algorithm: str) -> list[Path]:
    """Write the table and the picture of a sweep; returns their paths."""
    stem = folder / f"{problem.name}-sweep-{'-'.join(points[0].at)}-{algorithm}"
    table = stem.with_name(f"{stem.name}.csv")
    write_text(table, sweep_csv(points, problem))
    return [table, *save(sweep_figure(points, problem, algorithm), stem)]
