"""Figures 9 to 20 of the NAO paper as the model gives them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from compare.analysis.units import make_axis_label
from compare.drawing.animation import plot_poses
from compare.drawing.figures import COLOURS, make_axes, make_figure
from compare.drawing.gait_figure import make_skeleton
from compare.papers.nao.nao_findings import NAMES, FeasiblePoints, NaoFindings, PhaseFindings
from compare.papers.nao.nao_runs import ALGORITHMS, PAPER, SEARCHES
from compare.papers.paper_runs import get_point
from nlp_gait.formulation import Array, Result

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PAPER_COLOUR = "#E69F00"
POWER_TICKS_W = (0.5, 0.6, 0.7, 0.85, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 10.0)
# Points that fall into one cell of a panel look like one; the grid is finer than the print.
CELLS = 400
POSE_SAMPLES = 40


def draw_figures(findings: NaoFindings) -> dict[str, Figure]:
    """Return the figures by name."""
    figures = {"swing-height": _draw_swing(findings)}
    for letter, phase in zip("ab", findings.phases, strict=True):
        figures[phase.paper.convergence_figure] = _draw_convergence(phase)
        for name, positions in phase.paper.scatter_figures.items():
            figures[name] = _draw_scatter(phase, positions)
        figures[f"fig20{letter}"] = _draw_gait(phase)
    return figures


def _draw_convergence(phase: PhaseFindings) -> Figure:
    """Figs. 9, 15: least, mean and greatest of the runs' best power so far in each generation.

    A line begins where every run has found a feasible solution.
    """
    figure = make_figure(7.5, 2.9)
    for axes, name in zip(figure.subplots(1, len(SEARCHES), sharey=True), SEARCHES, strict=True):
        best = np.array([run.history.objective for run in phase.searches[name]], dtype=float)
        generations = np.arange(1, best.shape[1] + 1)
        colour = COLOURS[name]
        axes.fill_between(generations, best.min(axis=0), best.max(axis=0), color=colour, alpha=0.15, linewidth=0)
        for label, values, line in (
            ("greatest of the best", best.max(axis=0), ":"),
            ("mean of the best", best.mean(axis=0), "-"),
            ("least of the best", best.min(axis=0), "-."),
        ):
            axes.plot(generations, values, line, color=colour, label=label)
        axes.axhline(phase.best, color=COLOURS["ipopt"], linestyle="--", linewidth=1.0, label="IPOPT's optimum")
        axes.set_title(f"{NAMES[name]}, {len(best)} runs")
        axes.set_xlabel("generation")
        _scale_power(axes)
        axes.legend()
    for axes in figure.axes[1:]:
        axes.set_ylabel("")
    return figure


def _draw_scatter(phase: PhaseFindings, positions: tuple[int, ...]) -> Figure:
    figure = make_figure(7.5, 0.5 + 2.1 * len(positions))
    grid = figure.subplots(len(positions), len(SEARCHES), sharey=True, sharex="row", squeeze=False)
    for k, (row, position) in enumerate(zip(grid, positions, strict=True)):
        variable, sweep = phase.problem.variables[position], phase.sweeps[position]
        optima = np.array([(held.at, held.power_W if held.feasible else np.nan) for held in sweep]).T
        label = rf"$x_{{{position + 1}}}$: {make_axis_label(variable.name, variable.unit)}"
        for axes, name in zip(row, SEARCHES, strict=True):
            _plot_solutions(axes, phase.points[name], position, name)
            axes.plot(*optima, color=COLOURS["ipopt"], linewidth=1.2)
            axes.set_xlabel(label)
            axes.locator_params(axis="x", nbins=4)
            if k == 0:
                axes.set_title(f"{NAMES[name]}: {len(phase.points[name].power_W)} solutions", fontsize="small")
            _scale_power(axes)
        for axes in row[1:]:
            axes.set_ylabel("")
    return figure


def _plot_solutions(axes: Axes, points: FeasiblePoints, position: int, name: str) -> None:
    """Plot feasible solutions, thinned to those that can be distinguished."""
    x, power = points.x[:, position], points.power_W
    values = np.column_stack([x, np.log(power)])
    span = np.ptp(values, axis=0)
    cells = np.round((values - values.min(axis=0)) / np.where(span > 0.0, span, 1.0) * CELLS)
    shown = np.unique(cells, axis=0, return_index=True)[1]
    axes.plot(x[shown], power[shown], ".", color=COLOURS[name], markersize=1.5, alpha=0.4, rasterized=True)


def _draw_swing(findings: NaoFindings) -> Figure:
    """Price of a higher swing foot: the true sweep, and what the search histories of the paper and ours show."""
    phase = findings.ssp
    heights = [held.at for held in findings.swing]
    figure, axes = make_axes(5.2, 3.2)

    def plot(power: Sequence[float] | Array, line: str, colour: str, label: str) -> None:
        axes.plot(heights, np.array(power) / np.nanmin(power), line, color=colour, label=label)

    plot([held.power_W for held in findings.swing], "o-", COLOURS["ipopt"], "IPOPT")
    for name, marker in zip(ALGORITHMS, "sv", strict=True):
        plot(PAPER.swing_power_W[name], f"{marker}--", PAPER_COLOUR, f"paper, {name.upper()}")
    for name, marker in zip(SEARCHES, "s^v", strict=True):
        plot(phase.list_swing_powers(name), f"{marker}:", COLOURS[name], f"ours, {NAMES[name]}")
    axes.set(xlabel=make_axis_label("swing_height_m", "m"), ylabel="power / least power [1]")
    axes.legend()
    return figure


def _draw_gait(phase: PhaseFindings) -> Figure:
    x = np.array(get_point(phase.optimum))
    duration, every_s = float(x[phase.paper.duration]), phase.paper.poses_every_s
    skeleton = make_skeleton(Result(problem=phase.problem, x=x), POSE_SAMPLES / duration)
    times = [k * every_s for k in range(int(duration / every_s + 1e-6) + 1)]
    return plot_poses(skeleton, times, ("front", "side"))


def _scale_power(axes: Axes) -> None:
    """Logarithmic axis with plain numbers."""
    from matplotlib.ticker import FixedLocator, NullFormatter, StrMethodFormatter

    axes.set_yscale("log")
    axes.yaxis.set_major_locator(FixedLocator(POWER_TICKS_W))
    axes.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.set_ylabel("power [W]")
