"""``nlp-gait compare``."""

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
def compare(
    problem: Annotated[str, typer.Argument(metavar="PROBLEM", help="For example nao-ssp.")] = "nao-ssp",
    algorithms: Annotated[str, typer.Option(help="Search algorithms, separated by commas.")] = "pso,ga",
    runs: Annotated[int, typer.Option(min=1, help="Runs of each search algorithm.")] = 11,
    starts: Annotated[int, typer.Option(min=0, help="Starts of IPOPT; each is one run.")] = 20,
    evaluations: Annotated[int, typer.Option(min=1, help="Budget of one search run.")] = 10_000,
    seed: Seed = 0,
    robot: Robot = None,
    intervals: Intervals = None,
    derivatives: Derivatives = None,
    option: Options = None,
    values: Set = None,
    fix: Fix = None,
    out: Annotated[
        Path, typer.Option(help="Folder for records, table and figure; finished runs in it are kept.")
    ] = Path("results"),
    jobs: Jobs = None,
    as_json: AsJson = False,
) -> None:
    """Put IPOPT and search algorithms side by side: one record a run, a table and a convergence picture.

    Example: `nlp-gait compare nao-ssp --runs 11 --out results`
    """
    from compare.report import write_report
    from compare.runner import IPOPT, Task
    from compare.study import Study, default_jobs, run_study
    from compare.table import HEADER, cells, summarise

    spec = problem_spec(problem, robot, intervals, derivatives, option, values, fix)
    names = [name.strip() for name in algorithms.split(",") if name.strip()]
    counts = [(IPOPT, starts), *((name, runs) for name in names)]
    tasks = tuple(
        Task(problem=spec, algorithm=name, evaluations=evaluations, seed=seed, run=run)
        for name, count in counts
        for run in range(count)
    )
    with progress_bar("runs", len(tasks)) as advance:
        records = run_study(
            Study(tasks=tasks, folder=out, jobs=jobs or default_jobs()),
            progress=lambda task, record: advance(f"{task.algorithm} {record.verdict.objective:.6g}"),
        )
    objective = spec.load().objective
    summaries = summarise(records, objective)
    written = write_report(out, problem, records, objective)
    if as_json:
        from dataclasses import asdict

        print_json({"problem": problem, "solvers": [asdict(s) for s in summaries], "files": [str(p) for p in written]})
        return
    print_table(f"{problem}: judged by the exact functions", HEADER, [cells(s, objective) for s in summaries])
    for path in written:
        stdout.print(f"wrote {path}", soft_wrap=True)
