"""``nlp-gait robust``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

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
    print_json,
    print_table,
    problem_spec,
    progress_bar,
    stdout,
)

if TYPE_CHECKING:
    from compare.questions.robust.family import Worst
    from compare.questions.robust.playback import Played
    from compare.questions.robust.study import Robust

SHOWN = 4  # changes of a robot that are named in a table, largest first


@command
def robust(
    problem: ProblemName = "nao-ssp",
    mass: Annotated[float, typer.Option(min=0.0, max=50.0, help="Half-width of every mass [%].")] = 5.0,
    sole: Annotated[
        float, typer.Option(min=0.0, max=20.0, help="Half-width of the soles' position, x and y [mm].")
    ] = 2.0,
    starts: Annotated[int, typer.Option(min=1, help="Random starts of the nominal problem.")] = 10,
    seed: Seed = 0,
    samples: Annotated[int, typer.Option(min=0, help="Random corners on which each result is checked.")] = 20,
    simulate: Annotated[bool, typer.Option(help="Play both gaits in MuJoCo on the worst robots (extra sim).")] = True,
    robot: Robot = None,
    intervals: Intervals = None,
    derivatives: Derivatives = None,
    option: Options = None,
    values: Set = None,
    fix: Fix = None,
    out: Annotated[Path, typer.Option(help="Folder for the CSV table and the picture.")] = Path("results"),
    as_json: AsJson = False,
) -> None:
    """Find the least power of a gait that keeps its limits whatever masses and soles are within their tolerances.

    One motion for all robots of a box, its worst corners found one after the other. Example: `nlp-gait robust nao-ssp`
    """
    from compare.questions.robust.playback import played
    from compare.questions.robust.report import write_robust
    from compare.questions.robust.study import boxes
    from compare.questions.robust.study import robust as find
    from nlp_gait.files import writable_folder

    if simulate:
        from nlp_gait.simulation.engine import mujoco

        mujoco()
    folder = writable_folder(out)
    spec = problem_spec(problem, robot, intervals, derivatives, option, values, fix)
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
    written = write_robust(folder, problem, found, runs)
    if as_json:
        data = {"problem": problem, "boxes": [asdict(r) for r in found], "played": [asdict(run) for run in runs]}
        print_json({**data, "files": [str(path) for path in written]})
    else:
        _print(problem, found, runs, mass, sole)
        stdout.print(f"Written: {', '.join(map(str, written))}")
    if stopped:
        end_interrupted(f"{stopped}; what was found is in {folder}")


def _print(problem: str, found: Sequence[Robust], runs: Sequence[Played], mass: float, sole: float) -> None:
    stdout.print(
        f"{problem}: {found[0].nominal_W:.6f} W for the nominal robot; masses +-{mass:g} %, soles +-{sole:g} mm"
    )
    rows = [
        (
            r.name,
            _violation(r.nominal_worst),
            f"{r.power_W:.6f} W",
            f"{r.power_W - r.nominal_W:+.6f} W, {r.power_W / r.nominal_W - 1.0:+.2%}",
            f"{r.worst_W:.6f} W",
            f"{_violation(r.worst)}; {_violation(r.random_worst)}",
            f"{len(r.corners)}" + ("" if r.settled else ", not settled"),
        )
        for r in found
    ]
    header = (
        "uncertain",
        "nominal gait breaks",
        "robust gait, nominal robot",
        "price",
        "worst corner",
        "robust gait breaks: scenarios; random corners",
        "scenarios",
    )
    print_table("Price of robustness", header, rows)
    for r in found:
        if r.nominal_worst.violation > 0.0:
            stdout.print(f"{r.name}: worst for the nominal gait with {_changes(r.nominal_worst.corner)}")
    names = list(found[0].x)
    optima = [(n, f"{found[0].nominal_x[n]:.5g}", *(f"{r.x[n]:.5g}" for r in found)) for n in names]
    print_table("Optima", ("variable", "nominal", *(r.name for r in found)), optima)
    if runs:
        widest = found[-1]
        played = [
            (
                run.gait,
                _changes(widest.corners[widest.robots.index(run.robot)]),
                "stays up" if run.fell_at_s is None else f"FALLS at {run.fell_at_s:.2f} s",
                f"{run.largest_tilt_deg:.1f} degrees",
                f"{1000 * run.predicted_margin_m:.1f} mm",
                f"{1000 * run.margin_m:.1f} mm",
            )
            for run in runs
        ]
        columns = ("gait", "robot", "in MuJoCo", "largest tilt", "mean lateral margin: model", "MuJoCo")
        print_table(f"Played open loop on the robots of the last box ({widest.name})", columns, played)


def _violation(worst: Worst) -> str:
    return f"{worst.row} by {worst.violation:.3g} {worst.unit}" if worst.violation > 0.0 else "nothing"


def _changes(corner: Mapping[str, float]) -> str:
    """The largest changes of a robot in words."""
    if not corner:
        return "no change"
    lengths = [
        f"{name.removesuffix('_m')} {1000 * value:+g} mm" for name, value in corner.items() if name.endswith("_m")
    ]
    masses = [(name, value) for name, value in corner.items() if not name.endswith("_m")]
    up, down = (sorted(name.removesuffix(".mass") for name, v in masses if v * sign > 0) for sign in (1, -1))
    parts = lengths
    for names, value in (
        (up, max((v for _, v in masses), default=0.0)),
        (down, min((v for _, v in masses), default=0.0)),
    ):
        if names:
            listed = ", ".join(names[:SHOWN]) + (f" and {len(names) - SHOWN} more" if len(names) > SHOWN else "")
            parts.append(f"{value:+.0%} {listed}")
    return "; ".join(parts)
