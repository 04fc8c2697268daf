"""``nlp-gait export-objective``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from compare.cli.command import command
from compare.cli.common import print_result
from compare.cli.options import AsJson


@command
def export_objective(
    instance: Annotated[str, typer.Argument(metavar="INSTANCE", help="Of GaitBench, for example ssp-v5.")],
    to: Annotated[Path, typer.Option("--to", help="Folder for the files.")],
    as_json: AsJson = False,
) -> None:
    """Write an instance of GaitBench as plain C++ with a C header, for C, MATLAB, Octave and Julia.

    The files need libc and libm only: source, header, build line, an example in C, and callers for the others.

    Example: `nlp-gait export-objective ssp-v5 --to DIR`, then `sh DIR/build.sh && DIR/main < /dev/null`
    """
    from nlp_gait import gaitbench
    from nlp_gait.gaitbench.c_export import export_objective as export

    written = export(gaitbench.load(instance), to)
    print_result(as_json, {"instance": instance}, written, lambda: None)
