"""``nlp-gait import``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from compare.cli.command import command
from compare.cli.common import print_result
from compare.cli.compare import print_summaries, summarise_problems
from compare.cli.options import RESULTS, AsCsv, AsJson, NamedProblem


@command
def import_results(
    *,
    problem: NamedProblem,
    finals: Annotated[
        Path,
        typer.Argument(
            metavar="FINALS.csv",
            help="One row per run: the variables, and optionally run, seed, objective, violation, evaluations, time_s.",
        ),
    ],
    history: Annotated[
        Path | None,
        typer.Option(metavar="FILE.csv", help="Best so far: run, evaluations, objective and optionally time_s."),
    ] = None,
    label: Annotated[str, typer.Option("--as", help='Name in the report, for example "GA (MATLAB)".')],
    evaluations: Annotated[
        int | None, typer.Option(min=1, help="Evaluations of every run, if neither file has them.")
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder of a new or existing study.")] = RESULTS,
    as_csv: AsCsv = False,
    as_json: AsJson = False,
) -> None:
    """Import results of other programs into a study, judged and reported like all others.

    Example: `nlp-gait import nao-ssp finals.csv --history histories.csv --as "GA (MATLAB)" --out study`
    """
    from compare.analysis.comparison import label_editions
    from compare.report import write_report
    from compare.study.import_runs import import_runs
    from compare.study.manifest import read_manifest
    from compare.study.record_files import read_records, write_record
    from nlp_gait.files import make_writable_folder

    spec = problem.spec()
    records = import_runs(spec, finals, label, history, evaluations)
    kept = [write_record(record, make_writable_folder(out)) for record in records]
    everything = label_editions(read_records(out))
    written = [*kept, *write_report(out, everything, read_manifest(out), as_csv=as_csv)]
    shown = [record for record in everything if record.problem == spec.title]
    print_result(as_json, {"problems": summarise_problems(shown)}, written, lambda: print_summaries(shown))
