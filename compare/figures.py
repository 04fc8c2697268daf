"""What every figure shares: the project's style, and saving as PNG and SVG without a display."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING

from nlp_gait.errors import OutputError

if TYPE_CHECKING:
    from matplotlib.figure import Figure

# One colour for each solver in every figure (Okabe and Ito).
COLOURS = {
    "ipopt": "#000000",
    "pso": "#0072B2",
    "ga": "#D55E00",
    "aco": "#009E73",
    "aco-grid": "#CC79A7",
    "cma": "#E69F00",
    "de": "#56B4E9",
}


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
