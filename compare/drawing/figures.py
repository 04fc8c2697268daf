"""Style, colours, legends and files (PNG, SVG) of all figures."""

from __future__ import annotations

import io
import math
import re
from collections import Counter
from collections.abc import Collection, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

from compare.drawing import STYLE
from nlp_gait.files import replace_file
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
