"""Drawings of lines and words in pixels: SVG for pages, in a hundredth of Matplotlib's time, and Matplotlib for PNG and PDF."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from html import escape
from typing import TYPE_CHECKING, Literal

import numpy as np

from compare.drawing.figures import INK, make_figure, use_style
from nlp_gait.formulation import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

LETTER, LINE, FONT = 6.2, 18, 12  # width of a letter, height of a line of text, and of its letters [pixels]
PIXELS_PER_INCH = 108
POINTS = 72 / PIXELS_PER_INCH  # of a pixel
CIRCLE = 3.0 * np.exp(2j * np.pi / 12 * np.arange(13)).view(float).reshape(-1, 2)  # a marker about zero
ALIGNED = {"start": "left", "middle": "center", "end": "right"}


@dataclass(frozen=True, kw_only=True, eq=False)
class Stroke:
    """Lines, or areas, of one look."""

    lines: Sequence[Array]  #: (N, 2) each, x to the right and y down [pixels]
    colour: str = INK
    width: float = 1.0
    dash: str = ""  #: lengths of dashes and of gaps
    opacity: float = 1.0
    filled: bool = False
    note: str = ""  #: which a page shows at the pointer

    def move(self, right: float, down: float) -> Stroke:
        """Return the lines elsewhere."""
        return replace(self, lines=[line + (right, down) for line in self.lines])

    def to_svg(self) -> str:
        """Return an element of an SVG file."""
        path = "".join("M" + "L".join(f"{x:.1f} {y:.1f}" for x, y in line.tolist()) for line in self.lines)
        look = f'fill="{self.colour}" stroke="none"' if self.filled else f'fill="none" stroke="{self.colour}"'
        width = "" if self.width == 1.0 or self.filled else f' stroke-width="{self.width:g}"'
        dash = f' stroke-dasharray="{self.dash}"' if self.dash else ""
        opacity = "" if self.opacity == 1.0 else f' opacity="{self.opacity:.2g}"'
        note = f"<title>{escape(self.note)}</title>" if self.note else ""
        return f'<path d="{path}" {look}{width}{dash}{opacity}>{note}</path>'

    def plot(self, axes: Axes) -> None:
        """Plot into axes in pixels."""
        from matplotlib.collections import LineCollection, PolyCollection

        if self.filled:
            areas = PolyCollection(self.lines, facecolors=self.colour, alpha=self.opacity, linewidths=0.0)
            axes.add_collection(areas)
            return
        dash = (0, [float(length) / self.width for length in self.dash.split()]) if self.dash else "-"
        width = self.width * POINTS
        lines = LineCollection(self.lines, colors=self.colour, linewidths=width, linestyles=[dash], alpha=self.opacity)
        axes.add_collection(lines)


@dataclass(frozen=True, kw_only=True)
class Label:
    """A line of text."""

    x: float
    y: float  #: of its base
    text: str
    anchor: Literal["start", "middle", "end"] = "middle"
    upwards: bool = False

    def move(self, right: float, down: float) -> Label:
        """Return the text elsewhere."""
        return replace(self, x=self.x + right, y=self.y + down)

    def to_svg(self) -> str:
        """Return an element of an SVG file."""
        place = f'x="{self.x:.1f}" y="{self.y:.1f}"'
        if self.upwards:
            place = f'transform="translate({self.x:.1f} {self.y:.1f}) rotate(-90)"'
        return f'<text {place} text-anchor="{self.anchor}">{escape(self.text)}</text>'

    def plot(self, axes: Axes) -> None:
        """Plot into axes in pixels."""
        turned = {"rotation": 90, "rotation_mode": "anchor"} if self.upwards else {}
        aligned = {"ha": ALIGNED[self.anchor], "va": "baseline", "parse_math": False, "fontsize": FONT * POINTS}
        axes.text(self.x, self.y, self.text, **aligned, **turned)  # type: ignore[arg-type]


@dataclass(frozen=True, kw_only=True, eq=False)
class Drawing:
    """Shapes, the first one at the bottom."""

    width: float
    height: float
    shapes: Sequence[Stroke | Label]
    time: tuple[float, float, float, float] | None = None  #: of an axis of time: its ends in pixels and in seconds

    def to_svg(self) -> str:
        """Return an SVG file."""
        time = "" if self.time is None else f' data-time="{" ".join(f"{end:.4g}" for end in self.time)}"'
        view = f'xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {self.width:g} {self.height:.0f}"{time}'
        body = "\n".join(shape.to_svg() for shape in self.shapes)
        return f'<svg {view} font-family="sans-serif" font-size="{FONT}">\n{body}\n</svg>\n'

    def to_figure(self) -> Figure:
        """Return a Matplotlib figure."""
        with use_style():
            figure = make_figure(self.width / PIXELS_PER_INCH, self.height / PIXELS_PER_INCH)
            figure.set_layout_engine("none")
            axes = figure.add_axes((0.0, 0.0, 1.0, 1.0), xlim=(0.0, self.width), ylim=(self.height, 0.0))
            axes.set_axis_off()
            for shape in self.shapes:
                shape.plot(axes)
        return figure


def place_drawings(drawings: Sequence[Drawing], columns: int = 2) -> Drawing:
    """Return drawings row by row in columns of the first one's size."""
    columns = min(columns, len(drawings))
    width, height = drawings[0].width, max(drawing.height for drawing in drawings)
    shapes = [
        shape.move(width * (k % columns), height * (k // columns))
        for k, drawing in enumerate(drawings)
        for shape in drawing.shapes
    ]
    return Drawing(width=width * columns, height=height * -(-len(drawings) // columns), shapes=shapes)


def draw_legend(
    entries: Sequence[tuple[str, str, str]], left: float, top: float, width: float
) -> tuple[list[Stroke | Label], float]:
    """Draw samples of lines (words, colour, dash) row by row within a width, and return the shapes and their height."""
    shapes: list[Stroke | Label] = []
    x, y = left, top + 8
    for words, colour, dash in entries:
        if x + 46 + LETTER * len(words) > width and x > left:
            x, y = left, y + LINE
        shapes.append(Stroke(lines=[np.array([[x, y], [x + 26, y]])], colour=colour, width=2.0, dash=dash))
        shapes.append(Label(x=x + 31, y=y + 4, text=words, anchor="start"))
        x += 46 + LETTER * len(words)
    return shapes, y - top + 10
