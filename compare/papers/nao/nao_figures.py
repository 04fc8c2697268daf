"""Figures 9 to 20 of the NAO paper as the model gives them."""

from __future__ import annotations

from collections.abc import Iterator
from typing import TYPE_CHECKING

import numpy as np

from compare.drawing.animation import plot_poses
from compare.drawing.figures import COLOURS, new_figure, style
from compare.drawing.labels import axis_label
from compare.drawing.skeletons import make_skeleton
from compare.papers.nao.nao_findings import NAMES, Findings, PhaseFindings, Points
from compare.papers.nao.nao_paper import SWING_HEIGHT, SWING_POWER_W
from compare.papers.nao.nao_runs import ALGORITHMS
from compare.papers.paper_runs import point
from nlp_gait.formulation import Array, Result

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

PAPER_COLOUR = "#E69F00"
POWER_TICKS_W = (0.5, 0.6, 0.7, 0.85, 1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 10.0)
# Points that fall into one cell of a panel look like one; the grid is finer than the print.
CELLS = 400
POSES_EVERY_S = {"nao-ssp": 1.0, "nao-dsp": 0.25}  # Fig. 20
POSE_SAMPLES = 40
READING_TOLERANCE_M = 5e-4  # within which a solution counts as having a swing height


def all_figures(findings: Findings) -> Iterator[tuple[str, Figure]]:
    """File name without suffix, and figure."""
    for letter, phase in zip("ab", findings.phases, strict=True):
        yield f"fig{phase.paper.plot_convergence:02d}", plot_convergence(phase)
        for number, positions in phase.paper.scatter_figures.items():
            yield f"fig{number}", scatter_figure(phase, positions)
        yield f"fig20{letter}", gait_figure(phase)
    yield "swing-height", swing_figure(findings)


def plot_convergence(phase: PhaseFindings) -> Figure:
    """Figs. 9, 15: least, mean and greatest of the runs' best power so far in each generation.

    A line begins where every run has found a feasible solution.
    """
    with style():
        figure = new_figure(6.3, 2.9)
        for axes, name in zip(figure.subplots(1, 2, sharey=True), ALGORITHMS, strict=True):
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
            _power_scale(axes)
            axes.legend()
        figure.axes[1].set_ylabel("")
    return figure


def scatter_figure(phase: PhaseFindings, positions: tuple[int, ...]) -> Figure:
    """Figs. 10 to 14, 16 to 19: power against each variable over all feasible solutions, with IPOPT's optimum as a line."""
    with style():
        figure = new_figure(6.3, 0.5 + 2.1 * len(positions))
        grid = figure.subplots(len(positions), 2, sharey=True, sharex="row", squeeze=False)
        for row, position in zip(grid, positions, strict=True):
            variable = phase.problem.variables[position]
            label = rf"$x_{{{position + 1}}}$: {axis_label(variable.name, variable.unit)}"
            for axes, name in zip(row, ALGORITHMS, strict=True):
                _scatter(axes, phase.points[name], position, name)
                _envelope(axes, phase, position)
                axes.set_xlabel(label)
                axes.locator_params(axis="x", nbins=6)
                _power_scale(axes)
                axes.legend(loc="upper center", bbox_to_anchor=(0.5, 1.2), ncols=2, handletextpad=0.4)
            row[1].set_ylabel("")
    return figure


def _scatter(axes: Axes, points: Points, position: int, name: str) -> None:
    """Feasible solutions, thinned to what can be told apart."""
    x, power = points.x[:, position], points.power_W
    cells = np.stack([_cell(x), _cell(np.log(power))])
    shown = np.unique(cells, axis=1, return_index=True)[1]
    label = f"{NAMES[name]}: {len(power)} feasible solutions"
    axes.plot(x[shown], power[shown], ".", color=COLOURS[name], markersize=1.5, alpha=0.4, rasterized=True)
    axes.plot([], [], ".", color=COLOURS[name], markersize=5, label=label)


def _cell(values: Array) -> Array:
    span = float(np.ptp(values)) or 1.0
    return np.round((values - values.min()) / span * CELLS)


def _envelope(axes: Axes, phase: PhaseFindings, position: int) -> None:
    sweep = phase.sweeps[position]
    power = [held.power_W if held.feasible else np.nan for held in sweep]
    axes.plot([held.at for held in sweep], power, color=COLOURS["ipopt"], label="IPOPT", linewidth=1.2)


def swing_figure(findings: Findings) -> Figure:
    """Price of a higher swing foot: the true sweep, the paper's reading of its search histories, and ours of our own."""
    phase = findings.ssp
    with style():
        figure = new_figure(5.2, 3.2)
        axes = figure.subplots()
        heights = [held.at for held in findings.swing]
        axes.plot(
            heights, _relative([held.power_W for held in findings.swing]), "o-", color=COLOURS["ipopt"], label="IPOPT"
        )
        for name, marker in zip(ALGORITHMS, "sv", strict=True):
            printed = SWING_POWER_W[name]
            label = f"paper, {NAMES[name]}"
            axes.plot(list(printed), _relative(list(printed.values())), f"{marker}--", color=PAPER_COLOUR, label=label)
            read = read_swing_powers(phase, name, phase.median_run(name))
            label = f"ours, read off the {NAMES[name]} run of median power"
            axes.plot(heights, _relative(read), f"{marker}:", color=COLOURS[name], label=label)
        axes.set(xlabel=axis_label("swing_height_m", "m"), ylabel="power / power at 0.015 m [1]")
        axes.legend()
    return figure


def read_swing_powers(phase: PhaseFindings, algorithm: str, run: int | None) -> list[float]:
    """Least power found within 0.5 mm of each of the paper's swing heights [W]: what a search history shows.

    Args:
        phase: single support.
        algorithm: whose history.
        run: one run; None for all.
    """
    heights = SWING_POWER_W[algorithm]
    return [phase.points[algorithm].cheapest_near(SWING_HEIGHT, height, READING_TOLERANCE_M, run) for height in heights]


def _relative(values: list[float]) -> Array:
    return np.array(values) / values[0]


def gait_figure(phase: PhaseFindings) -> Figure:
    """Fig. 20: IPOPT's gait from behind and from the side."""
    x = np.array(point(phase.optimum))
    duration = float(x[phase.paper.duration])
    skeleton = make_skeleton(Result(problem=phase.problem, x=x), POSE_SAMPLES / duration)
    count = int(duration / POSES_EVERY_S[phase.problem.name] + 1e-6) + 1
    return plot_poses(skeleton, [k * POSES_EVERY_S[phase.problem.name] for k in range(count)], ("front", "side"))


def _power_scale(axes: Axes) -> None:
    """Logarithmic axis with plain numbers."""
    from matplotlib.ticker import FixedLocator, NullFormatter, StrMethodFormatter

    axes.set_yscale("log")
    axes.yaxis.set_major_locator(FixedLocator(POWER_TICKS_W))
    axes.yaxis.set_major_formatter(StrMethodFormatter("{x:g}"))
    axes.yaxis.set_minor_formatter(NullFormatter())
    axes.set_ylabel("power [W]")
