"""``nlp-gait compare``."""

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Annotated, Any

from typer import Argument, Option

from compare.analysis.columns import PRINTED, format_rows, summarise
from compare.analysis.comparison import Comparison, compare_problems
from compare.analysis.headline import LiveGaps, describe_failures, describe_unknown, write_headlines
from compare.cli import options
from compare.cli.command import CONTINUE, OUTPUT, Output, Rows, command, describe_command, say_error, show_progress
from compare.report import write_report
from compare.study.import_runs import read_imported_records
from compare.study.record import RunRecord
from compare.study.run import GRADIENT_SOLVERS, IPOPT, Run, plan_runs
from compare.study.study import Study, read_study_file, run_study
from metaheuristics import list_installed_algorithms
from nlp_gait.backends.kernel.compiled import available_cores
from nlp_gait.interrupts import Interrupted

DEFAULT_PROBLEMS = ("nao-ssp", "nao-dsp")
ALGORITHMS, STARTS = "pso,ga,aco", 20
ALL, ALL_GRADIENT = "all", (IPOPT, "slsqp")


def list_solver_names(algorithms: str, starts: int) -> list[str]:
    """Return IPOPT and the named solvers; without starts, only searches."""
    names = options.parse_names(algorithms)
    if ALL in names:
        names = list(dict.fromkeys([*ALL_GRADIENT, *list_installed_algorithms(), *names]))
        names.remove(ALL)
    if starts == 0:
        return [name for name in names if name not in GRADIENT_SOLVERS]
    return names if IPOPT in names else [IPOPT, *names]


@command
def compare(
    *,
    problems: Annotated[list[str] | None, Argument(metavar="[PROBLEM]...")] = None,
    algorithms: str = ALGORITHMS,
    starts: Annotated[int, Option(min=0, max=100000)] = STARTS,
    runs: options.Runs = 11,
    seed: options.Seed = 0,
    evaluations: options.Evaluations = 10_000,
    handling: str = "deb",
    time_limit: Annotated[float | None, Option(min=0.001, max=1000000000.0)] = None,
    changes: options.ProblemOptions,
    out: Annotated[Path, OUTPUT] = options.RESULTS,
    jobs: options.Jobs = None,
    scheduler: options.Scheduler = None,
) -> Output:
    """Compare IPOPT and search algorithms: one record per run, tables, figures and a report.

    Every finished run is stored: the same command continues an interrupted study. More runs, solvers, problems or a larger
    budget in the same folder extend it; runs whose algorithm, problem or robot was edited run again. Your own
    problems and algorithms are named as `FILE.py:NAME`, and a program in any language as `cmd:COMMAND`.

    Examples: `nlp-gait compare`, `nlp-gait compare nao-ssp --algorithms pso,ga,cma,slsqp --runs 31 --out study`,
    `nlp-gait compare nao-ssp --algorithms pso --starts 0 --runs 1`
    """
    planned = plan_runs(
        [changes.make_spec(name) for name in problems or DEFAULT_PROBLEMS],
        [("", name) for name in list_solver_names(algorithms, starts)],
        runs=runs,
        starts=starts,
        handling=handling,
        evaluations=evaluations,
        time_limit_s=time_limit,
        seed=seed,
    )
    records = run_in_folder(planned, out, jobs, scheduler)
    records += read_imported_records(out, records)
    written = write_report(out, records, read_study_file(out))
    comparisons = compare_problems(records, folder=out)
    for comparison in comparisons:
        for sentence in describe_failures(comparison):
            say_error(sentence)
    lost = ", ".join(s.name for c in comparisons for s in c.solvers if not any(r.x for r in s.records))
    remedy = f"without any result: {lost}; fix the cause, and delete the failed records to run them again"
    return Output(
        data={"problems": summarise_problems(comparisons), "runs": [_encode_run(record) for record in records]},
        parts=list(describe_summaries(comparisons)),
        written=written,
        answer=write_headlines(comparisons),
        failures=[remedy] if lost else [],
    )


def run_in_folder(runs: tuple[Run, ...], out: Path, jobs: int | None, scheduler: str | None) -> list[RunRecord]:
    """Run a study in a folder, and return all records, also of earlier commands."""
    workers = jobs or available_cores()
    study = Study(runs=runs, folder=out, jobs=workers, scheduler=scheduler, command=describe_command())
    gaps = LiveGaps()
    with show_progress("runs", len(study.runs), "building and compiling") as advance:
        try:
            return run_study(
                study,
                progress=lambda record: advance(gaps.add(record)),
                on_stored=lambda count: advance("stored", count),
            )
        except Interrupted as interrupt:
            sentence = f"{interrupt.sentence}; finished runs are stored in {out}; {CONTINUE}"
            raise KeyboardInterrupt(sentence) from interrupt


def summarise_problems(comparisons: Sequence[Comparison]) -> dict[str, Any]:
    """Return the table of solvers by problem as plain data."""
    return {comparison.problem: summarise(comparison) for comparison in comparisons}


ENCODED = (
    "problem solver run status reported_objective x objective violation feasible violated failed_evaluations".split()
)


def _encode_run(record: RunRecord) -> dict[str, Any]:
    plain = record.to_json()
    costs = {"evaluations": plain["counts"].get("f"), "time_s": plain["time_s"]["solve"]}
    return {**{key: plain[key] for key in ENCODED}, "seed": record.seed, **costs}


def describe_summaries(comparisons: Sequence[Comparison]) -> Iterator[str | Rows]:
    """Yield the table of solvers for each problem."""
    for comparison in comparisons:
        yield Rows(f"{comparison.problem}: judged by the exact functions", *format_rows(comparison, PRINTED))
        for sentence in [*describe_unknown(comparison), *([comparison.power] if comparison.power else [])]:
            yield f"{comparison.problem}, {sentence}"
