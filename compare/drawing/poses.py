"""Stick figures: the poses of a gait from the side."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from compare.drawing.charts import HEIGHT, WIDTH
from compare.drawing.figures import LEGS, Look
from compare.drawing.shapes import LINE, Drawing, Label, Stroke, draw_legend
from nlp_gait.formulation import Array
from nlp_gait.formulation.display import LEFT, RIGHT, Skeleton

GROUND = "#909090"
MARGIN = 0.04  # [m] around everything that moves
POSES, FAINTEST = 6, 0.25  # number of poses, and opacity of the first one; the last one has 1


class View(NamedTuple):
    """A view from the side."""

    scale: float  #: [pixels/m]
    corner: Array  #: (2,) place of the origin [pixels]

    def place(self, points: Array) -> Array:
        """Return the pixels (..., 2) of points (..., 3)."""
        return self.corner + self.scale * points[..., [0, 2]] * (1.0, -1.0)


def draw_poses(first: Skeleton, over: tuple[str, Skeleton, Look] | None = None) -> Drawing:
    """Draw poses of a gait from the side, later ones darker, some of another gait dashed over it, and a legend below."""
    low, high = first.box()
    low[2] = min(low[2], first.ground[:, 1].min() if first.planar else 0.0)
    ends = np.array([low - MARGIN, high + MARGIN])[:, [0, 2]] * (1.0, -1.0)
    scale = float(min((WIDTH, HEIGHT - LINE) / np.abs(ends[1] - ends[0])))
    corner = np.array([WIDTH, HEIGHT - LINE]) / 2.0 - scale * (ends[0] + ends[1]) / 2.0

    view = View(scale, corner)
    shapes: list[Stroke | Label] = [Stroke(lines=[view.place(np.insert(first.ground, 1, 0.0, axis=1))], colour=GROUND)]
    chosen = np.unique(np.linspace(0, len(first.t) - 1, POSES).round().astype(int)).tolist()
    for k, opacity in zip(chosen, np.linspace(FAINTEST, 1.0, len(chosen)).tolist(), strict=True):
        parts = [(limb.side, limb.points[k], 1.5) for limb in first.limbs]
        parts += [(sole.side, np.concatenate([sole.corners[k], sole.corners[k, :1]]), 2.4) for sole in first.soles]
        shapes += [
            Stroke(lines=[view.place(points)], colour=LEGS[side], width=width, opacity=opacity)
            for side, points, width in parts
        ]
    legend = [("left leg", LEGS[LEFT], ""), ("right leg", LEGS[RIGHT], "")]
    if over is not None:
        name, skeleton, look = over
        lines = [view.place(limb.points[k]) for k in (0, len(skeleton.t) // 2, -1) for limb in skeleton.limbs]
        shapes.append(Stroke(lines=lines, colour=look.colour, dash="5 3"))
        legend.append((name, look.colour, "5 3"))
    shapes += draw_legend(legend, LINE / 2, HEIGHT - LINE, WIDTH)[0]
    return Drawing(width=WIDTH, height=HEIGHT, shapes=shapes)
