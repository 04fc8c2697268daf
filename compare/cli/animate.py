"""``nlp-gait animate``."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from compare.cli.command import command
from compare.cli.common import interruptible, output_file, print_written
from compare.cli.options import StoredGait

SHEET = ".png"


@command
def animate(
    stored: StoredGait,
    out: Annotated[
        Path | None, typer.Option(help="A .gif or .mp4, or a .png contact sheet; by default a GIF next to the result.")
    ] = None,
    frames_per_s: Annotated[float, typer.Option("--fps", min=0.1, max=50.0, help="Frames per second.")] = 12.5,
    speed: Annotated[float, typer.Option(min=0.01, max=100.0, help="Speed of the film; 1 is real time.")] = 1.0,
    poses: Annotated[int, typer.Option(min=2, max=20, help="Poses of a contact sheet.")] = 6,
) -> None:
    """Draw a gait as a stick figure with support polygon, zero-moment point and centre of mass.

    Example: `nlp-gait animate best.json --out walk.gif` after `nlp-gait solve nao-ssp --out best.json`
    """
    from compare.drawing.animation import draw_frames, write_contact_sheet
    from compare.drawing.gait_figure import make_skeleton
    from nlp_gait.simulation.film.video import check_frames, check_video_path, write_video

    loaded = stored.load()
    target = output_file(stored.result.with_suffix(".gif") if out is None else out)
    if target.suffix.lower() != SHEET:
        check_video_path(target)
    skeleton = make_skeleton(loaded, frames_per_s / speed)
    with interruptible():
        if target.suffix.lower() == SHEET:
            write_contact_sheet(skeleton, target, poses)
        else:
            duration_s = float(skeleton.t[-1] - skeleton.t[0]) / speed
            check_frames(duration_s, frames_per_s)
            write_video(target, draw_frames(skeleton), (len(skeleton.t) - 1) / duration_s)
    print_written(target)
