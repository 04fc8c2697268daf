"""``nlp-gait compare``."""

import inspect
from collections.abc import Sequence
from dataclasses import asdict, replace
from pathlib import Path
from typing import Annotated, Any

import typer

from compare.analysis.comparison import compare_problems
from compare.analysis.solver_table import HEADER, describe_unknown, find_failures, format_cells, summarise
from compare.analysis.tuning import tune_solvers
from compare.analysis.units import with_unit
from compare.analysis.verdict import describe_best_known
from compare.cli.command import OUTPUT, SESSION, command, get_marks
from compare.cli.endings import end_if_excluded, end_interrupted, fail, report_interrupts, say_error
from compare.cli.options import (
    RESULTS,
    AsJson,
    Code,
    Jobs,
    ProblemOptions,
    Scheduler,
    SearchOptions,
    Tune,
    name_all,
    parse_names,
)
from compare.cli.printing import (
    describe_command,
    print_result,
    print_table,
    say,
    show_progress,
    stderr,
    stdout,
)
from compare.study.import_runs import read_imported_records
from compare.study.record import RunRecord
from compare.study.run_study import Study, check_study, run_study
from compare.study.settings import (
    Session,
    SolverSpec,
    StudySettings,
    read_manifest,
    read_settings,
    resolve_user_code,
    write_manifest,
)
from compare.study.task import GRADIENT_SOLVERS, IPOPT
from metaheuristics import list_installed_algorithms
from nlp_gait.backends.kernel.compiled import available_cores
from nlp_gait.errors import InputError
from nlp_gait.files import make_writable_folder
from nlp_gait.interrupts import Interrupted

DEFAULT_PROBLEMS = ("nao-ssp", "nao-dsp")
DEFAULT_ALGORITHMS = "pso,ga,aco"
MOST_RUNS = 12  # of a problem whose runs are printed one by one
ALL, ALL_GRADIENT = "all", (IPOPT, "slsqp")


@command
def compare(
    *,
    context: typer.Context,
    problems: Annotated[
        list[str] | None, typer.Argument(metavar="[PROBLEM]...", help="Default: nao-ssp and nao-dsp.")
    ] = None,
    algorithms: Annotated[
        str,
        typer.Option(
            help="Searches and other solvers, separated by commas, see `nlp-gait list`; `pso` damps its inertia weight by 0.99 "
            "as the code that the NAO paper cites, because the constant weight that the paper prints, `pso-constant`, does not "
            "settle; `all` stands for every installed search, IPOPT and SLSQP."
        ),
    ] = DEFAULT_ALGORITHMS,
    starts: Annotated[
        int, typer.Option(min=0, max=100000, help="Starts of IPOPT and other gradient methods; each is a run.")
    ] = 20,
    searches: SearchOptions,
    options: ProblemOptions,
    tune: Tune = 0,
    config: Annotated[Path | None, typer.Option(help="Take the study from this TOML file instead."), SESSION] = None,
    out: Annotated[
        Path, typer.Option(help="Folder for records, report and figures; finished runs in it are reused."), OUTPUT
    ] = RESULTS,
    resume: Annotated[bool, typer.Option("--resume", help="Continue the study in --out."), SESSION] = False,
    jobs: Jobs = None,
    code: Code = None,
    scheduler: Scheduler = None,
    as_json: AsJson = False,
) -> None:
    """Compare IPOPT and search algorithms: one record per run, tables, figures and a report.

    Every finished run is stored: the same command, or `--resume`, continues an interrupted study. More runs, solvers, problems
    or a larger budget in the same folder extend it; runs whose algorithm, problem or robot was edited are recomputed. Your own
    problems and algorithms are named as `FILE.py:NAME`, and a program in any language as `cmd:COMMAND`.

    Examples: `nlp-gait compare`, `nlp-gait compare nao-ssp --algorithms pso,ga,cma,slsqp --runs 31 --polish --out study`,
    `nlp-gait compare nao-ssp --algorithms pso --starts 0 --runs 1`,
    `nlp-gait compare --config study.toml --out study`, `nlp-gait compare --resume --out study`
    """
    from compare.report import write_report

    if config is not None or resume:
        _reject_study_options(context, "--config" if config is not None else "--resume")
    name_all(code)
    if config is not None:
        settings = read_settings(config)
    elif resume:
        known = read_manifest(out).settings
        if known is None:
            raise InputError(f"{str(out)!r} contains no study to resume (study.json); omit --resume to start one")
        settings = resolve_user_code(known, f"the study in {str(out)!r}")
    else:
        specs = [options.make_spec(name) for name in problems or DEFAULT_PROBLEMS]
        solvers = choose_solvers(algorithms, starts, searches)
        settings = searches.make_study(specs, solvers, max(starts, 1))
    if stderr.is_terminal:
        say(f"watch it: nlp-gait report {out} --watch")
    remedy = f"continue with `nlp-gait compare --resume --out {out}`"
    records = run_in_folder(settings, out, jobs, scheduler, tune, remedy)
    imported = read_imported_records(out, records)
    records += imported.records
    written = write_report(out, records, read_manifest(out), excluded=imported.excluded)
    runs = [_encode_run(record) for record in records]
    data = {"problems": summarise_problems(records), "runs": runs} if as_json else {}

    def tables() -> None:
        print_runs(records)
        print_summaries(records)

    print_result(as_json, data, written, tables)
    end_if_excluded(imported.sentences)
    end_if_none_left(records)


