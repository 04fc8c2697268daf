"""Exchange with others: ``nlp-gait import`` and ``verify``."""

from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from compare.analysis.comparison import compare_problems
from compare.archive import pack_study, verify_archive, verify_folder
from compare.cli.command import OUTPUT, OUTPUT_FILE, command
from compare.cli.compare import describe_summaries, list_excluded, summarise_problems
from compare.cli.options import RESULTS, Code, NamedProblem, name_all, parse_number
from compare.cli.printing import Output, show_progress
from compare.report import renew_report, write_report
from compare.study.evidence import read_evidence
from compare.study.import_runs import import_runs
from compare.study.record_files import write_records
from compare.study.settings import read_manifest

FINALS = "One row per run: the variables, and where known run, seed, objective, violation, evaluations, time_s."
HISTORY = "Best so far: run, evaluations, objective and optionally time_s."
EVALUATIONS = "Evaluations of every run, if neither file has them; leave it out if they are unknown."
PACK = "Check the records of the folder, and pack the study for others."
RERUN = "Runs to repeat, drawn at random, 0% to 100% (default: one of each solver and problem)."


@command
def import_results(
    *,
    problem: NamedProblem,
    finals: Annotated[Path, Argument(metavar="FINALS.csv", help=FINALS)],
    history: Annotated[Path | None, Option(metavar="FILE.csv", help=HISTORY)] = None,
    label: Annotated[str, Option("--as", help='Name in the report, for example "GA (MATLAB)".')],
    evaluations: Annotated[int | None, Option(min=1, max=9223372036854775807, help=EVALUATIONS)] = None,
    out: Annotated[Path, Option(help="Folder of a new or existing study."), OUTPUT] = RESULTS,
) -> Output:
    """Import results of other programs into a study, judged and reported like all others.

    Example: `nlp-gait import nao-ssp finals.csv --history histories.csv --as "GA (MATLAB)" --out study`
    """
    spec = problem.spec()
    records = import_runs(spec, finals, label, history, evaluations)
    kept = write_records(records, out)
    evidence, report = renew_report(out)
    shown = compare_problems([record for record in evidence.records if record.problem == spec.title])
    return Output(
        data={"problems": summarise_problems(shown)},
        parts=list(describe_summaries(shown)),
        written=[*report, *kept],
        failures=list_excluded(evidence.sentences),
    )


@command
def verify(
    *,
    study: Annotated[Path, Argument(metavar="DIR_OR_ZIP", help="Folder of a study, or its archive.")],
    pack: Annotated[Path | None, Option(metavar="FILE.zip", help=PACK), OUTPUT_FILE] = None,
    rerun: Annotated[str | None, Option(metavar="SHARE", help=RERUN)] = None,
    code: Code = None,
) -> Output:
    """Check a study: evaluate every point, repeat random runs, write the report again, compare planned runs, proofs and hashes.

    Prints what holds, what does not and what was not checked; the exit status is 1 if anything does not hold. Times are as
    recorded. User code runs only if named with --code.

    With `--pack` the records are checked, the report is rewritten, and both are packed with user code, robots, certificates,
    versions, hashes and how to repeat the study; `nlp-gait verify FILE.zip` checks the archive on any machine.

    Examples: `nlp-gait verify results`, `nlp-gait verify results --pack study.zip`, `nlp-gait verify study.zip --rerun 5%`
    """
    share = None
    if rerun is not None:
        share = parse_number("the share", rerun.removesuffix("%"), "--rerun", least=0.0, most=100.0) / 100.0
    name_all(code)
    if pack is not None:
        return _pack(study, pack)
    with show_progress("repeated runs", None) as advance:
        check = verify_folder if study.is_dir() else verify_archive
        verification = check(study, share=share, progress=advance)
    findings = verification.findings
    wrong = [finding for finding in findings if finding.holds is False]
    return Output(
        data={"holds": not wrong, "findings": [finding._asdict() for finding in findings], "scope": verification.scope},
        parts=[finding.sentence for finding in findings],
        answer=verification.scope,
        failures=[f"{len(wrong)} of {len(findings)} checks do not hold"] if wrong else [],
    )


def _pack(folder: Path, target: Path) -> Output:
    evidence = read_evidence(folder)  # verification of the archive judges all points between the samples
    failures = list_excluded(evidence.sentences)
    if failures:
        return Output(data={"records": 0}, failures=failures)
    write_report(folder, evidence.records, read_manifest(folder))
    written = [pack_study(folder, evidence.records, target)]
    return Output(data={"records": len(evidence.records)}, written=written)
