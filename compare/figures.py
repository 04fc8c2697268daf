"""What every figure shares: the project's style, and saving as PNG and SVG without a display."""

from __future__ import annotations

import io
import re
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from nlp_gait.errors import OutputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# One colour for each solver in every figure (Okabe and Ito); others take those that are left in their order.
COLOURS = {
    "ipopt": "#000000",
    "pso": "#0072B2",
    "ga": "#D55E00",
    "aco": "#009E73",
    "aco-grid": "#CC79A7",
    "cma": "#E69F00",
    "de": "#56B4E9",
}
LINES = ("-", "--", ":", "-.")
MARKERS = ("o", "s", "^", "D")
# Ink of axes and text in figures inside a page: replaced by the page's own colour there.
INK = "#000000"


@dataclass(frozen=True, kw_only=True)
class Look:
    """Colour, line and marker of a solver."""

    colour: str
    line: str
    marker: str


def looks(names: Sequence[str]) -> list[Look]:
    """A look for each solver, different for all: known ones have their colour, a colour's second user another line."""
    used: Counter[str] = Counter()
    found = []
    for name in names:
        base = name.split("+")[0]
        colour = COLOURS.get(name) or COLOURS.get(base)
        if colour is None:
            free = [c for c in COLOURS.values() if c not in (COLOURS.get(other) for other in names)] or list(COLOURS.values())
            colour = min(free, key=lambda c: used[c])
        kind = used[colour]
        used[colour] += 1
        found.append(Look(colour=colour, line=LINES[kind % len(LINES)], marker=MARKERS[kind % len(MARKERS)]))
    return found


@contextmanager
def style() -> Iterator[None]:
    """The project's matplotlib style, for the figures made inside."""
    import matplotlib

    with matplotlib.rc_context(fname=Path(__file__).with_name("gait.mplstyle")):
        yield


def new_figure(width_in: float = 6.3, height_in: float = 3.0) -> Figure:
    """Empty figure of a size [inch] that fits a printed column; to be used inside ``style()``."""
    from matplotlib.figure import Figure

    return Figure(figsize=(width_in, height_in))


def save(figure: Figure, stem: Path) -> tuple[Path, Path]:
    """Write ``<stem>.png`` and ``<stem>.svg``; returns both paths.

    Raises:
        OutputError: they cannot be written.
    """
    paths = stem.with_name(f"{stem.name}.png"), stem.with_name(f"{stem.name}.svg")
    try:
        with style():
            figure.savefig(paths[0])
            figure.savefig(paths[1], metadata={"Date": None})
    except OSError as error:
        raise OutputError(f"cannot write {str(stem)!r}.png and .svg: {error.strerror}") from error
    return paths


def inline_svg(figure: Figure, prefix: str, title: str) -> str:
    """Figure as an SVG element for an HTML page: its ink takes the page's colour, its ids begin with the prefix.

    Args:
        figure: drawn in ``style()``.
        prefix: letters and digits, unique in the page.
        title: alternative text, plain letters.
    """
    text = io.StringIO()
    with style():
        figure.savefig(text, format="svg", transparent=True, metadata={"Date": None, "Creator": None})
    svg = text.getvalue()
    svg = svg[svg.index("<svg") :]
    svg = re.sub(r"<metadata>.*?</metadata>", "", svg, flags=re.DOTALL)
    svg = re.sub(r'\bid="', f'id="{prefix}-', svg)
    svg = re.sub(r"url\(#", f"url(#{prefix}-", svg)
    svg = re.sub(r'href="#', f'href="#{prefix}-', svg)
    svg = svg.replace(INK, "currentColor").replace("#d0d0d0", "var(--grid)")
    # Text without a fill is black by default, in a dark page too.
    return svg.replace("<svg ", f'<svg role="img" aria-label="{title}" fill="currentColor" ', 1)
