"""``nlp-gait sweep``."""

from __future__ import annotations

from typing import Annotated

import typer

from compare.cli.command import command
from compare.cli.options import Evaluations, NamedProblem, Seed
from compare.cli.questions.output import Output


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

    Rerun the command to continue after an interruption.

    Example: `nlp-gait sweep nao-ssp --over swing_height_m=0.015:0.028:6`
    """
    from compare.questions.sweep import Sweep, parse_axis

    axes, effort = [parse_axis(text) for text in over], {"starts": starts, "evaluations": evaluations, "seed": seed}
    output.answer(Sweep(problem=problem.load(), axes=axes, algorithm=algorithm, **effort))
