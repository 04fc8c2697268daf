"""``nlp-gait prices``."""

from __future__ import annotations

from typing import Annotated

import typer

from compare.cli.command import command
from compare.cli.common import fail, progress_bar, say
from compare.cli.interrupts import interruptible
from compare.cli.options import NamedProblem, Seed
from compare.cli.questions.answers import Output


@command
def prices(
    *,
    starts: Annotated[int, typer.Option(min=1, max=100_000, help="Random starts within the bounds.")] = 10,
    seed: Seed = 0,
    checks: Annotated[int, typer.Option(min=0, help="Quantities of the robot that are checked by solving again.")] = 3,
    problem: NamedProblem,
    output: Output,
) -> None:
    """Say what each limit costs the optimum, and which error of masses, lengths or soles would change it most.

    Derivatives of optimum and x* by the first-order conditions, checked by solving again. Example: `nlp-gait prices nao-ssp`
    """
    from compare.questions.prices.report import prices_answer
    from compare.questions.prices.study import prices as find
    from compare.study.store import Store

    spec = problem.spec()
    with interruptible(output.out), progress_bar("steps", None) as advance:
        store = Store(output.out, say)
        found = find(spec, starts=starts, seed=seed, checks=checks, store=store, progress=advance)
    output.take(prices_answer(found, spec.load()), store=store)
    if found.reason is not None:
        fail(f"no prices at this optimum: {found.reason}")
