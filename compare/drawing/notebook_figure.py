"""A figure that notebooks display, whether or not pyplot is in use."""

import io

import matplotlib
from matplotlib.figure import Figure

from compare.drawing import STYLE

NOTEBOOK_DPI = 110


class NotebookFigure(Figure):
    """Figure that is displayed as the last value of a notebook cell."""

    def _repr_png_(self) -> bytes:
        picture = io.BytesIO()
        with matplotlib.rc_context(fname=STYLE):
            self.savefig(picture, format="png", dpi=NOTEBOOK_DPI)
        return picture.getvalue()
