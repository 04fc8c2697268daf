"""``nlp-gait report``."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Annotated

import typer

from compare.cli.command import command
from compare.cli.common import print_result
from compare.cli.options import AsCsv, AsJson
from nlp_gait.errors import InputError


@command
def report(
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a study: the --out of `compare`.")],
    gradient_weight: Annotated[
        float | None, typer.Option(min=0.0, help="Evaluations that a first derivative counts as (default n + 1).")
    ] = None,
    hessian_weight: Annotated[
        float | None, typer.Option(min=0.0, help="Evaluations that a Hessian counts as (default (n + 1)(n + 2)/2).")
    ] = None,
    as_csv: AsCsv = False,
    as_json: AsJson = False,
) -> None:
    """Write a study's report anew from all records of its folder, without running anything.

    Solvers that a later call left out are there too; runs of an earlier definition stand under a name that says how it differs.

    Examples: `nlp-gait report results`, `nlp-gait report results --gradient-weight 5`
    """
    from compare.analysis.statistics.run_length import Weighting
    from compare.report import rebuild_report

    for flag, weight in (("--gradient-weight", gradient_weight), ("--hessian-weight", hessian_weight)):
        if weight is not None and not math.isfinite(weight):
            raise InputError(f"{flag} must be a finite number, got {weight}")
    weighting = Weighting(gradient=gradient_weight, jacobian=gradient_weight, hessian=hessian_weight)
    written = rebuild_report(folder, weighting, as_csv=as_csv)
    print_result(as_json, {}, written, lambda: None)
