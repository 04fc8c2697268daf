"""Exchange with others: ``nlp-gait import`` and ``verify``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from compare.analysis.comparison import label_editions
from compare.cli.command import OUTPUT, OUTPUT_FILE, command
from compare.cli.compare import print_summaries, summarise_problems
from compare.cli.endings import end_if_excluded, fail
from compare.cli.options import RESULTS, AsJson, Code, NamedProblem, name_all
from compare.cli.outputs import check_output_file
from compare.cli.printing import print_json, print_result, show_progress, stdout
from compare.study.evidence import read_evidence
from compare.study.import_runs import import_runs
from compare.study.record_files import write_record
from compare.study.settings import read_manifest
from nlp_gait.errors import InputError
from nlp_gait.files import make_writable_folder

if TYPE_CHECKING:
    from compare.archive import Finding


@command
def import_results(
    *,
    problem: NamedProblem,
    finals: Annotated[
        Path,
        typer.Argument(
            metavar="FINALS.csv",
            help="One row per run: the variables, and where known run, seed, objective, violation, "
            "evaluations, time_s.",
        ),
    ],
    history: Annotated[
        Path | None,
        typer.Option(metavar="FILE.csv", help="Best so far: run, evaluations, objective and optionally time_s."),
    ] = None,
    label: Annotated[str, typer.Option("--as", help='Name in the report, for example "GA (MATLAB)".')],
    evaluations: Annotated[
        int | None,
        typer.Option(
            min=1,
            max=9223372036854775807,
            help="Evaluations of every run, if neither file has them; leave it out if they are unknown.",
        ),
    ] = None,
    out: Annotated[Path, typer.Option(help="Folder of a new or existing study."), OUTPUT] = RESULTS,
    as_json: AsJson = False,
) -> None:
    """Import results of other programs into a study, judged and reported like all others.

    Example: `nlp-gait import nao-ssp finals.csv --history histories.csv --as "GA (MATLAB)" --out study`
    """
    from compare.report import write_report

    spec = problem.spec()
    records = import_runs(spec, finals, label, history, evaluations)
    kept = [write_record(record, make_writable_folder(out)) for record in records]
    evidence = read_evidence(out)
    everything = label_editions(evidence.records)
    report = write_report(
        out,
        everything,
        read_manifest(out),
        excluded=evidence.excluded,
    )
    written = [*kept, *report]
    shown = [record for record in everything if record.problem == spec.title]
    print_result(as_json, {"problems": summarise_problems(shown)}, written, lambda: print_summaries(shown))
    end_if_excluded(evidence.sentences)


@command
def verify(
    *,
    study: Annotated[Path, typer.Argument(metavar="DIR_OR_ZIP", help="Folder of a study, or its archive.")],
    pack: Annotated[
        Path | None,
        typer.Option(metavar="FILE.zip", help="Check the records of the folder, and pack the study for others."),
        OUTPUT_FILE,
    ] = None,
    rerun: Annotated[
        str,
        typer.Option(metavar="SHARE", help="Also repeat a random share of the runs, such as 5%: same seed, same bits."),
    ] = "0%",
    code: Code = None,
    as_json: AsJson = False,
) -> None:
    """Check a study: evaluate every point again, check histories, hashes, sessions, certificates and, of an archive, the report.

    Prints what holds and what does not; the exit status is 1 if anything does not. User code runs only if named with --code.

    With `--pack` the records are checked, the report is rewritten, and both are packed with user code, robots, certificates,
    versions, hashes and how to repeat the study; `nlp-gait verify FILE.zip` checks the archive on any machine.

    Examples: `nlp-gait verify results`, `nlp-gait verify results --pack study.zip`, `nlp-gait verify study.zip --rerun 5%`
    """
    from compare.archive import verify_archive, verify_folder

    share = _parse_share(rerun)
    name_all(code)
    if pack is not None:
        _pack(study, check_output_file(pack), as_json)
        return
    with show_progress("repeated runs", None) as advance:
        check = verify_folder if study.is_dir() else verify_archive
        findings = check(study, share=share, progress=advance).findings
    print_findings(findings, as_json)


def _pack(folder: Path, target: Path, as_json: bool) -> None:
    from compare.archive import pack_study
    from compare.report import write_report

    evidence = read_evidence(folder, "all")
    end_if_excluded(evidence.sentences)
    write_report(folder, label_editions(evidence.records), read_manifest(folder))
    written = [pack_study(folder, evidence.records, target)]
    print_result(as_json, {"records": len(evidence.records)}, written, lambda: None)


def print_findings(findings: Sequence[Finding], as_json: bool) -> None:
    """Print what a verification found, and end with status 1 if anything does not hold."""
    wrong = [finding for finding in findings if not finding.holds]
    if as_json:
        print_json({"holds": not wrong, "findings": [finding._asdict() for finding in findings]})
    else:
        for finding in findings:
            stdout.print(finding.sentence, soft_wrap=True)
    if wrong:
        fail(f"{len(wrong)} of {len(findings)} checks do not hold")


def _parse_share(text: str) -> float:
    """Return a share from 0 to 1 of a text in percent."""
    try:
        share = float(text.removesuffix("%")) / 100.0
    except ValueError:
        share = -1.0
    if not 0.0 <= share <= 1.0:
        raise InputError(f"--rerun takes a share from 0% to 100%, got {text!r}")
    return share
