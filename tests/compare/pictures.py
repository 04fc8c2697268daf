"""Small pictures for tests, which are drawn as the real ones in a tenth of the time."""

from __future__ import annotations

from pathlib import Path

from matplotlib.figure import Figure


def save_coarsely(figure: Figure, stem: Path) -> tuple[Path, Path]:
    """Write a picture of few pixels and an empty drawing."""
    png, svg = (stem.with_name(f"{stem.name}.{kind}") for kind in ("png", "svg"))
    figure.set_layout_engine("none")
    figure.savefig(png, dpi=20)
    svg.write_text("<svg>" + 1000 * " " + "</svg>", encoding="utf-8")
    return png, svg
