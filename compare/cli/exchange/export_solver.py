"""``nlp-gait export-solver``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from compare.cli.command import command
from compare.cli.common import print_result
from compare.cli.options import AsJson, NamedProblem


@command
def export_solver(
    to: Annotated[Path, typer.Option("--to", help="Folder for the files.")],
    *,
    problem: NamedProblem,
    as_json: AsJson = False,
) -> None:
    """Write a problem's NLP with first and second derivatives as plain C++ with a C header, for a solver on board.

    The files need libc and libm only: source, header (order of variables, sparsity, bounds), build line, an example in C.

    Example: `nlp-gait export-solver nao-ssp --to DIR`, then `sh DIR/build.sh && DIR/main`
    """
    from nlp_gait.export.solver import export_solver as write

    loaded = problem.spec().load()
    print_result(as_json, {"problem": loaded.address}, write(loaded, to), lambda: None)
