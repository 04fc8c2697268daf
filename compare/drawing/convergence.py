"""Convergence: gap to the best known, against evaluations and against seconds."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from compare.analysis.comparison import Comparison, SolverRuns
from compare.analysis.statistics.distribution import band
from compare.drawing.figures import Look, legend_below, logarithmic, looks, new_figure, style

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Relative gaps below this are drawn at this value: both solvers' tolerances end near it.
SMALLEST_GAP = 1e-8
GRID_POINTS = 300
AXES = {"evaluations": "equivalent evaluations", "seconds": "seconds of the solve"}


def convergence_figure(comparison: Comparison) -> Figure:
    """Bands from the least to the greatest gap of all runs, with the median; against evaluations and seconds.

    A line begins where half of the runs are feasible, a band where all are. A gradient method is known at its ends only:
    its runs are points, at what all their calls cost.
    """
    with style():
        figure = new_figure(7.4, 2.8)
        for axes, axis in zip(figure.subplots(1, 2, sharey=True), AXES, strict=True):
            for solver, look in zip(comparison.solvers, looks([s.name for s in comparison.solvers]), strict=True):
                if all(len(c.gap) <= 1 for c in solver.curves):
                    _draw_ends(axes, solver, look, axis)
                else:
                    _draw_band(axes, solver, look, axis)
            axes.set_xlabel(AXES[axis])
            logarithmic(axes, both=True)
        figure.axes[0].set_ylabel("gap to the best known [%]")
        legend_below(figure)
    return figure


def _draw_ends(axes: Axes, solver: SolverRuns, look: Look, axis: str) -> None:
    ends = [(c.total(axis), float(c.gap[-1])) for c in solver.curves if len(c.gap) and np.isfinite(c.gap[-1])]
    label = f"{solver.name}, {len(ends)} of {len(solver.curves)} runs"
    cost, gap = np.array(ends).T if ends else (np.empty(0), np.empty(0))
    axes.plot(cost, _shown(gap), look.marker, color=look.colour, label=label, markerfacecolor="none")


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
    axes.plot(grid[known], _shown(middle[known]), color=look.colour, linestyle=look.line, label=label)
    axes.fill_between(grid[whole], _shown(low[whole]), _shown(high[whole]), color=look.colour, alpha=0.15, linewidth=0)


def _shown(gap: np.ndarray) -> np.ndarray:
    """Gap in percent, drawn no lower than the smallest one."""
    return 100.0 * np.maximum(gap, SMALLEST_GAP)
