"""``nlp-gait reproduce``."""

from __future__ import annotations

from importlib import import_module
from pathlib import Path
from typing import Annotated

import typer

from compare.cli.command import command
from compare.cli.common import print_written, progress_bar
from compare.cli.interrupts import interruptible
from nlp_gait.errors import unknown

# Modules with `reproduce(out, *, progress)`, which writes `out/report.md`, and `STEPS`, how often it calls progress, if known.
REPRODUCTIONS = {
    "nao": "compare.papers.nao.nao_reproduction",
    "nao-pareto": "compare.papers.nao_pareto.nao_pareto_reproduction",
    "walk12": "compare.papers.walk12.walk12_reproduction",
    "stairs": "compare.papers.stairs.stairs_reproduction",
    "nao-claims": "compare.papers.nao_walk.nao_walk_reproduction",
}


@command
def reproduce(
    paper: Annotated[str, typer.Argument(metavar="PAPER", help=", ".join(REPRODUCTIONS))],
    out: Annotated[
        Path, typer.Option(help="Folder for the report, its tables and figures; finished results are stored in it.")
    ],
) -> None:
    """Compute a paper's tables and figures anew and put them beside the printed ones.

    Example: `nlp-gait reproduce nao --out reproduction`
    """
    if paper not in REPRODUCTIONS:
        raise unknown("reproduction", paper, REPRODUCTIONS)
    module = import_module(REPRODUCTIONS[paper])
    with interruptible(out), progress_bar(paper, getattr(module, "STEPS", None)) as advance:
        module.reproduce(out, progress=advance)
    print_written(out / "report.md")
