"""Small pictures for tests, which are drawn as the real ones in a tenth of the time."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.image import imsave


def save_coarsely(figure: Figure, stem: Path, drawn: Collection[str] = ()) -> tuple[Path, Path]:
    """Write a picture of few pixels and an empty drawing; if ``drawn`` names any, others are not drawn."""
    png, svg = (stem.with_name(f"{stem.name}.{kind}") for kind in ("png", "svg"))
    figure.set_layout_engine("none")
    figure.set_dpi(20)
    canvas = FigureCanvasAgg(figure)
    if not drawn or stem.name in drawn:
        canvas.draw()  # once; ``savefig`` draws twice
        imsave(png, np.asarray(canvas.buffer_rgba()))
    else:
        imsave(png, np.random.default_rng(0).random((20, 20, 3)))  # a file of the usual size
    svg.write_text("<svg>" + 1000 * " " + "</svg>", encoding="utf-8")
    return png, svg
