"""Stick figures: the poses of a gait from the side."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from compare.drawing.figures import INK, Look
from compare.drawing.shapes import LINE, Drawing, Label, Stroke
from nlp_gait.formulation import Array
from nlp_gait.formulation.display import LEFT, RIGHT, TRUNK, Skeleton

COLOURS = {LEFT: "#0072B2", RIGHT: "#D55E00", TRUNK: INK}
GROUND = "#909090"
MARGIN = 0.04  # [m] around everything that moves
POSES, FAINTEST = 6, 0.25  # number of poses, and opacity of the first one; the last one has 1


class View(NamedTuple):
    """A view from the side."""

    scale: float  #: [pixels/m]
    corner: Array  #: (2,) place of the origin [pixels]

    def project(self, points: Array) -> Array:
        """Return the pixels (..., 2) of points (..., 3)."""
        return self.corner + self.scale * points[..., [0, 2]] * (1.0, -1.0)


def _fit(skeleton: Skeleton, width: float, height: float) -> View:
    """Return the view that shows all samples and the ground with a margin, below a line of text."""
    low, high = skeleton.box()
    low[2] = min(low[2], skeleton.ground[:, 1].min() if skeleton.planar else 0.0)
    ends = np.array([low - MARGIN, high + MARGIN])[:, [0, 2]] * (1.0, -1.0)
    scale = float(min((width, height - LINE) / np.abs(ends[1] - ends[0])))
    return View(scale, np.array([width, LINE + height]) / 2.0 - scale * (ends[0] + ends[1]) / 2.0)


def draw_poses(
    name: str, first: Skeleton, width: float, height: float, over: tuple[str, Skeleton, Look] | None = None
) -> Drawing:
    """Draw poses of a gait from the side, later ones darker, and some of another gait dashed over it."""
    view = _fit(first, width, height)
    ground = np.insert(first.ground, 1, 0.0, axis=1)
    shapes: list[Stroke | Label] = [Stroke(lines=[view.project(ground)], colour=GROUND)]
    chosen = np.unique(np.linspace(0, len(first.t) - 1, POSES).round().astype(int)).tolist()
    for k, opacity in zip(chosen, np.linspace(FAINTEST, 1.0, len(chosen)).tolist(), strict=True):
        shapes += _draw_pose(first, k, view, opacity)
    title = name
    if over is not None:
        other_name, skeleton, look = over
        title = f"{name}, and {other_name} dashed"
        lines = [view.project(limb.points[k]) for k in (0, len(skeleton.t) // 2, -1) for limb in skeleton.limbs]
        shapes.append(Stroke(lines=lines, colour=look.colour, dash="5 3"))
    return Drawing(width=width, height=height, shapes=[*shapes, Label(x=width / 2, y=LINE - 4, text=title)])


def _draw_pose(skeleton: Skeleton, k: int, view: View, opacity: float) -> list[Stroke | Label]:
    """Draw limbs and soles at sample k."""
    parts = [(limb.side, limb.points[k], 1.5) for limb in skeleton.limbs]
    parts += [(sole.side, np.concatenate([sole.corners[k], sole.corners[k, :1]]), 2.4) for sole in skeleton.soles]
    return [
        Stroke(lines=[view.project(points)], colour=COLOURS[side], width=width, opacity=opacity)
        for side, points, width in parts
    ]
