"""``nlp-gait report``."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

import typer

from compare.cli.command import command
from compare.cli.common import end_interrupted, print_result, print_table, progress_bar, stdout
from compare.cli.options import AsCsv, AsJson, Code, name_all
from compare.cli.simulation_options import DriveOptions
from nlp_gait.errors import InputError

if TYPE_CHECKING:
    from compare.study.record import RunRecord
    from compare.study.simulations import SimulatedGait
    from nlp_gait.simulation.drive import Drive


ENGINE_TABLE = (
    "Model and engine: mean power over a phase, or energy of ten steps for each planned metre of a cycle; rank: first the "
    "model's, then the engine's; fate: a cycle walks that part of the planned way."
)


@command
def report(
    *,
    folder: Annotated[Path, typer.Argument(metavar="DIR", help="Folder of a study: the --out of `compare`.")],
    gradient_weight: Annotated[
        float | None, typer.Option(min=0.0, help="Evaluations that a first derivative counts as (default n + 1).")
    ] = None,
    hessian_weight: Annotated[
        float | None, typer.Option(min=0.0, help="Evaluations that a Hessian counts as (default (n + 1)(n + 2)/2).")
    ] = None,
    engine: Annotated[
        bool,
        typer.Option("--engine", help="Play every solver's best gait in MuJoCo (extra sim), those not played yet."),
    ] = False,
    code: Code = None,
    servos: DriveOptions,
    as_csv: AsCsv = False,
    as_json: AsJson = False,
) -> None:
    """Write a study's report anew from all records of its folder, without running a solver.

    Solvers that a later call left out are there too; runs of an earlier definition stand under a name that says how it differs.

    With `--engine` the best gaits are played, and the report says whether the engine confirms the model; what it found is kept.

    Examples: `nlp-gait report results`, `nlp-gait report results --gradient-weight 5`,
    `nlp-gait report results --engine`, `nlp-gait report results --engine --drive held`
    """
    from compare.analysis.editions import label_editions
    from compare.analysis.statistics.run_length import Weighting
    from compare.report import rebuild_report
    from compare.study.record_files import read_records

    if not engine and servos != DriveOptions():
        raise InputError("the drive is that of gaits that are played: give --engine as well")
    for flag, weight in (("--gradient-weight", gradient_weight), ("--hessian-weight", hessian_weight)):
        if weight is not None and not math.isfinite(weight):
            raise InputError(f"{flag} must be a finite number, got {weight}")
    weighting = Weighting(gradient=gradient_weight, jacobian=gradient_weight, hessian=hessian_weight)
    name_all(code)
    plays = play_best(folder, label_editions(read_records(folder)), servos.make()) if engine else []
    written = rebuild_report(folder, weighting, as_csv=as_csv)
    print_result(as_json, plain_plays(plays), written, lambda: print_plays(plays))


def play_best(folder: Path, records: Sequence[RunRecord], drive: Drive) -> list[SimulatedGait]:
    """Play every solver's best gait, those that have not been played yet.

    Raises:
        InputError: none of the problems can be played.
    """
    from compare.analysis.simulated_gaits import select_best_gaits
    from compare.study.simulations import simulate_records

    gaits = select_best_gaits(records)
    try:
        with progress_bar("gaits", len(gaits)) as advance:
            plays = simulate_records(folder, gaits, drive, advance)
    except KeyboardInterrupt:
        end_interrupted(
            f"interrupted while gaits were played; those that ended are kept; continue with `nlp-gait report --engine {folder}`"
        )
    if gaits and not plays:
        names = ", ".join(dict.fromkeys(record.problem for record in gaits))
        raise InputError(f"no gait of {names} can be played in the engine; leave out --engine")
    return plays


def plain_plays(plays: Sequence[SimulatedGait]) -> dict[str, Any]:
    """What was played, by problem, and how far the engine confirms the model, as plain data; nothing if nothing was."""
    from compare.analysis.simulated_gaits import group_by_problem, measure_agreement

    found = {
        problem: {"gaits": [asdict(played) for played in own], "agreement": asdict(measure_agreement(own))}
        for problem, own in group_by_problem(plays).items()
    }
    return {"engine": found} if found else {}


def print_plays(plays: Sequence[SimulatedGait]) -> None:
    """A table for each problem, and how far the engine confirms the model."""
    from compare.analysis.simulated_gaits import (
        HEADER,
        describe_drive,
        group_by_problem,
        make_engine_rows,
        measure_agreement,
    )

    for problem, own in group_by_problem(plays).items():
        print_table(f"{problem} played: {describe_drive(own[0].drive)}", HEADER, make_engine_rows(own))
        stdout.print(measure_agreement(own).describe())
    if plays:
        stdout.print(ENGINE_TABLE)
