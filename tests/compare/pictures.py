"""Small pictures for tests, which are drawn as the real ones in a tenth of the time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.image import imsave


def save_coarsely(figure: Figure, stem: Path) -> tuple[Path, Path]:
    """Write a picture of few pixels and an empty drawing."""
    png, svg = (stem.with_name(f"{stem.name}.{kind}") for kind in ("png", "svg"))
    figure.set_layout_engine("none")
    figure.set_dpi(20)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()  # once; ``savefig`` draws twice
    imsave(png, np.asarray(canvas.buffer_rgba()))
    svg.write_text("<svg>" + 1000 * " " + "</svg>", encoding="utf-8")
    return png, svg
