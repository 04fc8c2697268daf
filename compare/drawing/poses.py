"""Stick figures: the poses of a gait from the side, and the frames of a video in 3-D, from the side, from behind and above."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from compare.drawing.figures import INK, Look
from compare.drawing.shapes import LINE, MARKERS, Drawing, Label, Stroke
from nlp_gait.formulation import Array
from nlp_gait.formulation.display import LEFT, RIGHT, TRUNK, Skeleton
from nlp_gait.interrupts import delay_interrupts
from nlp_gait.simulation.video import Frame

COLOURS = {LEFT: "#0072B2", RIGHT: "#D55E00", TRUNK: INK}
GROUND, SUPPORT, ZMP = "#909090", "#009E73", "#CC79A7"
MARGIN = 0.04  # [m] around everything that moves
POSES, FAINTEST = 6, 0.25  # number of poses, and opacity of the first one; the last one has 1
FRAME, FRAME_DPI = (864.0, 486.0), 120
# Directions to the right and up; and the left, upper, right and lower ends as shares of a frame.
SIDE = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0]])
VIEWS = {
    "": (np.array([[0.819, 0.574, 0.0], [-0.148, 0.212, 0.966]]), (0.01, 0.08, 0.42, 0.98)),
    "from the side": (SIDE, (0.45, 0.08, 0.63, 0.58)),
    "from behind": (np.array([[0.0, -1.0, 0.0], [0.0, 0.0, 1.0]]), (0.66, 0.08, 0.82, 0.58)),
    "from above": (np.array([[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]), (0.45, 0.68, 0.82, 0.92)),
}
PLANAR_VIEWS = {"from the side": (SIDE, (0.04, 0.08, 0.8, 0.92))}


class View(NamedTuple):
    """A parallel projection into a rectangle."""

    axes: Array  #: (2, 3) directions to the right and up
    scale: float  #: [pixels/m]
    corner: Array  #: (2,) place of the origin [pixels]

    def project(self, points: Array) -> Array:
        """Return the pixels (..., 2) of points (..., 3)."""
        return self.corner + self.scale * (points @ self.axes.T) * (1.0, -1.0)


def _fit(skeleton: Skeleton, axes: Array, left: float, top: float, right: float, bottom: float) -> View:
    """Return the projection that shows all samples within a rectangle."""
    corners = np.array(np.meshgrid(*_find_box(skeleton).T)).reshape(3, -1).T @ axes.T * (1.0, -1.0)
    low, high = corners.min(axis=0), corners.max(axis=0)
    scale = float(min((right - left, bottom - top) / (high - low)))
    return View(axes, scale, np.array([left + right, top + bottom]) / 2.0 - scale * (low + high) / 2.0)


def _find_box(skeleton: Skeleton) -> Array:
    """Return the least and greatest coordinates (2, 3) of what moves and of the ground, with a margin."""
    low, high = skeleton.box()
    low[2] = min(low[2], skeleton.ground[:, 1].min() if skeleton.planar else 0.0)
    return np.array([low - MARGIN, high + MARGIN])


def draw_poses(
    name: str, first: Skeleton, width: float, height: float, over: tuple[str, Skeleton, Look] | None = None
) -> Drawing:
    """Draw poses of a gait from the side, later ones darker, and some of another gait dashed over it."""
    view = _fit(first, SIDE, 0.0, LINE, width, height)
    ground = np.insert(first.ground, 1, 0.0, axis=1)
    shapes: list[Stroke | Label] = [Stroke(lines=[view.project(ground)], colour=GROUND)]
    chosen = np.unique(np.linspace(0, len(first.t) - 1, POSES).round().astype(int)).tolist()
    for k, opacity in zip(chosen, np.linspace(FAINTEST, 1.0, len(chosen)).tolist(), strict=True):
        shapes += _draw_pose(first, k, view, opacity)
    title = name
    if over is not None:
        other, skeleton, look = over
        title = f"{name}, and {other} dashed"
        lines = [view.project(limb.points[k]) for k in (0, len(skeleton.t) // 2, -1) for limb in skeleton.limbs]
        shapes.append(Stroke(lines=lines, colour=look.colour, dash="5 3"))
    return Drawing(width=width, height=height, shapes=[*shapes, Label(x=width / 2, y=LINE - 4, text=title)])


def _draw_pose(skeleton: Skeleton, k: int, view: View, opacity: float = 1.0) -> list[Stroke | Label]:
    """Draw limbs and soles at sample k."""
    parts = [(limb.side, limb.points[k], 1.5) for limb in skeleton.limbs]
    parts += [(sole.side, np.concatenate([sole.corners[k], sole.corners[k, :1]]), 2.4) for sole in skeleton.soles]
    return [
        Stroke(lines=[view.project(points)], colour=COLOURS[side], width=width, opacity=opacity)
        for side, points, width in parts
    ]


def draw_frames(skeleton: Skeleton) -> Iterator[Frame]:
    """Yield one frame per sample: in 3-D, from the side, from behind and above; a planar gait from the side only."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg

    (width, height), views = FRAME, PLANAR_VIEWS if skeleton.planar else VIEWS
    size = np.array([width, height, width, height])
    fitted = {name: _fit(skeleton, axes, *(size * ends).tolist()) for name, (axes, ends) in views.items()}
    names = [
        Label(x=width * (left + right) / 2, y=height * bottom + LINE, text=name)
        for name, (_, (left, _, right, bottom)) in views.items()
    ]
    legend = _draw_legend(skeleton, 0.84 * width, 0.1 * height)
    for k, t in enumerate(skeleton.t):
        title = Label(x=8, y=LINE, text=f"{t:.2f} s   {skeleton.title}", anchor="start")
        shapes = [shape for view in fitted.values() for shape in _draw_scene(skeleton, k, view)]
        with delay_interrupts():  # Matplotlib's compiled code turns Ctrl-C into other errors
            figure = Drawing(width=width, height=height, shapes=[*shapes, *names, *legend, title]).to_figure()
            figure.set_dpi(FRAME_DPI)
            canvas: Any = FigureCanvasAgg(figure)
            canvas.draw()
        yield np.asarray(canvas.buffer_rgba())[:, :, :3].copy()


