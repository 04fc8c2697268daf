"""``nlp-gait reproduce``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from compare.cli.command import command
from compare.cli.common import interruptible, print_written, progress_bar
from compare.papers import REPRODUCTIONS, load_reproduction


@command
def reproduce(
    paper: Annotated[str, typer.Argument(metavar="PAPER", help=", ".join(REPRODUCTIONS))],
    out: Annotated[
        Path, typer.Option(help="Folder for the report, its tables and figures; results stored in it are used again.")
    ],
    effort: Annotated[
        Literal["quick", "full"], typer.Option(help="As much as in the paper, or the least that fills every table.")
    ] = "full",
) -> None:
    """Recompute a paper's tables and figures next to the printed ones, and check its claims.

    Example: `nlp-gait reproduce nao --out reproduction`
    """
    reproduction = load_reproduction(paper)
    chosen = reproduction.quick if effort == "quick" else reproduction.full
    with interruptible(out), progress_bar(paper, chosen.steps) as advance:
        reproduction.reproduce(out, chosen, advance)
    print_written(out / "report.md")
