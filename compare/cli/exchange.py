"""Exchange with others: ``nlp-gait import``, ``verify`` and ``export``."""

from collections.abc import Callable, Mapping
from functools import partial
from pathlib import Path
from typing import Annotated

from typer import Argument, Option

from compare.analysis.comparison import compare_problems
from compare.cli.command import FORCE, OUTPUT, OUTPUT_FILE, Output, Rows, command, report_interrupts, show_progress
from compare.cli.compare import describe_summaries, summarise_problems
from compare.cli.options import RESULTS, Code, NamedProblem, name_all, parse_number
from compare.judge import find_faults
from compare.report import renew_report, write_report
from compare.study.import_runs import import_runs
from compare.study.pack import pack_study, unpack_archive
from compare.study.record import load_result_or_record
from compare.study.study import read_study_file, write_records
from compare.study.verify import verify_study
from nlp_gait import gaitbench
from nlp_gait.errors import InputError, unknown
from nlp_gait.export.formats import FORMATS, PERIOD_MS, write_as
from nlp_gait.files import check_output, make_temporary_folder
from nlp_gait.formulation import Result
from nlp_gait.gaitbench.c_export import export_objective


@command
def import_results(
    *,
    problem: NamedProblem,
    finals: Annotated[Path, Argument(metavar="FINALS.csv")],
    history: Annotated[Path | None, Option(metavar="FILE.csv")] = None,
    label: Annotated[str, Option("--as")],
    evaluations: Annotated[int | None, Option(min=1, max=9223372036854775807)] = None,
    out: Annotated[Path, OUTPUT] = RESULTS,
) -> Output:
    """Import results of other programs into a study, judged and reported like all others.

    Example: `nlp-gait import nao-ssp finals.csv --history histories.csv --as "GA (MATLAB)" --out study`
    """
    spec = problem.spec()
    with show_progress("rows", None) as advance:
        imported = import_runs(
            spec, finals, label, history, evaluations, lambda done, total: advance(f"{done} of {total}")
        )
    kept = write_records(imported, out)
    records, damaged, report = renew_report(out)
    shown = compare_problems([record for record in records if record.problem == spec.title])
    return Output(
        data={"problems": summarise_problems(shown)},
        parts=list(describe_summaries(shown)),
        written=[*report, *kept],
        failures=damaged,
    )


@command
def verify(
    *,
    study: Annotated[Path, Argument(metavar="DIR_OR_ZIP")],
    pack: Annotated[Path | None, Option(metavar="FILE.zip"), OUTPUT_FILE] = None,
    share: Annotated[str, Option(metavar="SHARE")] = "100%",
    run_code: Annotated[bool, Option("--run-code")] = False,
    code: Code = None,
    out: Annotated[Path | None, OUTPUT] = None,
) -> Output:
    """Check a study: evaluate every point again, repeat its runs, and write its report and tables again.

    Lists what differs, what is missing and what was not repeated; the exit status is 1 if anything differs or is missing. User
    code runs only if it is named with --code, or packed and allowed by --run-code.

    With `--pack` the study is packed with its report and the user's files; `nlp-gait verify FILE.zip` checks it on any machine.

    Examples: `nlp-gait verify results`, `nlp-gait verify results --pack study.zip`, `nlp-gait verify study.zip --share 20%`
    """
    part = parse_number("the share", share.removesuffix("%"), "--share", least=0.0, most=100.0) / 100.0
    name_all(code)
    if pack is not None:
        records, damaged, _ = renew_report(study)
        written = [] if damaged else [pack_study(study, records, pack)]
        return Output(data={"records": len(records)}, written=written, failures=damaged)
    with make_temporary_folder("nlp-gait-verify-") as folder:
        if not study.is_dir():
            unpack_archive(study, folder)
        place = study if study.is_dir() else folder
        with show_progress("repeated runs", None) as advance:
            result = verify_study(
                place, share=part, run_code=run_code, progress=lambda done, total: advance(f"{done} of {total}")
            )
        written = write_report(out, result.records, read_study_file(place)) if out else []
    rows = [(row.what, row.kind, row.why) for row in result.rows]
    return Output(
        data={"holds": result.holds, "sentence": result.sentence, "rows": [row._asdict() for row in result.rows]},
        parts=[Rows("differences", ("what", "result", "why"), rows)] if rows else [],
        written=written,
        answer=[result.sentence],
        failures=[] if result.holds else ["the study is not verified, see the table"],
    )


@command
def export(
    source: Annotated[str, Argument(metavar="RESULT.json|PROBLEM")],
    *,
    to: Annotated[str, Option(metavar="KIND")],
    out: Annotated[Path | None, OUTPUT] = None,
    period_ms: Annotated[int, Option(min=1, max=86400000)] = PERIOD_MS,
    code: Code = None,
    force: Annotated[bool, Option("--force", help=FORCE)] = False,
) -> Output:
    """Write a gait for other tools or as a page in 3-D, or a problem's objective.

    C++ needs only libc and libm, and has a C header, a build script, an example in C, and callers for MATLAB, Octave and Julia.

    Examples: `nlp-gait export best.json --to webots` after `nlp-gait solve nao-ssp --out best.json`,
    `nlp-gait export best.json --to html`, `nlp-gait export ssp-v5 --to objective --out DIR`, then `sh DIR/build.sh && DIR/main`
    """
    if to not in (*GAITS, OBJECTIVE):
        raise unknown("kind", to, [*GAITS, OBJECTIVE])
    name_all(code)
    if to == OBJECTIVE:
        if out is None:
            raise InputError("--to objective writes several files; name their folder by --out DIR")
        written = export_objective(gaitbench.load(source), out, force)
        return Output(data={"source": source, "kind": to}, written=written)
    ending, write = GAITS[to]
    result, path = load_result_or_record(Path(source)), Path(source)
    target = check_output(out or path.with_name(path.stem + ending), force)
    faults = find_faults(result, path)
    with report_interrupts():
        write(target, result, period_ms)
    return Output(data={"source": source, "kind": to, "faults": faults}, parts=faults, written=[target])


def _write_page(path: Path, result: Result, period_ms: int) -> None:
    from compare.report.interactive import animate_gait

    animate_gait(result.problem, result.x, result.problem.name).write(path)


# Kinds of files for a gait: usual ending, and the function that writes it, with the time between rows [ms].
GAITS: Mapping[str, tuple[str, Callable[[Path, Result, int], None]]] = {
    **{name: (ending, partial(write_as, name)) for name, ending in FORMATS.items()},
    "html": (".html", _write_page),
}
OBJECTIVE = "objective"  # of a problem, as C++
