"""``nlp-gait search``."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, cast

import typer

from compare.cli.common import (
    AsJson,
    Derivatives,
    Fix,
    Intervals,
    Jobs,
    Options,
    ProblemName,
    Robot,
    Seed,
    Set,
    command,
    end_interrupted,
    fail,
    print_json,
    print_table,
    problem_spec,
    progress_bar,
    quantity,
    stdout,
)
from compare.cli.study_options import (
    Handle,
    PenaltyWeight,
    Stagnation,
    Target,
    TimeLimit,
    handling_of,
    stop_of,
)

if TYPE_CHECKING:
    from compare.study.record import RunRecord


@command
def search(
    problem: ProblemName,
    algorithm: Annotated[str, typer.Option(help="pso, ga, aco, aco-grid, cma, de, pymoo:GA, ...")] = "pso",
    runs: Annotated[int, typer.Option(min=1, max=100_000, help="Independent runs.")] = 11,
    seed: Seed = 0,
    evaluations: Annotated[int, typer.Option(min=1, max=10**12, help="Budget of one run.")] = 10_000,
    handling: Handle = "deb",
    penalty_weight: PenaltyWeight = None,
    target: Target = None,
    stagnation: Stagnation = None,
    time_limit: TimeLimit = None,
    polish: Annotated[bool, typer.Option("--polish", help="IPOPT from each run's result.")] = False,
    robot: Robot = None,
    intervals: Intervals = None,
    derivatives: Derivatives = None,
    option: Options = None,
    values: Set = None,
    fix: Fix = None,
    out: Annotated[
        Path | None, typer.Option(help="Keep one record file a run in this folder; continue from it.")
    ] = None,
    jobs: Jobs = 1,
    as_json: AsJson = False,
) -> None:
    """Search a problem with a metaheuristic on the compiled exact functions.

    Runs whose objective fails altogether are listed with the reason; exit status 1 if all of them do.

    Examples: `nlp-gait search nao-ssp --algorithm pso --runs 11 --seed 0 --evaluations 10000`,
    `nlp-gait search nao-ssp --algorithm ga --handling penalty --penalty-weight 1 --polish`
    """
    from compare.analysis.comparison import compare_problems
    from compare.analysis.table import HEADER, cells, summarise
    from compare.study.settings import SolverSpec, StudySettings
    from compare.study.study import Study, default_jobs, run_study
    from nlp_gait.backends.interrupts import Interrupted

    spec = problem_spec(problem, robot, intervals, derivatives, option, values, fix)
    settings = StudySettings(
        problems=(spec,),
        solvers=(SolverSpec(algorithm=algorithm, runs=runs, polish=polish),),
        handling=handling_of(handling, penalty_weight),
        stop=stop_of(evaluations, target, stagnation, time_limit),
        seed=seed,
    )
    tasks = settings.tasks()
    stopped = ""
    with progress_bar(f"{algorithm} runs", len(tasks)) as advance:
        try:
            records = run_study(
                Study(tasks=tasks, folder=out, jobs=jobs or default_jobs()),
                progress=lambda _, record: advance(f"{record.verdict.objective:.6g}"),
            )
        except Interrupted as interrupt:
            records, stopped = cast("list[RunRecord]", interrupt.partial), interrupt.sentence
            if not records:
                end_interrupted(stopped)
    loaded = spec.load()
    if as_json:
        print_json(
            {
                "problem": problem,
                "algorithm": algorithm,
                "options": dict(loaded.options),
                "runs": [_run(r) for r in records if not _is_polish(r)],
                **({"polished": [_run(r) for r in records if _is_polish(r)]} if polish else {}),
            }
        )
    else:
        unit = loaded.objective.unit
        rows = [
            (
                r.algorithm,
                str(r.run),
                str(r.seed),
                quantity(r.verdict.objective, unit),
                f"{r.verdict.violation:.3g}",
                r.status,
            )
            for r in records
        ]
        header = ("solver", "run", "seed", loaded.objective.name, "violation", "why it ended")
        print_table(f"{problem}, {algorithm}", header, rows)
        for comparison in compare_problems(records):
            print_table("All runs", HEADER, [cells(summary, comparison) for summary in summarise(comparison)])
        stdout.print("objective and violation are the judge's: the exact functions on the problem's own samples")
    if stopped:
        kept = "printed, but kept nowhere: name a folder with --out" if out is None else f"kept in {out}"
        end_interrupted(f"{stopped}; finished runs are {kept}" + (out is not None) * "; the same command continues")
    if not any(record.x for record in records):
        fail(f"no run has a result; the first {records[0].status}")


def _is_polish(record: RunRecord) -> bool:
    return "polishes" in record.definition


def _run(record: RunRecord) -> dict[str, Any]:
    """What scripts rely on."""
    plain = record.to_json()
    same = ("run", "seed", "objective", "violation", "failed_evaluations", "status", "x", "verdict")
    return {
        **{key: plain[key] for key in same},
        "evaluations": plain["evaluations"]["f"],
        "time_s": plain["time_s"]["solve"],
    }
