"""``nlp-gait motors``."""

from __future__ import annotations

from typing import Annotated

import typer

from compare.cli.command import command
from compare.cli.common import fail, progress_bar, say
from compare.cli.interrupts import until_interrupted
from compare.cli.options import NaoPhase, Seed
from compare.cli.questions.answers import Output


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
    from compare.questions.motors.report import motors_answer
    from compare.questions.motors.study import VARIANTS, motor_variants
    from compare.study.store import Store

    spec = problem.spec()
    with progress_bar("variants", len(VARIANTS)) as advance:
        store = Store(output.out, say)
        found, stopped = until_interrupted(
            lambda: motor_variants(spec, starts=starts, seed=seed, store=store, progress=advance),
            folder=output.out,
        )
    output.take(motors_answer(found, spec.load()), stopped, store)
    failed = [variant for variant in found if not variant.success]
    if failed:
        fail("; ".join(f"{variant.name}: {variant.status}" for variant in failed))
