"""Figures of power against stability: running hypervolume and distance, and the ends of all runs next to the true front."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from compare.analysis.units import axis_label
from compare.drawing.figures import COLOURS, LEGEND_ROW_IN, new_figure, use_log_axes
from compare.papers.nao_pareto.nao_pareto_findings import NAMES, ParetoFindings, PhaseFindings
from compare.papers.nao_pareto.nao_pareto_runs import ALGORITHMS
from compare.questions.pareto.pareto_front import SEARCH_COLOURS

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LINES = dict(zip(ALGORITHMS, ("-", "--", ":", "-."), strict=True))


def draw_figures(findings: ParetoFindings) -> dict[str, Figure]:
    """Return the figures by name."""
    running = {f"running-{phase.problem.name}": _draw_running(phase) for phase in findings.phases}
    return running | {f"fronts-{phase.problem.name}": _draw_fronts(phase) for phase in findings.phases}


def _draw_running(phase: PhaseFindings) -> Figure:
    """Hypervolume missing and distance over evaluations, with the largest budget: medians, and the range of all runs."""
    budget = phase.budgets[-1]
    figure = new_figure(6.6, 3.0)
    left, right = figure.subplots(1, 2)
    for name in ALGORITHMS:
        m = phase.measures[name, budget]
        colour = SEARCH_COLOURS[name]
        for axes, values in ((left, 100 * (1.0 - m.hypervolume)), (right, m.igd)):
            shown = np.where(np.isfinite(values), values, np.nan)
            known = np.isfinite(values).all(axis=0)
            at, shown = m.evaluations[known], shown[:, known]
            axes.fill_between(at, shown.min(axis=0), shown.max(axis=0), color=colour, alpha=0.12, linewidth=0)
            axes.plot(at, np.median(shown, axis=0), LINES[name], color=colour, label=NAMES[name])
    left.set_ylabel("hypervolume missing to the front's [%]")
    right.set_ylabel("inverted generational distance [1]")
    for axes in (left, right):
        axes.set_xlabel("evaluations")
        use_log_axes(axes, both=True)
    _add_legend(figure, left, 4)
    return figure


def _draw_fronts(phase: PhaseFindings) -> Figure:
    """The true front with its knees, and the ends of all runs with the largest budget, a panel for each algorithm."""
    budget, criterion = phase.budgets[-1], phase.criterion
    line = np.array([(p.value, p.power_W) for p in phase.front])
    figure = new_figure(6.6, 4.6)
    for axes, name in zip(figure.subplots(2, 2, sharex=True, sharey=True).ravel(), ALGORITHMS, strict=True):
        values, powers = phase.points(name, budget)
        axes.plot(values, powers, ".", color=SEARCH_COLOURS[name], markersize=2.5, alpha=0.4, rasterized=True)
        axes.plot(*line.T, "-", color=COLOURS["ipopt"], linewidth=1.0, label="true front")
        knees = [(k.value, k.power_W) for k in phase.bends.knees]
        if knees:
            axes.plot(*zip(*knees, strict=True), "o", color="none", markeredgecolor=COLOURS["aco"], label="knee")
        axes.set_title(NAMES[name], loc="left")
        width, height = np.ptp(line[:, 0]), np.ptp(line[:, 1])
        axes.set_xlim(line[0, 0] - 0.05 * width, line[-1, 0] + 0.05 * width)
        axes.set_ylim(0.0, line[-1, 1] + 0.15 * height)
    for axes in figure.axes[2:]:
        axes.set_xlabel(axis_label(criterion.name, criterion.unit))
    for axes in figure.axes[::2]:
        axes.set_ylabel("power [W]")
    _add_legend(figure, figure.axes[0], 2)
    return figure


def _add_legend(figure: Figure, axes: Axes, columns: int) -> None:
    handles, labels = axes.get_legend_handles_labels()
    figure.set_figheight(figure.get_figheight() + LEGEND_ROW_IN)
    figure.legend(handles, labels, loc="outside lower center", ncols=columns)
