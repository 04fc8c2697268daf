"""Convergence: gap to the best known over evaluations and seconds."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np

from compare.analysis.comparison import Comparison, SolverRuns
from compare.analysis.statistics.run_length import compute_band
from compare.drawing.figures import Look, add_legend_below, assign_looks, new_figure, style, use_log_axes
from nlp_gait.formulation import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Relative gaps below this are drawn at this value: solvers' tolerances are near it.
SMALLEST_GAP = 1e-8
GRID_POINTS = 300
Draw = Callable[["Axes", SolverRuns, Look, str], None]
AXES = {"evaluations": "equivalent evaluations", "seconds": "seconds of the solve"}


def plot_convergence(comparison: Comparison) -> Figure:
    """Plot bands from the least to the greatest gap of all runs, with the median, over evaluations and seconds.

    A line begins where half of the runs are feasible, a band where all are. A run of a gradient method is a point at its end.
    """
    return plot_by_cost(comparison, _draw_gaps, "gap to the best known [%]", both=True)


def plot_by_cost(comparison: Comparison, draw: Draw, words: str, both: bool = False) -> Figure:
    """Plot over evaluations and over seconds; ``draw`` receives the axes, a solver, its look and the kind of cost."""
    look = assign_looks([solver.name for solver in comparison.solvers])
    with style():
        figure = new_figure(7.4, 2.8)
        for axes, axis in zip(figure.subplots(1, 2, sharey=True), AXES, strict=True):
            for solver in comparison.solvers:
                if solver.has_costs(axis):
                    draw(axes, solver, look[solver.name], axis)
            axes.set_xlabel(AXES[axis])
            use_log_axes(axes, both)
        figure.axes[0].set_ylabel(words)
        add_legend_below(figure)
    return figure


def _draw_gaps(axes: Axes, solver: SolverRuns, look: Look, axis: str) -> None:
    if any(len(curve.gap) > 1 for curve in solver.curves):
        _draw_band(axes, solver, look, axis)
        return
    ends = [(c.total_cost(axis), float(c.gap[-1])) for c in solver.curves if len(c.gap) and np.isfinite(c.gap[-1])]
    label = f"{solver.name}, {len(ends)} of {len(solver.curves)} runs"
    cost, gap = np.array(ends).T if ends else (np.empty(0), np.empty(0))
    axes.plot(cost, clip_percent(gap), look.marker, color=look.colour, label=label, markerfacecolor="none")


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
    low, middle, high = compute_band(costs, best_so_far, grid)
    known, whole = np.isfinite(middle), np.isfinite(high)
    axes.plot(grid[known], clip_percent(middle[known]), color=look.colour, linestyle=look.line, label=label)
    axes.fill_between(
        grid[whole], clip_percent(low[whole]), clip_percent(high[whole]), color=look.colour, alpha=0.15, linewidth=0
    )


def clip_percent(gap: Array) -> Array:
    """Return the gap in percent, not below the smallest one shown."""
    return 100.0 * np.maximum(gap, SMALLEST_GAP)
