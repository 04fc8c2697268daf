"""``nlp-gait prices``."""

from __future__ import annotations

from typing import Annotated

import typer

from compare.cli.command import command
from compare.cli.options import NamedProblem, Seed
from compare.cli.questions.output import Output


@command
def prices(
    *,
    starts: Annotated[int, typer.Option(min=1, max=100_000, help="Random starts within the bounds.")] = 10,
    seed: Seed = 0,
    checks: Annotated[int, typer.Option(min=0, help="Quantities of the robot that are verified by solving again.")] = 3,
    problem: NamedProblem,
    output: Output,
) -> None:
    """Compute what each limit costs the optimum, and which error of masses, lengths or soles would change it most.

    Derivatives of optimum and x* by the first-order conditions, verified by solving again. Example: `nlp-gait prices nao-ssp`
    """
    from compare.questions.prices.prices import Prices

    output.answer(Prices(problem=problem.load(), starts=starts, seed=seed, checks=checks))
