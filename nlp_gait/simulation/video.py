"""Sequences of pictures as GIF or MP4 files."""

import math
from collections.abc import Iterable
from contextlib import closing
from itertools import chain
from pathlib import Path

import numpy as np

from nlp_gait.errors import InputError, MissingExtraError
from nlp_gait.files import replace_file

MOST_FRAMES = 3000
SUFFIXES = (".gif", ".mp4")
COLOURS = 128  # of a GIF; fewer lose small marks

Frame = np.ndarray[tuple[int, int, int], np.dtype[np.uint8]]


def check_video_path(path: Path) -> Path:
    """Return the path if its suffix names a video format; raises InputError, or MissingExtraError for MP4 without its encoder."""
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(f"the name of a video must end in {' or '.join(SUFFIXES)}, got {path.name!r}")
    if path.suffix.lower() == ".mp4":
        try:
            import imageio_ffmpeg  # noqa: F401
        except ImportError as error:
            raise MissingExtraError(
                f"MP4 needs imageio-ffmpeg ({error}); install it with pip install imageio-ffmpeg, or write a .gif"
            ) from error
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
    """Write frames (height, width, 3) of equal size; raises OutputError, and as ``check_video_path``."""
    check_video_path(path)
    with replace_file(path) as temporary:
        (_write_gif if path.suffix.lower() == ".gif" else _write_mp4)(temporary, frames, frames_per_s)


def _write_gif(path: Path, frames: Iterable[Frame], frames_per_s: float) -> None:
    from PIL import Image

    images = (
        Image.fromarray(frame).quantize(COLOURS, Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
        for frame in frames
    )
    duration_ms = max(20, round(1000.0 / frames_per_s))  # viewers do not show more frames per second
    next(images).save(
        path,
        format="GIF",
        save_all=True,
        append_images=images,
        duration=duration_ms,
        loop=0,
        optimize=True,
        comment=b"nlp-gait",
    )


def _write_mp4(path: Path, frames: Iterable[Frame], frames_per_s: float) -> None:
    import imageio_ffmpeg

    frames = iter(frames)
    first = next(frames)
    height, width = (length // 2 * 2 for length in first.shape[:2])  # even, for the codec
    writer = imageio_ffmpeg.write_frames(
        str(path),
        (width, height),
        fps=frames_per_s,
        macro_block_size=2,
        output_params=["-f", "mp4", "-metadata", "comment=nlp-gait"],
    )
    with closing(writer):
        writer.send(None)
        for frame in chain([first], frames):
            writer.send(np.ascontiguousarray(frame[:height, :width]))
