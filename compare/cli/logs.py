"""``nlp-gait logs``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

import typer

from compare.cli.command import command
from compare.cli.common import print_result, stdout
from compare.cli.options import AsJson


@command
def logs(
    folder: Annotated[
        Path, typer.Argument(metavar="DIR", help="Folder of a study: the --out of `compare` or `bench`.")
    ],
    to: Annotated[Path, typer.Option("--to", help="Folder for the logs.")],
    form: Annotated[
        Literal["ioh", "coco"], typer.Option("--format", help="IOHprofiler's JSON, or COCO-like data.")
    ] = "ioh",
    as_json: AsJson = False,
) -> None:
    """Write a study's runs as logs that iohinspector and IOHanalyzer read.

    The logs contain the relative gap to the best known objective, and equivalent evaluations.

    Example: `nlp-gait logs results --to logs --format ioh`
    """
    from compare.analysis.comparison import compare_problems
    from compare.bench.leaderboard import load_references
    from compare.logs import write_coco, write_ioh
    from compare.study.record_files import read_records
    from nlp_gait import gaitbench

    records = read_records(folder)
    instances = [id for id in gaitbench.names() if any(record.problem == id for record in records)]
    comparisons = compare_problems(records, references=load_references(instances))
    written = (write_ioh if form == "ioh" else write_coco)(comparisons, to)
    data = {"problems": [comparison.problem for comparison in comparisons], "runs": len(records)}
    print_result(
        as_json,
        data,
        () if not as_json else written,
        lambda: stdout.print(f"wrote {len(written)} files to {to}", soft_wrap=True),
    )
