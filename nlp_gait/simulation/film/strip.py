"""Text and the course of the power, drawn into pictures of the simulated robot."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from nlp_gait.simulation.film.recording import Recording
from nlp_gait.simulation.film.scene import View
from nlp_gait.simulation.film.video import Frame

INK, FAINT, ALARM, PAPER = (32, 32, 32), (110, 110, 110), (190, 30, 30), (255, 255, 255)
LEFT, RIGHT, FORCE, PLANNED = (0, 114, 178), (213, 94, 0), (0, 138, 100), (204, 121, 167)
MARGIN = 0.5  # of a line of text


@dataclass(frozen=True, slots=True, kw_only=True)
class Strip:
    """Where numbers and power are drawn below the views [pixels]."""

    left: int
    top: int
    width: int
    height: int


class Captions:
    """Draws the numbers of one recording."""

    def __init__(
        self, recording: Recording, views: tuple[View, ...], strip: Strip, line: int, most_power: float, end_s: float
    ) -> None:
        """Draw once what stays: the labels' fonts, and the curve of the power.

        Args:
            recording: whose numbers.
            views: of the same gait.
            strip: below them.
            line: height of a line of text [pixels].
            most_power: at the top of the curve [W].
            end_s: at its right end.
        """
        self._recording, self._views, self._strip, self._line = recording, views, strip, line
        self._most_power, self._end_s = most_power, end_s
        self._font, self._small = font(round(0.72 * line)), font(round(0.58 * line))
        self._still = self._strip_without_cursor()

    def draw(self, picture: Image.Image, k: int, note: str) -> None:
        """Draw the captions of an instant; the note stands in the first view's corner."""
        record, strip, line = self._recording, self._strip, self._line
        pad = round(MARGIN * line)
        canvas = ImageDraw.Draw(picture)
        first = self._views[0]
        canvas.text(
            (first.left + pad, first.top + pad // 2),
            self._fitting(record.title, first.width - 2 * pad),
            INK,
            self._font,
        )
        if note:
            canvas.text((first.left + pad, first.top + pad // 2 + line), note, FAINT, self._small)
        for view in self._views:
            self._label(canvas, view)
        picture.paste(self._still, (strip.left, strip.top))
        t = float(record.t[k])
        fell = record.trace.fell_at_s
        fallen = fell is not None and t >= fell
        texts = [
            f"{t:.2f} s",
            f"fell at {fell:.2f} s" if fallen else f"{record.speed[k]:.3f} m/s",
            f"{record.power[k]:.2f} W",
        ]
        for i, text in enumerate(texts):
            colour = ALARM if fallen and i == 1 else INK
            canvas.text((strip.left + pad, strip.top + pad // 2 + i * line), text, colour, self._font)
        x, y = self._at(t, float(record.power[k]))
        top, bottom = self._chart()[1], self._chart()[3]
        canvas.line([(strip.left + x, strip.top + top), (strip.left + x, strip.top + bottom)], fill=FAINT, width=1)
        radius = max(2, line // 7)
        spot = (strip.left + x - radius, strip.top + y - radius, strip.left + x + radius, strip.top + y + radius)
        canvas.ellipse(spot, fill=INK)

    def _label(self, canvas: Any, view: View) -> None:
        """What a view shows, along its lower edge."""
        texts = [(view.name, FAINT)]
        if view.name == "above":
            texts = [("\u25cf centre of pressure", INK), ("\u25cf planned ZMP", PLANNED)]
        elif view.name == "side":
            texts = [
                ("left", LEFT),
                ("right", RIGHT),
                ("\u2191 force of the floor", FORCE),
                ("squares of 0.1 m", FAINT),
            ]
        x, y = view.left + round(MARGIN * self._line), view.top + view.height - round(0.95 * self._line)
        for text, colour in texts:
            width = self._small.getlength(text)
            if x + width > view.left + view.width:
                return
            canvas.text((x, y), text, colour, self._small)
            x += round(width + 0.6 * self._line)

    def _strip_without_cursor(self) -> Image.Image:
        still = Image.new("RGB", (self._strip.width, self._strip.height), PAPER)
        canvas = ImageDraw.Draw(still)
        left, top, right, bottom = self._chart()
        canvas.line([(left, top), (left, bottom), (right, bottom)], fill=FAINT, width=1)
        label = f"power; the axis ends at {self._most_power:.1f} W"
        canvas.text((left + self._line // 4, round(0.1 * self._line)), label, FAINT, self._small)
        record = self._recording
        points = [self._at(float(t), float(power)) for t, power in zip(record.t, record.power, strict=True)]
        if len(points) > 1:
            canvas.line(points, fill=LEFT, width=max(1, self._line // 14), joint="curve")
        return still

    def _chart(self) -> tuple[int, int, int, int]:
        """Left, top, right and bottom of the curve within the strip."""
        pad = round(MARGIN * self._line)
        return (round(6.2 * self._line), round(0.95 * self._line), self._strip.width - pad, self._strip.height - pad)

    def _at(self, t: float, power: float) -> tuple[int, int]:
        left, top, right, bottom = self._chart()
        share = min(1.0, power / self._most_power)
        return (round(left + (right - left) * t / self._end_s), round(bottom - (bottom - top) * share))

    def _fitting(self, text: str, width: int) -> str:
        """The text, cut where it does not fit."""
        if self._font.getlength(text) <= width:
            return text
        while text and self._font.getlength(f"{text} ...") > width:
            text = text[:-1]
        return f"{text.rstrip()} ..."


@cache
def font(size: int) -> ImageFont.FreeTypeFont:
    """Matplotlib's own letters: the same on every machine."""
    import matplotlib

    path = Path(matplotlib.get_data_path()) / "fonts" / "ttf" / "DejaVuSans.ttf"
    return ImageFont.truetype(str(path), size=max(6, size))


def pasted(pixels: Frame, left: int, top: int, picture: Image.Image) -> None:
    """Put pixels into a picture."""
    picture.paste(Image.fromarray(np.ascontiguousarray(pixels)), (left, top))
