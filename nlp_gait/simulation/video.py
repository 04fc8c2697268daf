"""Sequences of pictures as GIF files."""

import math
from collections.abc import Iterable
from pathlib import Path

import numpy as np

from nlp_gait.errors import InputError
from nlp_gait.files import replace_file

MOST_FRAMES = 3000
COLOURS = 128  # fewer lose small marks

Frame = np.ndarray[tuple[int, int, int], np.dtype[np.uint8]]


def check_video_path(path: Path) -> Path:
    """Return the path of a video; raises InputError if it does not end in .gif."""
    if path.suffix.lower() != ".gif":
        raise InputError(f"the name of a video must end in .gif, got {path.name!r}")
    return path


def check_frames(duration_s: float, frames_per_s: float) -> None:
    """Raise InputError if a film has too many frames."""
    count = math.ceil(duration_s * frames_per_s)
    if count > MOST_FRAMES:
        raise InputError(
            f"a film takes at most {MOST_FRAMES} frames, got {duration_s:g} s at {frames_per_s:g} frames a second = {count}; "
            "show fewer steps"
        )


def write_video(path: Path, frames: Iterable[Frame], frames_per_s: float) -> None:
    """Write frames (height, width, 3) of equal size as a GIF; raises OutputError."""
    from PIL import Image

    images = (
        Image.fromarray(frame).quantize(COLOURS, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
        for frame in frames
    )
    with replace_file(path) as temporary:
        next(images).save(
            temporary,
            format="GIF",
            save_all=True,
            append_images=images,
            duration=max(20, round(1000.0 / frames_per_s)),  # [ms]; viewers do not show more frames per second
            loop=0,
            optimize=True,
            comment=b"nlp-gait",
        )
