"""Small pictures for tests, which are drawn as the real ones in a tenth of the time."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.image import imsave

from nlp_gait.formulation import Array


def save_coarsely(figure: Figure, stem: Path) -> tuple[Path, Path]:
    """Write a picture of few pixels and an empty drawing."""
    figure.set_layout_engine("none")
    figure.set_dpi(20)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()  # once; ``savefig`` draws twice
    return _write(stem, np.asarray(canvas.buffer_rgba()))


def save_undrawn(figure: Figure, stem: Path) -> tuple[Path, Path]:
    """Write a picture of the usual size that shows nothing."""
    return _write(stem, np.random.default_rng(0).random((20, 20, 3)))


def _write(stem: Path, pixels: Array) -> tuple[Path, Path]:
    png, svg = (stem.with_name(f"{stem.name}.{kind}") for kind in ("png", "svg"))
    imsave(png, pixels)
    svg.write_text("<svg>" + 1000 * " " + "</svg>", encoding="utf-8")
    return png, svg
