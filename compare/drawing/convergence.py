"""Convergence: gap to the best known, against evaluations and against seconds."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from compare.analysis.comparison import Comparison, SolverRuns
from compare.analysis.statistics.distribution import band
from compare.drawing.figures import Look, legend_below, logarithmic, looks, new_figure, style
from nlp_gait.formulation import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Relative gaps below this are drawn at this value: both solvers' tolerances end near it.
SMALLEST_GAP = 1e-8
GRID_POINTS = 300
Draw = Callable[["Axes", SolverRuns, Look, str], None]
AXES = {"evaluations": "equivalent evaluations", "seconds": "seconds of the solve"}


def convergence_figure(comparison: Comparison) -> Figure:
    """Bands from the least to the greatest gap of all runs, with the median; against evaluations and seconds.

    A line begins where half of the runs are feasible, a band where all are. A gradient method is known at its ends only:
    its runs are points, at what all their calls cost.
    """
    return cost_figure(comparison, _draw_gaps, "gap to the best known [%]", both=True)


def cost_figure(comparison: Comparison, draw: Draw, words: str, both: bool = False) -> Figure:
    """Axes of evaluations and of seconds; ``draw`` gets the axes, a solver, its look, and which of both the costs are."""
    look = looks([solver.name for solver in comparison.solvers])
    with style():
        figure = new_figure(7.4, 2.8)
        for axes, axis in zip(figure.subplots(1, 2, sharey=True), AXES, strict=True):
            for solver in comparison.solvers:
                if solver.knows(axis):
                    draw(axes, solver, look[solver.name], axis)
            axes.set_xlabel(AXES[axis])
            logarithmic(axes, both)
        figure.axes[0].set_ylabel(words)
        legend_below(figure)
    return figure


def _draw_gaps(axes: Axes, solver: SolverRuns, look: Look, axis: str) -> None:
    if any(len(curve.gap) > 1 for curve in solver.curves):
        _draw_band(axes, solver, look, axis)
        return
    ends = [(c.total(axis), float(c.gap[-1])) for c in solver.curves if len(c.gap) and np.isfinite(c.gap[-1])]
    label = f"{solver.name}, {len(ends)} of {len(solver.curves)} runs"
    cost, gap = np.array(ends).T if ends else (np.empty(0), np.empty(0))
    axes.plot(cost, shown_percent(gap), look.marker, color=look.colour, label=label, markerfacecolor="none")


def _draw_band(axes: Axes, solver: SolverRuns, look: Look, axis: str) -> None:
    costs = [getattr(c, axis) for c in solver.curves]
    used = np.concatenate(costs)
    used = used[used > 0.0]
    label = f"{solver.name}, {len(costs)} runs"
    if not used.size:
        axes.plot([], [], color=look.colour, linestyle=look.line, label=label)
        return
    grid = np.geomspace(used.min(), used.max(), GRID_POINTS)
    best_so_far = [np.minimum.accumulate(c.gap) for c in solver.curves]
    low, middle, high = band(costs, best_so_far, grid)
    known, whole = np.isfinite(middle), np.isfinite(high)
    axes.plot(grid[known], shown_percent(middle[known]), color=look.colour, linestyle=look.line, label=label)
    axes.fill_between(
        grid[whole], shown_percent(low[whole]), shown_percent(high[whole]), color=look.colour, alpha=0.15, linewidth=0
    )


def shown_percent(gap: Array) -> Array:
    """Gap in percent, drawn no lower than the smallest one."""
    return 100.0 * np.maximum(gap, SMALLEST_GAP)
