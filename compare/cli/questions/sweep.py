"""``nlp-gait sweep``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

from compare.cli.common import (
    AsJson,
    Derivatives,
    Fix,
    Intervals,
    Options,
    ProblemName,
    Robot,
    Seed,
    Set,
    command,
    end_interrupted,
    print_json,
    print_table,
    problem_spec,
    progress_bar,
    stdout,
)
from nlp_gait.errors import OutputError

if TYPE_CHECKING:
    from compare.questions.sweep.study import SweepPoint
    from nlp_gait.problem.gait_problem import GaitProblem


@command
def sweep(
    problem: ProblemName,
    over: Annotated[list[str], typer.Option(metavar="NAME=LOW:HIGH:COUNT", help="Axis; repeatable. Or NAME=V1,V2,...")],
    algorithm: Annotated[str, typer.Option(help="An NLP solver, or a search algorithm; see nlp-gait list.")] = "ipopt",
    starts: Annotated[int, typer.Option(min=1, max=100_000, help="Random starts where no neighbour helps.")] = 5,
    evaluations: Annotated[int, typer.Option(min=1, max=10**12, help="Budget of one search run.")] = 10_000,
    seed: Seed = 0,
    robot: Robot = None,
    intervals: Intervals = None,
    derivatives: Derivatives = None,
    option: Options = None,
    values: Set = None,
    fix: Fix = None,
    out: Annotated[Path, typer.Option(help="Folder for the CSV table and the picture.")] = Path("results"),
    as_json: AsJson = False,
) -> None:
    """Solve a problem over a grid of parameter values or fixed variables, each point from its neighbour.

    Example: `nlp-gait sweep nao-ssp --over swing_height_m=0.015:0.028:6`
    """
    from compare.questions.sweep.report import write_sweep
    from compare.questions.sweep.study import count_solves, parse_axis
    from compare.questions.sweep.study import sweep as run_sweep
    from compare.study.task import GRADIENT_SOLVERS
    from nlp_gait.backends.interrupts import Interrupted
    from nlp_gait.files import writable_folder

    folder = writable_folder(out)
    spec = problem_spec(problem, robot, intervals, derivatives, option, values, fix)
    axes = [parse_axis(text) for text in over]
    stopped = ""
    with progress_bar("solves", count_solves(axes, algorithm)) as advance:
        try:
            points = run_sweep(
                spec,
                axes,
                algorithm=algorithm,
                starts=starts,
                evaluations=evaluations,
                seed=seed,
                progress=lambda: advance(""),
            )
        except Interrupted as interrupt:
            points, stopped = cast("list[SweepPoint]", interrupt.partial), interrupt.sentence
            if not points:
                end_interrupted(f"{stopped}; nothing was written")
    loaded = spec.load()
    written: list[Path] = []
    unwritten: OutputError | None = None
    try:
        written = write_sweep(folder, points, loaded, algorithm)
    except OutputError as error:  # the points are printed all the same
        unwritten = error
    if as_json:
        print_json({"problem": problem, "points": [asdict(p) for p in points], "files": [str(p) for p in written]})
    else:
        _print(points, loaded, algorithm, written)
    if unwritten is not None:
        raise unwritten
    if stopped:
        not_twice = ", not all of them solved from both sides" if algorithm in GRADIENT_SOLVERS else ""
        end_interrupted(f"{stopped}; these are in {folder}{not_twice}")


def _print(points: Sequence[SweepPoint], loaded: GaitProblem, algorithm: str, written: Sequence[Path]) -> None:
    header = (*points[0].at, loaded.objective.name, "status")
    rows = [
        (
            *(f"{v:g}" for v in p.at.values()),
            f"{p.objective:.6f} {loaded.objective.unit}" if p.feasible else "-",
            p.status,
        )
        for p in points
    ]
    print_table(f"{loaded.name} by {algorithm}", header, rows)
    for path in written:
        stdout.print(f"wrote {path}", soft_wrap=True)
