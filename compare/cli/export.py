"""``nlp-gait animate``, ``export``, ``export-objective`` and ``export-solver``."""

from pathlib import Path
from typing import Annotated

import typer

from compare.cli.command import OUTPUT, OUTPUT_FILE, command
from compare.cli.endings import report_interrupts
from compare.cli.options import AsJson, NamedProblem, StoredGait
from compare.cli.outputs import check_output_file
from compare.cli.printing import print_result, print_written
from compare.study.references import find_reference
from nlp_gait import gaitbench
from nlp_gait.backends.identity import identify_problem
from nlp_gait.export.nl_file import export_nl
from nlp_gait.export.set_points import PERIOD_MS
from nlp_gait.export.solver import export_solver as write
from nlp_gait.gaitbench import c_export
from nlp_gait.simulation.video import check_frames, check_video_path, write_video

SHEET = ".png"  # suffix of a contact sheet


@command
def export(
    stored: StoredGait,
    format_: Annotated[str, typer.Option("--format", help="webots, csv, json, mjcf, mujoco-keyframes, naoqi or ros.")],
    out: Annotated[
        Path | None, typer.Option(help="File; by default next to the result, with the format's suffix."), OUTPUT_FILE
    ] = None,
    period_ms: Annotated[int, typer.Option(min=1, max=86400000, help="Time between rows [ms].")] = PERIOD_MS,
) -> None:
    """Write a gait in a format of other tools.

    Example: `nlp-gait export best.json --format webots` after `nlp-gait solve nao-ssp --out best.json`
    """
    from nlp_gait.export.formats import FORMATS, write_as

    loaded = stored.load()
    target = check_output_file(out or stored.result.with_name(stored.result.stem + FORMATS.get(format_, "")))
    write_as(format_, target, loaded, period_ms)
    print_written(target)


@command
def export_objective(
    instance: Annotated[
        str, typer.Argument(metavar="INSTANCE", help="Of GaitBench, for example ssp-v5 or gb2:ssp:3, or a problem.")
    ],
    to: Annotated[Path, typer.Option("--to", help="Folder for the files."), OUTPUT],
    as_json: AsJson = False,
) -> None:
    """Write an instance of GaitBench as plain C++ with a C header, for C, MATLAB, Octave and Julia.

    The files need only libc and libm: source, header, build script, an example in C, and callers for the others.

    Example: `nlp-gait export-objective ssp-v5 --to DIR`, then `sh DIR/build.sh && DIR/main < /dev/null`
    """
    written = c_export.export_objective(gaitbench.load(instance), to)
    print_result(as_json, {"instance": instance}, written, lambda: None)


@command
def export_solver(
    to: Annotated[Path, typer.Option("--to", help="Folder for the files."), OUTPUT],
    *,
    problem: NamedProblem,
    nl: Annotated[
        bool,
        typer.Option("--nl", help="Write an .nl file for AMPL's solvers instead, with names and best known value."),
    ] = False,
    as_json: AsJson = False,
) -> None:
    """Write a problem's NLP with first and second derivatives as plain C++ with a C header, for a solver on board.

    The files need only libc and libm: source, header (order of variables, sparsity, bounds), build script, an example in C.

    Examples: `nlp-gait export-solver nao-ssp --to DIR`, then `sh DIR/build.sh && DIR/main`,
    `nlp-gait export-solver nao-ssp --to DIR --nl`
    """
    loaded = problem.spec().load()
    if nl:
        written = export_nl(loaded, to, find_reference(identify_problem(loaded)).to_json())
    else:
        written = write(loaded, to)
    print_result(as_json, {"problem": loaded.address}, written, lambda: None)


@command
def animate(
    stored: StoredGait,
    out: Annotated[
        Path | None,
        typer.Option(
            help="A .gif or .mp4, a .png contact sheet, or an .html page; by default a GIF next to the result."
        ),
        OUTPUT_FILE,
    ] = None,
    frames_per_s: Annotated[float, typer.Option("--fps", min=0.1, max=50.0, help="Frames per second.")] = 12.5,
    speed: Annotated[float, typer.Option(min=0.01, max=100.0, help="Speed of the film; 1 is real time.")] = 1.0,
    poses: Annotated[int, typer.Option(min=2, max=20, help="Poses of a contact sheet.")] = 6,
) -> None:
    """Draw a gait as a stick figure with support polygon, zero-moment point and centre of mass.

    An .html file is a page that plays the gait in 3-D, with power and balance margin.

    Examples: `nlp-gait animate best.json --out walk.gif` after `nlp-gait solve nao-ssp --out best.json`,
    `nlp-gait animate best.json --out walk.html`
    """
    from compare.drawing.animation import draw_frames, write_contact_sheet
    from compare.drawing.gait_figure import make_skeleton
    from compare.report.interactive import animate_gait

    loaded = stored.load()
    target = check_output_file(stored.result.with_suffix(".gif") if out is None else out)
    if target.suffix.lower() == ".html":
        animate_gait(loaded.problem, loaded.x, loaded.problem.name).write(target)
        print_written(target)
        return
    if target.suffix.lower() != SHEET:
        check_video_path(target)
    skeleton = make_skeleton(loaded, frames_per_s / speed)
    with report_interrupts():
        if target.suffix.lower() == SHEET:
            write_contact_sheet(skeleton, target, poses)
        else:
            duration_s = float(skeleton.t[-1] - skeleton.t[0]) / speed
            check_frames(duration_s, frames_per_s)
            write_video(target, draw_frames(skeleton), (len(skeleton.t) - 1) / duration_s)
    print_written(target)