def run_in_folder(
    settings: StudySettings, out: Path, jobs: int | None, scheduler: str | None, tune: int, remedy: str
) -> list[RunRecord]:
    """Run a study in a folder, each search also tuned by so many trials, and return all records, also of earlier commands.

    The remedy says how to continue, in the sentence with which Ctrl-C ends the command.
    """
    study = Study(
        tasks=settings.tasks(), folder=make_writable_folder(out), jobs=jobs or available_cores(), scheduler=scheduler
    )
    check_study(study)  # before the manifest names it
    if tune:
        with report_interrupts("interrupted while tuning; finished runs are stored; rerun the command to continue"):
            settings = tune_solvers(study, settings, tune, say)
        study = replace(study, tasks=settings.tasks())
    write_manifest(out, settings, Session.begin(describe_command(), scheduler or str(study.jobs)))
    with show_progress("runs", len(study.tasks)) as advance:
        try:
            return run_study(
                study,
                progress=lambda task, r: advance(f"{task.problem.title} {task.title} {r.verdict.objective:.6g}"),
                on_stored=lambda count: advance("stored", count),
                on_outdated=say,
            )
        except Interrupted as interrupt:
            end_interrupted(f"{interrupt.sentence}; finished runs are stored in {out}; {remedy}")


def end_if_none_left(records: Sequence[RunRecord]) -> None:
    """Report failed runs on stderr, and end with status 1 if a solver has no result on some problem."""
    failures = find_failures(records)
    for failure in failures:
        say_error(failure.sentence)
    without_result = [failure.solver for failure in failures if failure.failed == failure.runs]
    if without_result:
        fail(
            f"without any result: {', '.join(without_result)}; fix the cause, and delete the failed records to run them again"
        )


def summarise_problems(records: Sequence[RunRecord]) -> dict[str, Any]:
    """Return the table of solvers by problem as plain data."""
    return {c.problem: [asdict(summary) for summary in summarise(c)] for c in compare_problems(records)}


def _encode_run(record: RunRecord) -> dict[str, Any]:
    plain = record.to_json()
    same = (
        "problem",
        "solver",
        "run",
        "seed",
        "claimed_objective",
        "claimed_violation",
        "failed_evaluations",
        "status",
    )
    return {
        **{key: plain[key] for key in (*same, "x", "verdict")},
        "evaluations": plain["evaluations"]["f"],
        "time_s": plain["time_s"]["solve"],
    }


def print_runs(records: Sequence[RunRecord]) -> None:
    """Print a table of the runs of each problem that has few of them, as judged by the exact functions."""
    for comparison in compare_problems(records):
        if len(comparison.records) <= MOST_RUNS:
            rows = [
                (
                    record.solver,
                    str(record.run),
                    str(record.seed),
                    with_unit(record.verdict.objective, comparison.objective.unit),
                    f"{record.verdict.violation:.3g}",
                    record.status,
                )
                for record in comparison.records
            ]
            header = ("solver", "run", "seed", comparison.objective.name, "violation", "status")
            print_table(f"{comparison.problem}: runs", header, rows)


# Columns that are printed, in reading order; the report has all.
READ_FIRST = ("solver", "feasible", "median gap", "median", "evaluations", "time per run")
HOW_TO_READ = "From left to right: feasible runs, gap of the median to the best known, costs."


def print_summaries(records: Sequence[RunRecord], title: str = "") -> None:
    """Print the table of solvers for each problem, titled by the problem unless a title is given."""
    for comparison in compare_problems(records):
        cells = [dict(zip(HEADER, format_cells(s, comparison), strict=True)) for s in summarise(comparison)]
        rows = [[row[name] for name in READ_FIRST] for row in cells]
        print_table(title or f"{comparison.problem}: judged by the exact functions", READ_FIRST, rows)
        failures = find_failures(comparison.records)
        if failures:
            cells_of = [(f.solver, f"{f.failed}/{f.runs}", f.reason) for f in failures]
            print_table("Failed runs", ("solver", "failed", "reason of the first"), cells_of)
        for sentence in describe_unknown(comparison):
            stdout.print(f"{comparison.problem}, {sentence}", soft_wrap=True)
        stdout.print(f"{comparison.problem}, best known: {describe_best_known(comparison)}", soft_wrap=True)
    stdout.print(HOW_TO_READ)


def choose_solvers(algorithms: str, starts: int, searches: SearchOptions) -> list[SolverSpec]:
    """Return IPOPT and the named solvers; without starts, only searches."""
    names = parse_names(algorithms)
    if ALL in names:
        named = [name for name in names if name != ALL]
        names = [*dict.fromkeys([*ALL_GRADIENT, *list_installed_algorithms(), *named])]
    if starts == 0:
        names = [name for name in names if name not in GRADIENT_SOLVERS]
    elif IPOPT not in names:
        names.insert(0, IPOPT)
    return [SolverSpec(name=name, polish=searches.polish and name not in GRADIENT_SOLVERS) for name in names]


def _reject_study_options(context: typer.Context, flag: str) -> None:
    session = {o.name for o in inspect.signature(compare).parameters.values() if get_marks(o) & {OUTPUT, SESSION}}
    for parameter in context.command.params:
        name = str(parameter.name)
        source = context.get_parameter_source(name)
        given = source is not None and source.name == "COMMANDLINE"
        if name not in session and given and context.params.get(name) not in (None, [], ()):
            option = parameter.metavar if parameter.param_type_name == "argument" else parameter.opts[0]
            raise InputError(f"{flag} determines what the study computes; omit {option}")
