"""``nlp-gait sweep``."""

from __future__ import annotations

from typing import Annotated

import typer

from compare.cli.command import command
from compare.cli.common import end_interrupted, progress_bar, say
from compare.cli.interrupts import until_interrupted
from compare.cli.options import Evaluations, NamedProblem, Seed
from compare.cli.questions.answers import Output


@command
def sweep(
    *,
    over: Annotated[list[str], typer.Option(metavar="NAME=LOW:HIGH:COUNT", help="Axis; repeatable. Or NAME=V1,V2,...")],
    algorithm: Annotated[str, typer.Option(help="ipopt, or a search algorithm.")] = "ipopt",
    starts: Annotated[int, typer.Option(min=1, max=100_000, help="Random starts where no neighbour helps.")] = 5,
    evaluations: Evaluations = 10_000,
    seed: Seed = 0,
    problem: NamedProblem,
    output: Output,
) -> None:
    """Solve a problem over a grid of parameter values or fixed variables, each point from its neighbour.

    Called again after a kill or Ctrl-C, it continues where it stopped.

    Example: `nlp-gait sweep nao-ssp --over swing_height_m=0.015:0.028:6`
    """
    from compare.questions.sweep.report import sweep_answer
    from compare.questions.sweep.study import count_solves, parse_axis
    from compare.questions.sweep.study import sweep as run_sweep
    from compare.study.store import Store
    from compare.study.task import Task

    spec = problem.spec()
    axes = [parse_axis(text) for text in over]
    store = Store(output.out, say)
    with progress_bar("solves", count_solves(axes, algorithm)) as advance:
        points, stopped = until_interrupted(
            lambda: run_sweep(
                spec,
                axes,
                algorithm=algorithm,
                starts=starts,
                evaluations=evaluations,
                seed=seed,
                store=store,
                progress=advance,
            ),
            folder=output.out,
        )
    output.take(sweep_answer(points, spec.load(), Task(problem=spec, solver=algorithm).title), store=store)
    if stopped:
        not_twice = ", not all of them solved from both sides" if algorithm == "ipopt" else ""
        end_interrupted(f"{stopped}; these are in {output.out}{not_twice}; the same command continues")
