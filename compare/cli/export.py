"""``nlp-gait export``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from compare.cli.command import command
from compare.cli.common import output_file, print_written
from compare.cli.options import StoredGait
from nlp_gait.export.set_points import PERIOD_MS


@command
def export(
    stored: StoredGait,
    format_: Annotated[str, typer.Option("--format", help="webots, csv, json, mjcf or naoqi.")],
    out: Annotated[
        Path | None, typer.Option(help="File; by default beside the result, with the format's ending.")
    ] = None,
    period_ms: Annotated[int, typer.Option(min=1, max=86_400_000, help="Time between rows [ms].")] = PERIOD_MS,
) -> None:
    """Write a gait in a format that other tools read.

    Example: `nlp-gait export best.json --format webots` after `nlp-gait solve nao-ssp --out best.json`
    """
    from nlp_gait.export.formats import FORMATS, write_as

    loaded = stored.load()
    target = output_file(out or stored.result.with_name(stored.result.stem + FORMATS.get(format_, "")))
    write_as(format_, target, loaded, period_ms)
    print_written(target)
