"""``nlp-gait walk``."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from compare.analysis.units import millimetres, with_unit
from compare.cli.command import command
from compare.cli.common import end_interrupted, fail, print_result, print_rows, progress_bar, stdout
from compare.cli.interrupts import until_interrupted
from compare.cli.options import RESULTS, AsJson, ProblemOptions, Seed
from nlp_gait.files import writable_folder

if TYPE_CHECKING:
    from compare.questions.walk.study import Gait
    from nlp_gait.simulation.walking import Walk


@command
def walk(
    *,
    over: Annotated[
        str,
        typer.Option(metavar="NAME=LOW:HIGH:COUNT", help="Speeds, or another parameter or variable; NAME=V1,V2,..."),
    ] = "speed_m_s=0.01:0.1:10",
    steps: Annotated[
        int,
        typer.Option(min=0, max=1000, help="Play this many steps of each gait in MuJoCo (extra sim); 0 plays none."),
    ] = 0,
    starts: Annotated[int, typer.Option(min=1, help="Random starts where no neighbour helps.")] = 5,
    seed: Seed = 0,
    problem: ProblemOptions,
    out: Annotated[Path, typer.Option(help="Folder for the table, the gaits and the pictures.")] = RESULTS,
    as_json: AsJson = False,
) -> None:
    """Cheapest walking cycle at each speed: cost of transport, and how each gait walks in a physics engine.

    The problem is nao-cycle with the power as its objective; each point starts from its neighbours. A cycle is played open loop.

    Examples: `nlp-gait walk`, `nlp-gait walk --over speed_m_s=0.02,0.04 --steps 10`,
    `nlp-gait walk --over ssp_dbm_y_mean_limit_m=0.02:0.035:4 --set speed_m_s=0.03 --steps 10`
    """
    from compare.questions.sweep.study import parse_axis
    from compare.questions.walk.report import write_figures
    from compare.questions.walk.study import CYCLE, optimal_gaits, played, result_of, solves, write_walk
    from nlp_gait.simulation.engine import mujoco

    if steps:
        mujoco()  # said now if it is missing, not after the work
    folder, axis = writable_folder(out), parse_axis(over)
    spec = replace(problem, option=["objective=power", *(problem.option or ())]).spec_of(CYCLE)
    with progress_bar("solves", solves(axis)) as advance:
        gaits, stopped = until_interrupted(
            lambda: optimal_gaits(spec, axis, starts=starts, seed=seed, progress=lambda: advance(""))
        )
    if steps and not stopped:
        try:
            with progress_bar("walks", len(gaits)) as advance:
                for i, gait in enumerate(gaits):
                    gaits[i] = played(spec, gait, steps)
                    advance(f"{gait.at:g}")
        except KeyboardInterrupt:
            stopped = "interrupted while the gaits were played"
    feasible = [gait for gait in gaits if gait.found.feasible]
    cheapest = min(feasible, key=lambda gait: gait.indexes["cost_of_transport"], default=None)
    written = write_walk(folder, spec, gaits)
    shown = None if cheapest is None else result_of(spec, cheapest.found)
    written += write_figures(folder, gaits, spec.load(), shown)
    print_result(as_json, {"gaits": [gait.to_json() for gait in gaits]}, written, lambda: _print(gaits))
    if stopped:
        end_interrupted(f"{stopped}; what was found is in {folder}")
    if not feasible:
        fail(gaits[0].found.status)


def _print(gaits: Sequence[Gait]) -> None:
    (name,) = gaits[0].found.at
    print_rows(
        "Cheapest cycles",
        [gait for gait in gaits if gait.found.feasible],
        {
            name: lambda gait: f"{gait.at:g}",
            "power": lambda gait: f"{gait.indexes['power_W']:.4f} W",
            "cost of transport": lambda gait: f"{gait.indexes['cost_of_transport']:.4f}",
            "step": lambda gait: f"{gait.indexes['step_length_m']:.4f} m",
            "single support": lambda gait: f"{gait.found.x['single_support_time_s']:.3f} s",
            "double support": lambda gait: f"{gait.found.x['double_support_time_s']:.3f} s",
        },
    )
    for gait in gaits:
        if not gait.found.feasible:
            stdout.print(f"{name} = {gait.at:g}: {gait.found.status}", soft_wrap=True)
    walks = [(gait.at, gait.walk) for gait in gaits if gait.walk is not None]
    if walks:
        _print_walks(name, walks)


def _print_walks(name: str, walks: Sequence[tuple[float, Walk]]) -> None:
    print_rows(
        f"{walks[0][1].steps} steps in the physics engine, open loop",
        walks,
        {
            name: lambda at_walk: f"{at_walk[0]:g}",
            "fate": lambda at_walk: _fate(at_walk[1]),
            "walked": lambda at_walk: millimetres(at_walk[1].walked_m, ".0f"),
            "of": lambda at_walk: millimetres(at_walk[1].planned_m, ".0f"),
            "drift": lambda at_walk: millimetres(at_walk[1].drift_m, ".0f"),
            "heading": lambda at_walk: with_unit(at_walk[1].heading_deg, "deg", ".1f"),
            "tilt": lambda at_walk: f"{at_walk[1].measurements.largest_tilt_deg:.1f} deg",
            "tracking": lambda at_walk: f"{at_walk[1].measurements.tracking_max_rad:.3f} rad",
            "mechanical power": lambda at_walk: f"{at_walk[1].measurements.measured.mechanical_W:.3f} W",
            "model": lambda at_walk: f"{at_walk[1].measurements.predicted.mechanical_W:.3f} W",
            "energy": lambda at_walk: with_unit(at_walk[1].energy_J_per_m, "J/m", ".1f"),
        },
    )


def _fate(walk: Walk) -> str:
    fell_at_s = walk.measurements.fell_at_s
    fate = "walks" if fell_at_s is None else f"falls at {fell_at_s:.2f} s"
    return fate if walk.steps_done == walk.steps else f"{fate}, {walk.steps_done} steps"
