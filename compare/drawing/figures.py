"""Style, colours, legends and files of all figures; drawings of lines and words: SVG for pages, Matplotlib for PNG and PDF."""

from __future__ import annotations

import io
import math
import re
from collections import Counter
from collections.abc import Collection, Iterator, Sequence
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, replace
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from compare.drawing import STYLE
from nlp_gait.files import replace_file
from nlp_gait.formulation import Array
from nlp_gait.interrupts import delay_interrupts

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

# One colour for each solver in every figure (Okabe and Ito); others get the remaining ones in order.
COLOURS = {
    "ipopt": "#000000",
    "pso": "#0072B2",
    "pso-constant": "#56B4E9",
    "ga": "#D55E00",
    "ga-goswami": "#D55E00",
    "aco": "#009E73",
    "aco-grid": "#CC79A7",
    "cma": "#E69F00",
    "cma-es": "#E69F00",
    "de": "#56B4E9",
}
LINES = ("-", "--", ":", "-.")
# Ink of axes and text in figures inside a page: replaced by the page's own colour there.
INK = "#000000"
LEGS = {"left": "#7A5CC0", "right": "#A07D1C", "trunk": INK}  # unlike those of solvers
SUPERSCRIPTS = str.maketrans("-0123456789", "\u207b\u2070\u00b9\u00b2\u00b3\u2074\u2075\u2076\u2077\u2078\u2079")


class Look(NamedTuple):
    """Colour and line of a solver."""

    colour: str
    line: str


def assign_looks(names: Collection[str]) -> dict[str, Look]:
    """Assign a look to each solver: known solvers have fixed colours; solvers with the same colour get different lines.

    Within ``share_looks`` a solver looks the same in all figures.
    """
    used: Counter[str] = Counter()
    looks: dict[str, Look] = {}
    for name in sorted({*names, *_STUDIED.get()}, key=lambda name: (name.lower() not in COLOURS, name)):
        # An unknown solver gets the least used colour.
        colour = COLOURS.get(name.lower()) or min((c for c in COLOURS.values() if c != INK), key=lambda c: used[c])
        looks[name] = Look(colour=colour, line=LINES[used[colour] % len(LINES)])
        used[colour] += 1
    return {name: looks[name] for name in names}


_STUDIED: ContextVar[frozenset[str]] = ContextVar("names of all solvers of the study", default=frozenset())


@contextmanager
def share_looks(names: Collection[str]) -> Iterator[None]:
    """Within the context, assign looks as if every figure showed all of these solvers."""
    token = _STUDIED.set(frozenset(names))
    try:
        yield
    finally:
        _STUDIED.reset(token)


@contextmanager
def use_style() -> Iterator[None]:
    """Use the project's Matplotlib style within the context."""
    import matplotlib

    with matplotlib.rc_context(fname=STYLE):
        yield


def make_figure(width_in: float = 6.3, height_in: float = 3.0) -> Figure:
    """Return an empty figure of a size [inch]; use inside ``use_style()``."""
    from compare.drawing.notebook_figure import NotebookFigure

    return NotebookFigure(figsize=(width_in, height_in))


def make_axes(width_in: float, height_in: float = 3.0) -> tuple[Figure, Axes]:
    """Return an empty figure of a size [inch], see ``make_figure``, and its only axes."""
    figure = make_figure(width_in, height_in)
    return figure, figure.subplots()


def format_power_of_ten(value: float) -> str:
    """Format a power of ten: 10\u207b\u2074, 1, 10, 10\u00b2."""
    exponent = round(math.log10(value))
    return ("1", "10")[exponent] if exponent in (0, 1) else "10" + str(exponent).translate(SUPERSCRIPTS)


def save_figure(figure: Figure, path: Path) -> Path:
    """Write a figure as PNG or PDF and return the path; raises OutputError."""
    kind = path.suffix.removeprefix(".")
    metadata = {"CreationDate": None, "Creator": None, "Producer": None} if kind == "pdf" else None
    with use_style(), replace_file(path) as file, delay_interrupts():
        figure.savefig(file, format=kind, metadata=metadata)
    return path


def render_svg(figure: Figure) -> str:
    """Return a figure as an SVG file; equal figures give equal text."""
    text = io.StringIO()
    with delay_interrupts(), use_style():  # Matplotlib's compiled code turns Ctrl-C into other errors
        figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    return re.sub(r"(\d\.\d\d)\d+", r"\1", text.getvalue())  # coordinates in points


def inline_svg(svg: str, prefix: str, title: str) -> str:
    """Return an SVG file as an element of an HTML page: without background, with ink in the page's colour.

    Ids begin with the prefix, letters and digits that are unique in the page; the title is the alternative text.
    """
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg[svg.index("<svg") :], flags=re.DOTALL)
    svg = re.sub(r'(\bid="|url\(#|href="#)', rf"\1{prefix}-", svg)
    svg = svg.replace("fill: #ffffff", "fill: none").replace(INK, "currentColor").replace("#d0d0d0", "var(--grid)")
    # Text without a fill is black by default, in a dark page too.
    return svg.replace("<svg ", f'<svg role="img" aria-label="{title}" fill="currentColor" ', 1)


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
