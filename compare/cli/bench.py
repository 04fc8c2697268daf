"""``nlp-gait bench``."""

from __future__ import annotations

from pathlib import Path
from typing import Literal

from compare.bench.baseline import BASELINE, RUNS, make_bench_tasks
from compare.cli.command import command
from compare.cli.common import (
    describe_command,
    end_interrupted,
    print_result,
    print_table,
    progress_bar,
    say,
    stdout,
    until_interrupted,
)
from compare.cli.options import parse_names
from nlp_gait.errors import InputError
from nlp_gait.files import make_writable_folder


@command
def bench(
    algorithm: str | None = None,
    suite: Literal["small", "full"] = "small",
    instances: str | None = None,
    label: str = "",
    runs: int = RUNS,
    out: Path = Path("bench"),
    jobs: int | None = None,
    as_json: bool = False,
) -> None:
    """Run an algorithm on GaitBench and rank it with the shipped baseline.

    Every run has 10 000 evaluations; run k has the seed k, like the baseline.

    Examples: `nlp-gait bench --algorithm my.py:MyAlgo --suite small --out DIR`,
    `nlp-gait bench --algorithm pso --label pso-again`
    """
    from compare.bench.baseline import list_instances
    from compare.bench.leaderboard import rank_solvers
    from compare.bench.page import make_leaderboard_page, make_verdict
    from compare.report.session_section import add_session
    from compare.report.writing import write_document
    from compare.study.record import RunRecord
    from compare.study.run_study import Study, check_study, run_study
    from nlp_gait import gaitbench
    from nlp_gait.backends.kernel.compiled import available_cores

    chosen = gaitbench.names(suite) if instances is None else tuple(parse_names(instances))
    for id in chosen:
        gaitbench.load(id)  # raises for unknown ids
    known = list_instances()
    missing = [id for id in chosen if id not in known]
    if missing and (instances is not None or len(missing) == len(chosen)):
        raise InputError(
            f"no baseline records of {', '.join(missing)} are shipped; choose others with --instances, for example "
            f"--instances {','.join(known)}"
        )
    if missing:
        say(f"skipped (no baseline records shipped): {', '.join(missing)}")
        chosen = tuple(id for id in chosen if id in known)
    make_writable_folder(out)
    records: list[RunRecord] = []
    name: str | None = None
    if algorithm is not None:
        label = label or (f"my-{algorithm}" if algorithm in BASELINE else "")
        study = Study(
            tasks=make_bench_tasks(chosen, algorithm, label=label, runs=runs),
            folder=out,
            jobs=jobs or available_cores(),
        )
        name = study.tasks[0].title
        if name in BASELINE:
            raise InputError(f"{name!r} is a solver of the baseline; give yours another name with --label")
        check_study(study)
        with progress_bar(f"{name} runs", len(study.tasks)) as advance:
            records, stopped = until_interrupted(
                lambda: run_study(study, progress=lambda task, _: advance(task.problem.title)), nothing=""
            )
        if stopped:
            end_interrupted(f"{stopped}; finished runs are stored in {out}; rerun the command to continue")
    board = rank_solvers(chosen, records)
    suite_name = (
        f"suite {suite}{f' without {len(missing)}' * bool(missing)}" if instances is None else "chosen instances"
    )
    page = add_session(
        make_leaderboard_page(board, name, suite_name),
        describe_command(),
        [{"name": "gaitbench", "options": {"instance": id}} for id in chosen],
        str(jobs or available_cores()),
    )
    written = write_document(out, page, "leaderboard")

    def tables() -> None:
        print_table(
            f"GaitBench 1, {suite_name}: {len(chosen)} instances",
            ("rank", "solver", "mean rank", "targets solved", "runs feasible"),
            [
                (str(k), s.solver, f"{s.mean_rank:.2f}", f"{100 * s.solved:.1f} %", f"{100 * s.feasible:.0f} %")
                for k, s in enumerate(board.standings, start=1)
            ],
        )
        for sentence in () if name is None else make_verdict(board, name):
            stdout.print(sentence)

    data = {
        "suite": suite_name,
        "instances": list(chosen),
        "skipped": missing,
        "solver": name,
        "rank": None if name is None else board.place(name),
        "standings": [
            {"solver": s.solver, "mean_rank": s.mean_rank, "solved": s.solved, "feasible": s.feasible}
            for s in board.standings
        ],
    }
    print_result(as_json, data, written, tables)
