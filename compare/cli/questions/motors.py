"""``nlp-gait motors``."""

from __future__ import annotations

from typing import Annotated

import typer

from compare.cli.command import command
from compare.cli.options import NaoPhase, Seed
from compare.cli.questions.output import Output


@command
def motors(
    *,
    starts: Annotated[int, typer.Option(min=1, max=100_000, help="Random starts for each variant.")] = 10,
    seed: Seed = 0,
    problem: NaoPhase,
    output: Output,
) -> None:
    """Solve a NAO phase with real motors: speed and torque limits, coupled ankles, braking, heat and rotor of each motor.

    Example: `nlp-gait motors nao-ssp`. One variant alone: `nlp-gait solve nao-ssp --option motors=limits,heat`
    """
    from compare.questions.real_motors import Motors

    output.answer(Motors(problem=problem.load(), starts=starts, seed=seed))
