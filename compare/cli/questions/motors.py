"""``nlp-gait motors``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer

from compare.cli.command import command
from compare.cli.common import end_interrupted, fail, print_result, print_rows, print_table, progress_bar
from compare.cli.interrupts import until_interrupted
from compare.cli.options import RESULTS, AsJson, NaoPhase, Seed, TableFolder
from nlp_gait.files import writable_folder

if TYPE_CHECKING:
    from compare.questions.motors.study import Variant


@command
def motors(
    *,
    starts: Annotated[int, typer.Option(min=1, help="Random starts for each variant.")] = 10,
    seed: Seed = 0,
    problem: NaoPhase,
    out: TableFolder = RESULTS,
    as_json: AsJson = False,
) -> None:
    """Solve a NAO phase with real motors: speed and torque limits, coupled ankles, braking, heat of each motor.

    Example: `nlp-gait motors nao-ssp`. One variant alone: `nlp-gait solve nao-ssp --option motors=limits,heat`
    """
    from compare.questions.motors.report import write_motors
    from compare.questions.motors.study import VARIANTS, motor_variants

    folder = writable_folder(out)
    spec = problem.spec()
    with progress_bar("variants", len(VARIANTS)) as advance:
        found, stopped = until_interrupted(lambda: motor_variants(spec, starts=starts, seed=seed, progress=advance))
    written = write_motors(folder, found, spec.load())
    data = {"problem": problem.name, "variants": [asdict(variant) for variant in found]}
    print_result(as_json, data, written, lambda: _print(problem.name, found))
    if stopped:
        end_interrupted(f"{stopped}; what was found is in {folder}")
    failed = [variant for variant in found if not variant.success]
    if failed:
        fail("; ".join(f"{variant.name}: {variant.status}" for variant in failed))


def _print(problem: str, found: Sequence[Variant]) -> None:
    print_rows(
        f"{problem} with real motors",
        found,
        {
            "motors": lambda v: v.name,
            "optimum [W]": lambda v: f"{v.power_W:.6f}",
            "published x* [W]": lambda v: (
                f"{v.unchanged_power_W:.6f}" + (" (breaks limits)" if v.unchanged_violation > 0.0 else "")
            ),
            "optimum by the paper's reckoning [W]": lambda v: f"{v.published_power_W:.6f}",
            "x* moves most in": lambda v: (
                "-" if v.moved[0] < 1e-4 else f"{v.moved[1]} by {v.moved[0]:.0%} of its range"
            ),
        },
    )
    kinds = list(found[0].uses)
    uses = [
        (v.name, *(f"{v.uses[kind].share:.1%} {v.uses[kind].row.partition('[')[2][:-1]}" for kind in kinds))
        for v in found
    ]
    print_table("Largest share of each limit that the optimum uses: joint, sample", ("motors", *kinds), uses)
    optima = [(name, *(f"{v.x[name]:.5g}" for v in found)) for name in found[0].x]
    print_table("Optima", ("variable", *(v.name for v in found)), optima)
