"""``nlp-gait search``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from nlp_gait.cli.common import (
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
    print_json,
    print_table,
    problem_spec,
    progress_bar,
    stdout,
)


@command
def search(
    problem: ProblemName,
    algorithm: Annotated[str, typer.Option(help="pso, ga, aco, aco-grid.")] = "pso",
    runs: Annotated[int, typer.Option(min=1, help="Independent runs.")] = 11,
    seed: Seed = 0,
    evaluations: Annotated[int, typer.Option(min=1, help="Budget of one run.")] = 10_000,
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

    Example: `nlp-gait search nao-ssp --algorithm pso --runs 11 --seed 0 --evaluations 10000`
    """
    from compare.runner import Task
    from compare.study import Study, default_jobs, run_study
    from compare.table import HEADER, cells, summarise

    spec = problem_spec(problem, robot, intervals, derivatives, option, values, fix)
    tasks = tuple(
        Task(problem=spec, algorithm=algorithm, evaluations=evaluations, seed=seed, run=run) for run in range(runs)
    )
    with progress_bar(f"{algorithm} runs", runs) as advance:
        records = run_study(
            Study(tasks=tasks, folder=out, jobs=jobs or default_jobs()),
            progress=lambda _, record: advance(f"{record.verdict.objective:.6g}"),
        )
    if as_json:
        plain = [record.to_json() for record in records]
        listed = [
            {
                "run": r["run"],
                "seed": r["seed"],
                "objective": r["objective"],
                "violation": r["violation"],
                "evaluations": r["evaluations"]["f"],
                "failed_evaluations": r["failed_evaluations"],
                "time_s": r["time_s"]["solve"],
                "status": r["status"],
                "x": r["x"],
                "verdict": r["verdict"],
            }
            for r in plain
        ]
        print_json({"problem": problem, "algorithm": algorithm, "options": plain[0]["options"], "runs": listed})
        return
    objective = spec.load().objective
    rows = [
        (str(r.run), str(r.seed), f"{r.verdict.objective:.6f} {objective.unit}", f"{r.verdict.violation:.3g}", r.status)
        for r in records
    ]
    print_table(f"{problem}, {algorithm}", ("run", "seed", objective.name, "violation", "why it ended"), rows)
    print_table("All runs", HEADER, [cells(summary, objective) for summary in summarise(records, objective)])
    stdout.print("objective and violation are the judge's: the exact functions on the problem's own samples")
