"""A figure that a notebook shows by itself, whether or not pyplot is in use there."""

from __future__ import annotations

import io

from matplotlib.figure import Figure

NOTEBOOK_DPI = 110


class ShownFigure(Figure):
    """A figure; as the last value of a notebook's cell it is drawn."""

    def _repr_png_(self) -> bytes:
        from compare.drawing.figures import style

        picture = io.BytesIO()
        with style():
            self.savefig(picture, format="png", dpi=NOTEBOOK_DPI)
        return picture.getvalue()
