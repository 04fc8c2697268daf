"""A gait as stick figures at some instants, from the front and from the side."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from compare.drawing.animation import COLOURS, outline
from compare.drawing.figures import new_figure, style
from nlp_gait.problem.skeleton import LEFT, RIGHT, Skeleton

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# Views by name, to the axis across.
VIEWS = {"front": 1, "side": 0}
AXIS_NAMES = ("x", "y")
MARGIN_M = 0.03
WIDTH_IN = 6.6
TICKS_M = (0.0, 0.2)  # across; more would run into each other


def stick_figure(skeleton: Skeleton, times_s: Sequence[float]) -> Figure:
    """One row for each view, one column for each instant: the sample nearest to it.

    From the front the robot walks towards the reader, with its left side on the right; from the side it walks to the right.
    """
    low, high = skeleton.box()
    widths = {view: float(high[across] - low[across]) + 2 * MARGIN_M for view, across in VIEWS.items()}
    height = float(high[2]) + 2 * MARGIN_M
    columns = len(times_s)
    with style():
        row_in = [min(WIDTH_IN / columns * height / width, 2.2) for width in widths.values()]
        figure = new_figure(WIDTH_IN, sum(row_in) + 1.2)
        figure.set_layout_engine("compressed")  # equal scales leave gaps otherwise
        grid = figure.subplots(len(VIEWS), columns, sharey=True, squeeze=False, height_ratios=row_in)
        for row, (view, across) in zip(grid, VIEWS.items(), strict=True):
            for axes, time in zip(row, times_s, strict=True):
                _draw(axes, skeleton, int(np.abs(skeleton.t - time).argmin()), across)
                axes.set_xlim(low[across] - MARGIN_M, high[across] + MARGIN_M)
                axes.set_ylim(-MARGIN_M, high[2] + MARGIN_M)
                axes.set_xticks(TICKS_M)
                axes.set_aspect("equal")
            row[0].set_ylabel(f"{view}\nz [m]")
            row[columns // 2].set_xlabel(f"{AXIS_NAMES[across]} [m]")
        for axes, time in zip(grid[0], times_s, strict=True):
            axes.set_title(f"{time:g} s")
        _legend(figure)
    return figure


def _draw(axes: Axes, skeleton: Skeleton, k: int, across: int) -> None:
    axes.axhline(0.0, color="0.6", linewidth=0.8)
    for sole in skeleton.soles:
        ring = outline(sole, k)
        axes.plot(ring[:, across], ring[:, 2], color=COLOURS[sole.side], linewidth=1.8)
    for limb in skeleton.limbs:
        line = limb.points[k]
        axes.plot(line[:, across], line[:, 2], "o-", color=COLOURS[limb.side], markersize=1.8, linewidth=1.1)
    for points, marker in ((skeleton.com, "s"), (skeleton.zmp, "x")):
        if points is not None:
            axes.plot(points[k, across], points[k, 2], marker, color="black", markersize=3)
    axes.tick_params(labelsize=7)


def _legend(figure: Figure) -> None:
    from matplotlib.lines import Line2D

    handles = [
        Line2D([], [], color=COLOURS[LEFT], label="left"),
        Line2D([], [], color=COLOURS[RIGHT], label="right"),
        Line2D([], [], color="black", marker="s", linestyle="none", label="centre of mass"),
        Line2D([], [], color="black", marker="x", linestyle="none", label="ZMP"),
    ]
    figure.legend(handles=handles, loc="outside lower center", ncols=len(handles))
