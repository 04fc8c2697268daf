"""``nlp-gait sweep``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from compare.analysis.units import with_unit
from compare.cli.command import command
from compare.cli.common import end_interrupted, print_result, print_table, progress_bar
from compare.cli.interrupts import until_interrupted
from compare.cli.options import RESULTS, AsJson, Evaluations, NamedProblem, Seed, TableFolder
from nlp_gait.errors import OutputError
from nlp_gait.files import writable_folder

if TYPE_CHECKING:
    from compare.questions.sweep.study import SweepPoint
    from nlp_gait.problem import Objective


@command
def sweep(
    *,
    over: Annotated[list[str], typer.Option(metavar="NAME=LOW:HIGH:COUNT", help="Axis; repeatable. Or NAME=V1,V2,...")],
    algorithm: Annotated[str, typer.Option(help="ipopt, or a search algorithm.")] = "ipopt",
    starts: Annotated[int, typer.Option(min=1, max=100_000, help="Random starts where no neighbour helps.")] = 5,
    evaluations: Evaluations = 10_000,
    seed: Seed = 0,
    problem: NamedProblem,
    out: TableFolder = RESULTS,
    as_json: AsJson = False,
) -> None:
    """Solve a problem over a grid of parameter values or fixed variables, each point from its neighbour.

    Example: `nlp-gait sweep nao-ssp --over swing_height_m=0.015:0.028:6`
    """
    from compare.questions.sweep.report import write_sweep
    from compare.questions.sweep.study import count_solves, parse_axis
    from compare.questions.sweep.study import sweep as run_sweep

    folder = writable_folder(out)
    spec = problem.spec()
    axes = [parse_axis(text) for text in over]
    with progress_bar("solves", count_solves(axes, algorithm)) as advance:
        points, stopped = until_interrupted(
            lambda: run_sweep(
                spec,
                axes,
                algorithm=algorithm,
                starts=starts,
                evaluations=evaluations,
                seed=seed,
                progress=lambda: advance(""),
            )
        )
    loaded = spec.load()
    written: list[Path] = []
    unwritten: OutputError | None = None
    try:
        written = write_sweep(folder, points, loaded, algorithm)
    except OutputError as error:  # the points are printed all the same
        unwritten = error
    data = {"problem": problem.name, "points": [asdict(point) for point in points]}
    title = f"{problem.name} by {algorithm}"
    print_result(as_json, data, written, lambda: _print(title, points, loaded.objective))
    if unwritten is not None:
        raise unwritten
    if stopped:
        not_twice = ", not all of them solved from both sides" if algorithm == "ipopt" else ""
        end_interrupted(f"{stopped}; these are in {folder}{not_twice}")


def _print(title: str, points: Sequence[SweepPoint], objective: Objective) -> None:
    rows = [
        (
            *(f"{value:g}" for value in point.at.values()),
            with_unit(point.objective if point.feasible else None, objective.unit),
            point.status,
        )
        for point in points
    ]
    print_table(title, (*points[0].at, objective.name, "status"), rows)
