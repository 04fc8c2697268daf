"""``nlp-gait robust``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from typing import TYPE_CHECKING, Annotated

import typer

from compare.analysis.units import millimetres
from compare.cli.command import command
from compare.cli.common import end_interrupted, print_result, print_rows, print_table, progress_bar, stdout
from compare.cli.options import RESULTS, AsJson, NaoPhase, Seed, TableFolder
from nlp_gait.files import writable_folder

if TYPE_CHECKING:
    from compare.questions.robust.family import Worst
    from compare.questions.robust.playback import Played
    from compare.questions.robust.study import Robust

SHOWN = 4  # changes of a robot that are named in a table, largest first


@command
def robust(
    *,
    mass: Annotated[float, typer.Option(min=0.0, max=50.0, help="Tolerance of every mass, up and down [%].")] = 5.0,
    sole: Annotated[
        float, typer.Option(min=0.0, max=20.0, help="Tolerance of the soles' position in x and y [mm].")
    ] = 2.0,
    starts: Annotated[int, typer.Option(min=1, help="Random starts of the nominal problem.")] = 10,
    seed: Seed = 0,
    samples: Annotated[int, typer.Option(min=0, help="Random corners on which each result is checked.")] = 20,
    simulate: Annotated[bool, typer.Option(help="Play both gaits in MuJoCo on the worst robots (extra sim).")] = True,
    problem: NaoPhase,
    out: TableFolder = RESULTS,
    as_json: AsJson = False,
) -> None:
    """Find the least power of a gait that keeps its limits for all masses and soles within their tolerances.

    One motion for all robots of a box, its worst corners found one after the other. Example: `nlp-gait robust nao-ssp`
    """
    from compare.questions.robust.playback import played
    from compare.questions.robust.report import write_robust
    from compare.questions.robust.study import boxes
    from compare.questions.robust.study import robust as find

    if simulate:
        from nlp_gait.simulation.engine import mujoco

        mujoco()
    folder = writable_folder(out)
    spec = problem.spec()
    uncertain = boxes(spec, mass / 100.0, sole / 1000.0)
    found: list[Robust] = []
    runs: Sequence[Played] = ()
    stopped = ""
    try:
        with progress_bar("steps", None) as advance:
            for name, box in uncertain.items():
                found.append(find(spec, name, box, starts=starts, seed=seed, samples=samples, progress=advance))
            runs = played(spec, found[-1], advance) if simulate else ()
    except KeyboardInterrupt:
        stopped = f"interrupted after {len(found)} of {len(uncertain)} boxes"
        if not found:
            end_interrupted(f"{stopped}; nothing was written")
    written = write_robust(folder, problem.name, found, runs)
    data = {"problem": problem.name, "boxes": [asdict(r) for r in found], "played": [asdict(run) for run in runs]}
    print_result(as_json, data, written, lambda: _print(problem.name, found, runs, mass, sole))
    if stopped:
        end_interrupted(f"{stopped}; what was found is in {folder}")


def _print(problem: str, found: Sequence[Robust], runs: Sequence[Played], mass: float, sole: float) -> None:
    stdout.print(
        f"{problem}: {found[0].nominal_W:.6f} W for the nominal robot; masses +-{mass:g} %, soles +-{sole:g} mm"
    )
    print_rows(
        "Price of robustness",
        found,
        {
            "uncertain": lambda r: r.name,
            "nominal gait breaks": lambda r: _violation(r.nominal_worst),
            "robust gait, nominal robot": lambda r: f"{r.power_W:.6f} W",
            "price": lambda r: f"{r.power_W - r.nominal_W:+.6f} W, {r.power_W / r.nominal_W - 1.0:+.2%}",
            "worst corner": lambda r: f"{r.worst_W:.6f} W",
            "robust gait breaks: scenarios; random corners": lambda r: (
                f"{_violation(r.worst)}; {_violation(r.random_worst)}"
            ),
            "scenarios": lambda r: f"{len(r.corners)}" + ("" if r.settled else ", not settled"),
        },
    )
    for r in found:
        if r.nominal_worst.violation > 0.0:
            stdout.print(f"{r.name}: worst for the nominal gait with {_changes(r.nominal_worst.corner)}")
    nominal = found[0].nominal_x
    optima = [(name, f"{nominal[name]:.5g}", *(f"{r.x[name]:.5g}" for r in found)) for name in found[0].x]
    print_table("Optima", ("variable", "nominal", *(r.name for r in found)), optima)
    if not runs:
        return
    widest = found[-1]
    print_rows(
        f"Played open loop on the robots of the last box ({widest.name})",
        runs,
        {
            "gait": lambda run: run.gait,
            "robot": lambda run: _changes(widest.corners[widest.robots.index(run.robot)]),
            "in MuJoCo": lambda run: "stays up" if run.fell_at_s is None else f"FALLS at {run.fell_at_s:.2f} s",
            "largest tilt": lambda run: f"{run.largest_tilt_deg:.1f} degrees",
            "mean lateral margin: model": lambda run: millimetres(run.predicted_margin_m),
            "MuJoCo": lambda run: millimetres(run.margin_m),
        },
    )


def _violation(worst: Worst) -> str:
    return f"{worst.row} by {worst.violation:.3g} {worst.unit}" if worst.violation > 0.0 else "nothing"


def _changes(corner: Mapping[str, float]) -> str:
    """The largest changes of a robot in words."""
    lengths = [f"{name.removesuffix('_m')} {1000 * v:+g} mm" for name, v in corner.items() if name.endswith("_m")]
    masses = {name.removesuffix(".mass"): v for name, v in corner.items() if not name.endswith("_m")}
    up, down = (sorted(name for name, v in masses.items() if v * sign > 0) for sign in (1, -1))
    parts = [
        f"{largest(masses.values()):+.0%} {', '.join(names[:SHOWN])}"
        + (f" and {len(names) - SHOWN} more" if len(names) > SHOWN else "")
        for names, largest in ((up, max), (down, min))
        if names
    ]
    return "; ".join([*lengths, *parts]) or "no change"
