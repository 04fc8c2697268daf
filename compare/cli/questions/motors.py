"""``nlp-gait motors``."""

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
    fail,
    print_json,
    print_table,
    problem_spec,
    progress_bar,
    stdout,
)

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
    from compare.questions.motors.report import write_motors
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
    written = write_motors(folder, found, spec.load())
    if as_json:
        variants = [asdict(variant) for variant in found]
        print_json({"problem": problem, "variants": variants, "files": [str(path) for path in written]})
    else:
        _print(problem, found, written)
    if stopped:
        end_interrupted(f"{stopped}; what was found is in {folder}")
    failed = [variant for variant in found if not variant.success]
    if failed:
        fail("; ".join(f"{variant.name}: {variant.status}" for variant in failed))


def _print(problem: str, found: Sequence[Variant], written: Sequence[Path]) -> None:
    rows = [
        (
            v.name,
            f"{v.power_W:.6f}",
            f"{v.unchanged_power_W:.6f}" + (" (breaks limits)" if v.unchanged_violation > 0.0 else ""),
            f"{v.published_power_W:.6f}",
            "-" if v.moved[0] < 1e-4 else f"{v.moved[1]} by {v.moved[0]:.0%} of its range",
        )
        for v in found
    ]
    header = ("motors", "optimum [W]", "published x* [W]", "optimum by the paper's reckoning [W]", "x* moves most in")
    print_table(f"{problem} with real motors", header, rows)
    kinds = list(found[0].uses)
    uses = [
        (v.name, *(f"{v.uses[kind].share:.1%} {v.uses[kind].row.partition('[')[2][:-1]}" for kind in kinds))
        for v in found
    ]
    print_table("Largest share of each limit that the optimum uses: joint, sample", ("motors", *kinds), uses)
    names = list(found[0].x)
    print_table(
        "Optima", ("variable", *(v.name for v in found)), [(n, *(f"{v.x[n]:.5g}" for v in found)) for n in names]
    )
    stdout.print(f"Written: {', '.join(map(str, written))}")
