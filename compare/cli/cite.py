"""``nlp-gait cite``."""

from __future__ import annotations

from typing import Annotated

import typer

from compare.cli.command import command
from compare.cli.common import print_json, stdout
from compare.cli.options import AsJson


@command
def cite(
    name: Annotated[
        str | None,
        typer.Argument(
            metavar="[PROBLEM|PAPER|INSTANCE]",
            help="What you used: a problem (`nlp-gait list`), a paper (nao, walk12, stairs) or an instance of GaitBench; "
            "everything without it.",
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Print BibTeX for the software, and for the papers and the suite that a problem comes from.

    Examples: `nlp-gait cite`, `nlp-gait cite nao-ssp`, `nlp-gait cite ssp-v5`
    """
    from compare.study.citations import find_citations

    found = find_citations(name)
    if as_json:
        print_json({"entries": found})
    else:
        stdout.print("\n\n".join(found), soft_wrap=True)