def _draw_scene(skeleton: Skeleton, k: int, view: View) -> list[Stroke | Label]:
    """Draw ground, support polygon, pose, centre of mass and zero-moment point at sample k."""
    (_, right, _), (_, left, _) = _find_box(skeleton)
    edges = [np.insert(skeleton.ground, 1, y, axis=1) for y in (right, left)]
    lines = [view.project(line) for line in (*edges, *np.stack(edges, axis=1))]
    shapes: list[Stroke | Label] = [Stroke(lines=lines, colour=GROUND)]
    support = None if skeleton.planar else skeleton.support(k)
    if support is not None:
        area = view.project(np.insert(support, 2, 0.0, axis=1))
        shapes.append(Stroke(lines=[area], colour=SUPPORT, opacity=0.3, filled=True))
    shapes += _draw_pose(skeleton, k, view)
    for points, colour in ((skeleton.com, INK), (skeleton.zmp, ZMP)):
        if points is not None:
            shapes.append(Stroke(lines=[MARKERS["o"] + view.project(points[k])], colour=colour, filled=True))
    return shapes


def _draw_legend(skeleton: Skeleton, x: float, y: float) -> list[Stroke | Label]:
    sides = {limb.side for limb in skeleton.limbs}
    looks = {
        name: (COLOURS[side], 1.0)
        for side, name in ((LEFT, "left"), (RIGHT, "right"), (TRUNK, "trunk"))
        if side in sides
    }
    looks |= {"centre of mass": (INK, 1.0)} if skeleton.com is not None else {}
    looks |= {"ZMP": (ZMP, 1.0)} if skeleton.zmp is not None else {}
    looks |= {"support polygon": (SUPPORT, 0.3)} if skeleton.soles and not skeleton.planar else {}
    shapes: list[Stroke | Label] = []
    for k, (name, (colour, opacity)) in enumerate(looks.items()):
        place = np.array([x, y + LINE * k])
        shapes.append(Stroke(lines=[MARKERS["o"] + place], colour=colour, opacity=opacity, filled=True))
        shapes.append(Label(x=x + 10, y=y + LINE * k + 4, text=name, anchor="start"))
    return shapes
