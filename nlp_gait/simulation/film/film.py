"""A film of one gait, or of two side by side: each from the side, the front and above, with its numbers."""

from __future__ import annotations

import re
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, closing

import numpy as np
from PIL import Image

from nlp_gait.errors import InputError
from nlp_gait.interrupts import delay_interrupts
from nlp_gait.simulation.film.recording import Recording
from nlp_gait.simulation.film.scene import Stage, View, stairs
from nlp_gait.simulation.film.strip import PAPER, Captions, Strip, pasted
from nlp_gait.simulation.film.video import Frame

SMALLEST, LARGEST = (320, 240), (3840, 2160)
LINES = 30  # of text in a picture's height
STRIP_LINES = 3.6
LEAST_POWER = 0.1  # [W] at the top of its curve
GAP = 4  # between two gaits [pixels]


def parse_picture_size(text: str) -> tuple[int, int]:
    """Width and height from a text like 1280x720 [pixels].

    Raises:
        InputError: it is none, or too small or large.
    """
    found = re.fullmatch(r"(\d{1,5})x(\d{1,5})", text.strip().lower())
    size = (int(found[1]), int(found[2])) if found else (0, 0)
    if not all(low <= value <= high for low, value, high in zip(SMALLEST, size, LARGEST, strict=True)):
        low, high = ("x".join(map(str, limit)) for limit in (SMALLEST, LARGEST))
        raise InputError(f"the size of a film is WIDTHxHEIGHT in pixels from {low} to {high}, got {text!r}")
    return size


def draw_pictures(recordings: Sequence[Recording], size: tuple[int, int], note: str = "") -> Iterator[Frame]:
    """Pictures (height, width, 3) of all recordings beside each other; one that ends before the others stays as it ended.

    Args:
        recordings: one or two, with the same time between pictures.
        size: width and height [pixels].
        note: one line about all of them.

    Raises:
        OutputError: this machine has no way to draw off the screen.
    """
    width, height = size
    share = (width - GAP * (len(recordings) - 1)) // len(recordings)
    line = height // LINES
    strip_height = round(STRIP_LINES * line)
    most_power = max(LEAST_POWER, *(float(np.max(recording.power)) for recording in recordings))
    end_s = max(float(recording.t[-1]) for recording in recordings)
    with ExitStack() as open_stages:
        parts = []
        for i, recording in enumerate(recordings):
            left = i * (share + GAP)
            views = _views(share, height - strip_height, "back" if stairs(recording.model).any() else "front")
            stage = open_stages.enter_context(closing(Stage(recording, views, share, height - strip_height)))
            moved = tuple(
                View(name=v.name, left=left + v.left, top=v.top, width=v.width, height=v.height) for v in views
            )
            strip = Strip(left=left, top=height - strip_height, width=share, height=strip_height)
            parts.append((left, recording, stage, Captions(recording, moved, strip, line, most_power, end_s)))
        for k in range(max(len(recording.t) for recording in recordings)):
            with delay_interrupts():  # a driver of graphics is not left in the middle of a picture
                picture = Image.new("RGB", size, PAPER)
                for left, recording, stage, captions in parts:
                    own = min(k, len(recording.t) - 1)
                    pasted(stage.picture(own), left, 0, picture)
                    captions.draw(picture, own, note)
            yield np.asarray(picture)


def _views(width: int, height: int, end: str) -> tuple[View, ...]:
    """Side, front or back, and above: beside each other in a wide area, the side on top of the others in a narrow one.

    Stairs hide a robot from the front.
    """
    if width >= 1.3 * height:
        side, front = round(0.62 * width), round(0.62 * height)
        return (
            View(name="side", left=0, top=0, width=side, height=height),
            View(name=end, left=side, top=0, width=width - side, height=front),
            View(name="above", left=side, top=front, width=width - side, height=height - front),
        )
    side, front = round(0.56 * height), width // 2
    return (
        View(name="side", left=0, top=0, width=width, height=side),
        View(name=end, left=0, top=side, width=front, height=height - side),
        View(name="above", left=front, top=side, width=width - front, height=height - side),
    )
