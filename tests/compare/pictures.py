"""Small pictures for tests, which are drawn as the real ones in a tenth of the time."""

from typing import Any, TextIO

from matplotlib.backends.backend_agg import FigureCanvasAgg


class CoarseCanvas(FigureCanvasAgg):
    """Draws a picture of few pixels, and writes an empty SVG file."""

    def print_svg(self, file: TextIO, **_: Any) -> None:
        self.figure.set_layout_engine("none")
        self.figure.set_dpi(20)
        self.draw()
        file.write("<svg >" + 1000 * " " + "</svg>")
