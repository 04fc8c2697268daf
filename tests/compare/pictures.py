"""Small pictures for tests, which are drawn as the real ones in a tenth of the time."""

from __future__ import annotations

from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

EMPTY = "<svg >" + 1000 * " " + "</svg>"


def render_coarsely(figure: Figure) -> str:
    """Draw a picture of few pixels, and return an empty drawing."""
    figure.set_layout_engine("none")
    figure.set_dpi(20)
    FigureCanvasAgg(figure).draw()
    return EMPTY


def render_nothing(figure: Figure) -> str:
    """Return an empty drawing."""
    return EMPTY
