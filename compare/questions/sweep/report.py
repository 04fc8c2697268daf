"""A sweep as an answer: table and picture."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing

from compare.analysis.units import with_unit
from compare.drawing.figures import COLOURS, new_figure, style
from compare.drawing.labels import axis_label, quantity, units_of
from compare.questions.answer import Answer, all_digits
from compare.questions.sweep.study import SweepPoint
from compare.report.document import Figure, Table, Value, text_table
from nlp_gait.formulation import GaitProblem


def sweep_answer(points: Sequence[SweepPoint], problem: GaitProblem, algorithm: str) -> Answer:
    """Optima over the grid."""
    axes, objective = tuple(points[0].at), problem.objective
    stem = f"{problem.name}-sweep-{'-'.join(axes)}-{algorithm}"
    rows = [
        (
            *(f"{value:g}" for value in p.at.values()),
            with_unit(p.objective if p.feasible else None, objective.unit),
            p.status,
        )
        for p in points
    ]
    shown = "Optimum over the first axis; crosses where no feasible point was found."
    return Answer(
        stem=stem,
        title=f"{problem.name} by {algorithm}",
        parts=(
            text_table((*axes, objective.name, "status"), rows, "Optima"),
            Figure(name=stem, caption=shown, drawing=sweep_figure(points, problem, algorithm)),
            _numbers(stem, points, problem),
        ),
        data={"problem": problem.name, "points": [asdict(point) for point in points]},
    )


def _numbers(stem: str, points: Sequence[SweepPoint], problem: GaitProblem) -> Table:
    axes, unit = list(points[0].at), problem.objective.unit
    # A variable may be an axis too; its column then says what the axis asked for, exactly.
    columns = [name for name in problem.names if name not in axes]
    objective = problem.objective.name + (f"_{unit}" if unit != "1" else "")
    taken = {*axes, *columns}
    verdict, cost = (
        [
            f"run_{name}" if name in taken else name for name in names
        ]  # a problem of one's own may have a variable time_s
        for names in ((objective, "feasible", "violation"), ("evaluations", "time_s", "status"))
    )
    header = [*axes, *verdict, *columns, *cost]
    rows: list[list[Value]] = [
        [
            *(*p.at.values(), p.objective, p.feasible, p.violation),
            *(p.x[name] for name in columns),
            *(p.evaluations, f"{p.time_s:.4f}", p.status),
        ]
        for p in points
    ]
    return all_digits(stem, header, rows)


def sweep_figure(points: Sequence[SweepPoint], problem: GaitProblem, algorithm: str) -> Drawing:
    """Optimum over the first axis, one line for each combination of the others; infeasible points as crosses at the bottom."""
    first, *others = points[0].at
    units, objective = units_of(problem), problem.objective
    lines = dict.fromkeys(tuple(point.at[name] for name in others) for point in points)
    with style():
        shades = matplotlib.colormaps["viridis"](np.linspace(0.0, 0.85, len(lines)))
        figure = new_figure(4.2 if not others else 6.3, 3.0)
        axes = figure.subplots()
        for key, shade in zip(lines, shades, strict=True):
            line = [p for p in points if tuple(p.at[name] for name in others) == key]
            label = ", ".join(quantity(name, units[name], value) for name, value in zip(others, key, strict=True))
            values = [p.objective if p.feasible else np.nan for p in line]
            colour = shade if others else COLOURS.get(algorithm, shade)
            axes.plot([p.at[first] for p in line], values, "o-", color=colour, label=label or algorithm)
        mark(axes, sorted({p.at[first] for p in points if not p.feasible}), "infeasible")
        axes.set_xlabel(axis_label(first, units[first]))
        axes.set_ylabel("least " * (objective.sign > 0) + axis_label(objective.name, objective.unit))
        figure.legend(loc="outside right upper") if others else axes.legend()
    return figure


def mark(axes: Axes, at: Sequence[float], label: str, marker: str = "x", colour: str = "0.4", up: float = 0.03) -> None:
    """Marks at some values of x, at a share ``up`` of the axes' height; nothing for no values."""
    if at:
        place = axes.get_xaxis_transform()
        axes.plot(at, np.full(len(at), up), marker, color=colour, label=label, transform=place)
