"""``nlp-gait bench``."""

from dataclasses import asdict
from pathlib import Path
from typing import Annotated, Literal

from typer import Option

from compare.bench.leaderboard import (
    BASELINE,
    RUNS,
    choose_instances,
    load_table,
    make_leaderboard_page,
    plan_bench_runs,
    rank_solvers,
)
from compare.cli.command import OUTPUT, Output, Rows, command, describe_command
from compare.cli.compare import run_in_folder
from compare.cli.options import Evaluations, Jobs, Scheduler, parse_names
from compare.report.writing import add_origin, write_document
from compare.study.run import EVALUATIONS
from nlp_gait.errors import InputError
from nlp_gait.files import make_writable_folder


@command
def bench(
    algorithm: str | None = None,
    *,
    suite: Literal["small", "full", "drawn"] = "small",
    instances: str | None = None,
    families: str | None = None,
    seeds: str = "0:5",
    label: str = "",
    against: str = "random,pso,de,cma",
    runs: Annotated[int, Option(min=2, max=1000)] = RUNS,
    evaluations: Evaluations = EVALUATIONS,
    out: Annotated[Path, OUTPUT] = Path("bench"),
    jobs: Jobs = None,
    scheduler: Scheduler = None,
) -> Output:
    """Run an algorithm on GaitBench and rank it with the shipped baseline, or with others that run beside it.

    Run k has the seed k. The baseline has 10 000 evaluations; with another budget, and on instances without one, the solvers of
    --against run, too.

    Examples: `nlp-gait bench --algorithm my.py:MyAlgo --suite small --out DIR`,
    `nlp-gait bench --algorithm my.py:MyAlgo --families walk12-long,ssp --seeds 0:5 --out DIR`,
    `nlp-gait bench --algorithm pso --label pso-again`
    """
    chosen = choose_instances(suite, instances, families, seeds)
    title = "chosen instances" if instances or families else f"suite {suite}"
    shipped = evaluations == EVALUATIONS and set(chosen) <= load_table().keys()
    solvers = {} if shipped else {name: "" for name in parse_names(against) if name != algorithm}
    if algorithm is not None:
        solvers[algorithm] = label or (f"my-{algorithm}" if algorithm in BASELINE else "")  # the last one
    records, name = [], None
    make_writable_folder(out)
    if solvers:
        planned = plan_bench_runs(chosen, solvers, runs=runs, evaluations=evaluations)
        name = planned[-1].title if algorithm is not None else None
        if name in BASELINE:
            raise InputError(f"{name!r} is a solver of the baseline; give yours another name with --label")
        records = run_in_folder(planned, out, jobs, scheduler)
    board = rank_solvers(chosen, records, shipped=shipped)
    page = make_leaderboard_page(board, name, title, evaluations)
    rows = [
        (str(k), one.solver, f"{one.mean_rank:.2f}", f"{100 * one.solved:.1f} %", f"{100 * one.feasible:.0f} %")
        for k, one in enumerate(board.standings, start=1)
    ]
    header = ("rank", "solver", "mean rank", "targets solved", "runs feasible")
    table = Rows(f"GaitBench, {title}: {len(chosen)} instances", header, rows)
    return Output(
        data={
            "suite": title,
            "instances": list(chosen),
            "solver": name,
            "rank": None if name is None else board.place(name),
            "standings": [asdict(standing) for standing in board.standings],
        },
        parts=[table, *page.headline],
        written=write_document(out, add_origin(page, describe_command()), "leaderboard"),
    )
