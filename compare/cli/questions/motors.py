"""``nlp-gait motors``."""

from __future__ import annotations

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
    fail,
    problem_spec,
    progress_bar,
)
from compare.cli.questions.answers import hand_out

if TYPE_CHECKING:
    from compare.questions.motors.study import Variant


@command
def motors(
    problem: ProblemName = "nao-ssp",
    starts: Annotated[int, typer.Option(min=1, help="Random starts for each variant.")] = 10,
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
    """Solve a NAO phase with real motors: speed and torque limits, coupled ankles, braking, heat of each motor.

    Example: `nlp-gait motors nao-ssp`. One variant alone: `nlp-gait solve nao-ssp --option motors=limits,heat`
    """
    from compare.questions.motors.report import motors_answer
    from compare.questions.motors.study import VARIANTS, motor_variants
    from nlp_gait.backends.interrupts import Interrupted
    from nlp_gait.files import writable_folder

    folder = writable_folder(out)
    spec = problem_spec(problem, robot, intervals, derivatives, option, values, fix)
    stopped = ""
    try:
        with progress_bar("variants", len(VARIANTS)) as advance:
            found = motor_variants(spec, starts=starts, seed=seed, progress=advance)
    except Interrupted as interrupt:
        found, stopped = cast("tuple[Variant, ...]", interrupt.partial), interrupt.sentence
        if not found:
            end_interrupted(f"{stopped}; nothing was written")
    hand_out(motors_answer(found, spec.load()), folder, as_json)
    if stopped:
        end_interrupted(f"{stopped}; what was found is in {folder}")
    failed = [variant for variant in found if not variant.success]
    if failed:
        fail("; ".join(f"{variant.name}: {variant.status}" for variant in failed))
