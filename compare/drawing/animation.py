"""Stick figures: a gait in 3D, from the side, the front and above, as frames of a video."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from compare.drawing.figures import make_figure, use_style
from nlp_gait.formulation.display import LEFT, RIGHT, TRUNK, Skeleton
from nlp_gait.interrupts import delay_interrupts
from nlp_gait.simulation.video import Frame

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

COLOURS = {LEFT: "#0072B2", RIGHT: "#D55E00", TRUNK: "#404040"}
GROUND, SUPPORT, COM, ZMP = "#909090", "#009E73", "#000000", "#CC79A7"
MARGIN = 0.04  # [m] around everything that moves
FRAME_DPI = 120
# Views by name: the coordinates across and up.
VIEWS = {"side": (0, 2), "front": (1, 2), "above": (0, 1)}
# Size of a frame [inch]; positions of the 3-D view, the other views and the upper left corner of the legend.
FRAME, PLANAR_FRAME = (8.0, 4.5), (6.4, 4.0)
PLACE_3D = (-0.02, 0.0, 0.42, 0.94)
PLACES = {"side": (0.455, 0.53, 0.15, 0.38), "front": (0.67, 0.53, 0.15, 0.38), "above": (0.455, 0.12, 0.365, 0.28)}
PLANAR_PLACE = (0.11, 0.13, 0.63, 0.77)
LEGEND_CORNER, PLANAR_LEGEND_CORNER = (0.835, 0.92), (0.76, 0.92)
AXIS_NAMES = ("x [m]", "y [m]", "z [m]")


def draw_frames(skeleton: Skeleton) -> Iterator[Frame]:
    """Yield one frame per sample: in 3D, from the side, the front and above; a planar gait from the side only."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    with use_style():
        figure = make_figure(*(PLANAR_FRAME if skeleton.planar else FRAME))
        figure.set_layout_engine("none")  # fixed positions: computing a layout costs more than drawing
        figure.set_dpi(FRAME_DPI)
        canvas: Any = FigureCanvasAgg(figure)
        for k in range(len(skeleton.t)):
            with delay_interrupts():  # Matplotlib's compiled code turns Ctrl-C into other errors
                figure.clear()
                _draw_frame(figure, skeleton, k)
                canvas.draw()
            yield np.asarray(canvas.buffer_rgba())[:, :, :3].copy()


def _draw_frame(figure: Figure, skeleton: Skeleton, k: int) -> None:
    figure.text(0.01, 0.985, f"{skeleton.t[k]:.2f} s   {skeleton.title}", fontsize=10, va="top")
    views, corner = (["side"], PLANAR_LEGEND_CORNER) if skeleton.planar else (list(VIEWS), LEGEND_CORNER)
    figure.legend(handles=_make_legend(skeleton, views), loc="upper left", bbox_to_anchor=corner, borderaxespad=0.0)
    if skeleton.planar:
        _draw_view(figure.add_axes(PLANAR_PLACE), skeleton, k, "side")
        return
    _draw_3d(figure.add_axes(PLACE_3D, projection="3d"), skeleton, k)
    for view, place in PLACES.items():
        _draw_view(figure.add_axes(place), skeleton, k, view)


def _draw_view(axis: Axes, skeleton: Skeleton, k: int, view: str) -> None:
    across, up = VIEWS[view]
    if view == "above":
        support = skeleton.support(k)
        if support is not None:
            axis.fill(support[:, 0], support[:, 1], color=SUPPORT, alpha=0.3, lw=0)
    elif view == "side":
        axis.plot(skeleton.ground[:, 0], skeleton.ground[:, 1], color=GROUND, lw=1.0)
    else:
        axis.axhline(0.0, color=GROUND, lw=1.0)
    _draw_pose(axis, skeleton, k, (across, up), 0.25 if view == "above" else 1.0)
    low, high = skeleton.box()
    ground_low = min(float(low[2]), 0.0 if not skeleton.planar else float(skeleton.ground[:, 1].min()))
    low = np.array([low[0], low[1], ground_low])
    axis.set_xlim(low[across] - MARGIN, high[across] + MARGIN)
    axis.set_ylim(low[up] - MARGIN, high[up] + MARGIN)
    axis.set_aspect("equal")
    if view == "front":
        axis.invert_xaxis()  # seen from behind: its left is our left
    axis.set_xlabel(AXIS_NAMES[across])
    axis.set_ylabel(AXIS_NAMES[up])


def _draw_pose(axis: Any, skeleton: Skeleton, k: int, seen: Sequence[int], opacity: float = 1.0) -> None:
    """Draw soles, limbs, centre of mass and ZMP at sample k in axes of two or three dimensions with these coordinates."""
    for sole in skeleton.soles:
        outline = np.concatenate([sole.corners[k], sole.corners[k, :1]])
        axis.plot(*outline[:, seen].T, color=COLOURS[sole.side], lw=1.0)
    for limb in skeleton.limbs:
        axis.plot(*limb.points[k][:, seen].T, color=COLOURS[limb.side], marker="o", ms=2.5, alpha=opacity)
    for points, colour, marker in ((skeleton.com, COM, "o"), (skeleton.zmp, ZMP, "X")):
        if points is not None:
            axis.plot(*points[k : k + 1, seen].T, color=colour, marker=marker, ms=5, ls="none", zorder=5)


def _draw_3d(axis: Any, skeleton: Skeleton, k: int) -> None:
    from mpl_toolkits.mplot3d.art3d import Poly3DCollection

    support = skeleton.support(k)
    if support is not None:
        corners = np.column_stack([support, np.zeros(len(support))])
        axis.add_collection3d(Poly3DCollection([corners], color=SUPPORT, alpha=0.3, lw=0))
    _draw_pose(axis, skeleton, k, (0, 1, 2))
    low, high = skeleton.box()
    low, high = np.minimum(low, (np.inf, np.inf, 0.0)) - MARGIN, high + MARGIN
    axis.set(xlim=(low[0], high[0]), ylim=(low[1], high[1]), zlim=(low[2], high[2]))
    axis.set_box_aspect(high - low, zoom=1.1)
    axis.view_init(elev=15, azim=-55)
    axis.set(xticklabels=[], yticklabels=[], zticklabels=[])


def _make_legend(skeleton: Skeleton, views: Collection[str]) -> list[Artist]:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    drawn = {limb.side for limb in skeleton.limbs}
    names = {LEFT: "left", RIGHT: "right", TRUNK: "trunk"}
    handles: list[Artist] = [
        Line2D([], [], color=COLOURS[side], marker="o", ms=2.5, label=name)
        for side, name in names.items()
        if side in drawn
    ]
    if skeleton.com is not None:
        handles.append(Line2D([], [], color=COM, marker="o", ms=5, ls="none", label="centre of mass"))
    if skeleton.zmp is not None:
        handles.append(Line2D([], [], color=ZMP, marker="X", ms=5, ls="none", label="ZMP"))
    if skeleton.soles and "above" in views:
        handles.append(Patch(color=SUPPORT, alpha=0.3, lw=0, label="support polygon"))
    return handles
