"""Exchange with others: ``nlp-gait import``, ``logs``, ``archive``, ``verify`` and ``cite``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

import typer

from compare.analysis.comparison import compare_problems, label_editions
from compare.analysis.solver_table import describe_unknown
from compare.cli.command import OUTPUT, command
from compare.cli.compare import print_summaries, summarise_problems
from compare.cli.endings import end_if_excluded, fail
from compare.cli.options import RESULTS, AsCsv, AsJson, Code, NamedProblem, name_all
from compare.cli.outputs import check_output_file
from compare.cli.printing import print_json, print_result, print_written, say, show_progress, stdout
from compare.logs import write_coco, write_ioh
from compare.study.citations import find_citations
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
    as_csv: AsCsv = False,
    as_json: AsJson = False,
) -> None:
    """Import results of other programs into a study, judged and reported like all others.

    Example: `nlp-gait import nao-ssp finals.csv --history histories.csv --as "GA (MATLAB)" --out study`
    """
    from compare.report import FurtherFiles, write_report

    spec = problem.spec()
    records = import_runs(spec, finals, label, history, evaluations)
    kept = [write_record(record, make_writable_folder(out)) for record in records]
    evidence = read_evidence(out)
    everything = label_editions(evidence.records)
    report = write_report(
        out, everything, read_manifest(out), excluded=evidence.excluded, further=FurtherFiles(csv=as_csv)
    )
    written = [*kept, *report]
    shown = [record for record in everything if record.problem == spec.title]
    print_result(as_json, {"problems": summarise_problems(shown)}, written, lambda: print_summaries(shown))
    end_if_excluded(evidence.sentences)


@command
def logs(
    folder: Annotated[
        Path, typer.Argument(metavar="DIR", help="Folder of a study: the --out of `compare` or `bench`.")
    ],
    to: Annotated[Path, typer.Option("--to", help="Folder for the logs."), OUTPUT],
    form: Annotated[
        Literal["ioh", "coco"], typer.Option("--format", help="IOHprofiler's JSON, or COCO-like data.")
    ] = "ioh",
    as_json: AsJson = False,
) -> None:
    """Write a study's runs as logs that iohinspector and IOHanalyzer read.

    The logs contain the relative gap to the best known objective, and equivalent evaluations.

    Example: `nlp-gait logs results --to logs --format ioh`
    """
    evidence = read_evidence(folder)
    records = evidence.records
    comparisons = compare_problems(records)
    for sentence in (s for comparison in comparisons for s in describe_unknown(comparison)):
        say(f"not in the logs: {sentence}")
    written = (write_ioh if form == "ioh" else write_coco)(comparisons, to)
    data = {"problems": [comparison.problem for comparison in comparisons], "runs": len(records)}
    listed = written if as_json else ()  # there are hundreds
    print_result(as_json, data, listed, lambda: stdout.print(f"wrote {len(written)} files to {to}", soft_wrap=True))
    end_if_excluded(evidence.sentences)


@command
def archive(
    *,
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a study: the --out of `compare`.")],
    out: Annotated[Path, typer.Option(help="The archive to write."), OUTPUT] = Path("study.zip"),
    code: Code = None,
) -> None:
    """Pack a study for others: records, report, user code, robots, certificates, versions, hashes, and how to repeat it.

    All records are checked and the report is rewritten first. `nlp-gait verify FILE.zip` checks the archive on any machine.

    Example: `nlp-gait archive results --out study.zip`
    """
    from compare.archive import pack_study
    from compare.report import write_report

    name_all(code)
    target = check_output_file(out)
    evidence = read_evidence(folder, "all")
    end_if_excluded(evidence.sentences)
    write_report(folder, label_editions(evidence.records), read_manifest(folder))
    print_written(pack_study(folder, evidence.records, target))


@command
def verify(
    *,
    study: Annotated[Path, typer.Argument(metavar="DIR_OR_ZIP", help="Folder of a study, or its archive.")],
    rerun: Annotated[
        str,
        typer.Option(metavar="SHARE", help="Also repeat a random share of the runs, such as 5%: same seed, same bits."),
    ] = "0%",
    code: Code = None,
    as_json: AsJson = False,
) -> None:
    """Check a study: evaluate every point again, check histories, hashes, sessions, certificates and, of an archive, the report.

    Prints what holds and what does not; the exit status is 1 if anything does not. User code runs only if named with --code.

    Examples: `nlp-gait verify results`, `nlp-gait verify study.zip --rerun 5%`
    """
    from compare.archive import verify_archive, verify_folder

    share = _parse_share(rerun)
    name_all(code)
    with show_progress("repeated runs", None) as advance:
        check = verify_folder if study.is_dir() else verify_archive
        findings = check(study, share=share, progress=advance).findings
    print_findings(findings, as_json)


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


@command
def cite(
    name: Annotated[
        str | None,
        typer.Argument(
            metavar="[PROBLEM|PAPER|INSTANCE]",
            help="What you used: a problem (`nlp-gait list`), a paper (nao, walk12, stairs) or an "
            "instance of GaitBench; everything without it.",
        ),
    ] = None,
    as_json: AsJson = False,
) -> None:
    """Print BibTeX for the software, and for the papers and the suite that a problem comes from.

    Examples: `nlp-gait cite`, `nlp-gait cite nao-ssp`, `nlp-gait cite ssp-v5`
    """
    found = find_citations(name)
    if as_json:
        print_json({"entries": found})
    else:
        stdout.print("\n\n".join(found), soft_wrap=True)
