"""``nlp-gait walk``."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, cast

import typer

from compare.cli.common import (
    AsJson,
    Fix,
    Intervals,
    Options,
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
    from compare.questions.walk.study import Gait
    from nlp_gait.simulation.walking import Walk


@command
def walk(
    over: Annotated[
        str,
        typer.Option(metavar="NAME=LOW:HIGH:COUNT", help="Speeds, or another parameter or variable; NAME=V1,V2,..."),
    ] = "speed_m_s=0.01:0.1:10",
    steps: Annotated[
        int, typer.Option(min=0, max=1000, help="Play so many steps of each gait in MuJoCo (extra sim); 0 plays none.")
    ] = 0,
    starts: Annotated[int, typer.Option(min=1, help="Random starts where no neighbour helps.")] = 5,
    seed: Seed = 0,
    robot: Robot = None,
    intervals: Intervals = None,
    option: Options = None,
    values: Set = None,
    fix: Fix = None,
    out: Annotated[Path, typer.Option(help="Folder for the table, the gaits and the pictures.")] = Path("results"),
    as_json: AsJson = False,
) -> None:
    """Cheapest walking cycle at each speed: cost of transport, and how each gait walks in a physics engine.

    The problem is nao-cycle at least power; each point starts from its neighbours. A cycle is played open loop.

    Examples: `nlp-gait walk`, `nlp-gait walk --over speed_m_s=0.02,0.04 --steps 10`,
    `nlp-gait walk --over ssp_dbm_y_mean_limit_m=0.02:0.035:4 --set speed_m_s=0.03 --steps 10`
    """
    from compare.questions.sweep.study import parse_axis
    from compare.questions.walk.report import write_figures
    from compare.questions.walk.study import CYCLE, optimal_gaits, played, result_of, solves, write_walk
    from nlp_gait.backends.interrupts import Interrupted
    from nlp_gait.files import writable_folder
    from nlp_gait.simulation.engine import mujoco

    if steps:
        mujoco()  # said now if it is missing, not after the work
    folder, axis = writable_folder(out), parse_axis(over)
    spec = problem_spec(CYCLE, robot, intervals, None, ["objective=power", *(option or ())], values, fix)
    stopped = ""
    try:
        with progress_bar("solves", solves(axis)) as advance:
            gaits = optimal_gaits(spec, axis, starts=starts, seed=seed, progress=lambda: advance(""))
        with progress_bar("walks", len(gaits)) as advance:
            for i, gait in enumerate(gaits if steps else ()):
                gaits[i] = played(spec, gait, steps)
                advance(f"{gait.at:g}")
    except Interrupted as interrupt:
        gaits, stopped = cast("list[Gait]", interrupt.partial), interrupt.sentence
        if not gaits:
            end_interrupted(f"{stopped}; nothing was written")
    except KeyboardInterrupt:
        stopped = "interrupted while the gaits were played"
    feasible = [gait for gait in gaits if gait.found.feasible]
    cheapest = min(feasible, key=lambda gait: gait.indexes["cost_of_transport"], default=None)
    written = write_walk(folder, spec, gaits)
    shown = None if cheapest is None else result_of(spec, cheapest.found)
    written += write_figures(folder, gaits, spec.load(), shown)
    if as_json:
        print_json({"gaits": [gait.to_json() for gait in gaits], "files": [str(path) for path in written]})
    else:
        _print(gaits)
        for path in written:
            stdout.print(f"wrote {path}", soft_wrap=True)
    if stopped:
        end_interrupted(f"{stopped}; what was found is in {folder}")
    if not feasible:
        fail(gaits[0].found.status)


def _print(gaits: Sequence[Gait]) -> None:
    (name,) = gaits[0].found.at
    units = ("power_W", "W", ".4f"), ("cost_of_transport", "", ".4f"), ("step_length_m", "m", ".4f")
    times = "single_support_time_s", "double_support_time_s"
    header = (name, "power", "cost of transport", "step", "single support", "double support")
    rows = [
        (
            f"{gait.at:g}",
            *(f"{gait.indexes[key]:{digits}} {unit}".rstrip() for key, unit, digits in units),
            *(f"{gait.found.x[time]:.3f} s" for time in times),
        )
        for gait in gaits
        if gait.found.feasible
    ]
    print_table("Cheapest cycles", header, rows)
    for gait in gaits:
        if not gait.found.feasible:
            stdout.print(f"{name} = {gait.at:g}: {gait.found.status}", soft_wrap=True)
    walks = [(gait, gait.walk) for gait in gaits if gait.walk is not None]
    if walks:
        _print_walks(name, walks)


def _print_walks(name: str, walks: Sequence[tuple[Gait, Walk]]) -> None:
    measured = ("fate", "walked", "of", "drift", "heading", "tilt", "tracking", "mechanical power", "model", "energy")
    table = []
    for gait, walk in walks:
        found = walk.measurements
        fate = "walks" if found.fell_at_s is None else f"falls at {found.fell_at_s:.2f} s"
        table.append(
            (
                f"{gait.at:g}",
                fate if walk.steps_done == walk.steps else f"{fate}, {walk.steps_done} steps",
                *(
                    "-" if value is None else f"{1000 * value:.0f} mm"
                    for value in (walk.walked_m, walk.planned_m, walk.drift_m)
                ),
                "-" if walk.heading_deg is None else f"{walk.heading_deg:.1f} deg",
                f"{found.largest_tilt_deg:.1f} deg",
                f"{found.tracking_max_rad:.3f} rad",
                f"{found.measured.mechanical_W:.3f} W",
                f"{found.predicted.mechanical_W:.3f} W",
                "-" if walk.energy_J_per_m is None else f"{walk.energy_J_per_m:.1f} J/m",
            )
        )
    print_table(f"{walks[0][1].steps} steps in the physics engine, open loop", (name, *measured), table)
