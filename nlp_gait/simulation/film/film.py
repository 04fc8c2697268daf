"""Films of one gait, or of two side by side: from the side, the front and above, with captions and a chart of the power."""

import re
from collections.abc import Iterator, Sequence
from contextlib import ExitStack, closing

import numpy as np
from matplotlib.artist import Artist
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from matplotlib.offsetbox import AnchoredOffsetbox, HPacker, TextArea, VPacker
from matplotlib.text import Text
from matplotlib.transforms import IdentityTransform

from nlp_gait.errors import InputError
from nlp_gait.interrupts import delay_interrupts
from nlp_gait.simulation.film.recording import Recording
from nlp_gait.simulation.film.scene import Scene, View, find_stairs
from nlp_gait.simulation.film.video import Frame

SMALLEST, LARGEST = (320, 240), (3840, 2160)
DPI = 64  # exact for every size in pixels
LINES = 30  # of text in a picture's height
LARGE, SMALL = 0.72, 0.58  # heights of letters in lines
STRIP_LINES = 4.2  # below the views
LEAST_POWER = 0.1  # [W] at the top of the chart
GAP = 4  # between two gaits [pixels]
SIDE_SHARE = 0.62  # of the width and of the height
INK, FAINT, ALARM = "#202020", "#6e6e6e", "#be1e1e"
LEFT, RIGHT, FORCE, PLANNED = "#0072b2", "#d55e00", "#008a64", "#cc79a7"
LABELS = {
    "side": {"left": LEFT, "right": RIGHT, "\u2191 force of the floor": FORCE, "squares of 0.1 m": FAINT},
    "above": {"\u25cf centre of pressure": INK, "\u25cf planned ZMP": PLANNED},
}


def parse_picture_size(text: str) -> tuple[int, int]:
    """Return width and height of a text such as 1280x720 [pixels]; raises InputError for another form or size."""
    found = re.fullmatch(r"(\d{1,5})x(\d{1,5})", text.strip().lower())
    size = (int(found[1]), int(found[2])) if found else (0, 0)
    if not all(low <= value <= high for low, value, high in zip(SMALLEST, size, LARGEST, strict=True)):
        low, high = ("x".join(map(str, limit)) for limit in (SMALLEST, LARGEST))
        raise InputError(f"the size of a film is WIDTHxHEIGHT in pixels from {low} to {high}, got {text!r}")
    return size


def draw_pictures(recordings: Sequence[Recording], size: tuple[int, int], note: str = "") -> Iterator[Frame]:
    """Yield pictures (height, width, 3) of one or two recordings side by side; the shorter one stops at its end.

    They have the same time between pictures; ``size`` is width and height [pixels], and ``note`` one line about all of them.
    Raises OutputError if this machine cannot draw off the screen.
    """
    width, height = size
    share = (width - GAP * (len(recordings) - 1)) // len(recordings)
    views_height = height - round(STRIP_LINES * height / LINES)
    most_power = max(LEAST_POWER, *(float(np.max(recording.power)) for recording in recordings))
    end_s = max(float(recording.t[-1]) for recording in recordings)
    figure = Figure(figsize=(width / DPI, height / DPI), dpi=DPI, facecolor="none")
    canvas = FigureCanvasAgg(figure)
    pixels: Frame = np.full((height, width, 3), 255, dtype=np.uint8)
    with ExitStack() as stack:
        panels = []
        for i, recording in enumerate(recordings):
            views = lay_out(share, views_height, "back" if find_stairs(recording.model).any() else "front")
            scene = stack.enter_context(closing(Scene(recording, views, share, views_height)))
            left = i * (share + GAP)
            captions = Captions(figure, recording, views, left, most_power, end_s, note)
            panels.append((slice(left, left + share), recording, scene, captions))
        canvas.draw()  # type: ignore[no-untyped-call]
        still = canvas.copy_from_bbox(figure.bbox)  # type: ignore[no-untyped-call]
        for k in range(max(len(recording.t) for recording in recordings)):
            with delay_interrupts():  # an interrupt inside the graphics driver would break it
                canvas.restore_region(still)  # type: ignore[no-untyped-call]
                for columns, recording, scene, captions in panels:
                    own = min(k, len(recording.t) - 1)
                    pixels[:views_height, columns] = scene.draw(own)
                    captions.draw(own)
                drawn = np.asarray(canvas.buffer_rgba())  # type: ignore[no-untyped-call]
                opacity = drawn[:, :, 3:] / np.float32(255)
                picture: Frame = (pixels * (1 - opacity) + drawn[:, :, :3] * opacity).astype(np.uint8)
            yield picture


def lay_out(width: int, height: int, end: str) -> tuple[View, ...]:
    """Return the views from the side, from the front or back, and from above."""
    side, upper = round(SIDE_SHARE * width), round(SIDE_SHARE * height)
    return (
        View("side", 0, 0, side, height),
        View(end, side, 0, width - side, upper),
        View("above", side, upper, width - side, height - upper),
    )


class Captions:
    """Title, note, labels, numbers and chart of the power of one recording, whose views begin at ``left`` [pixels]."""

    def __init__(
        self,
        figure: Figure,
        recording: Recording,
        views: Sequence[View],
        left: int,
        most_power: float,
        end_s: float,
        note: str,
    ) -> None:
        self._figure, self._recording, self._left = figure, recording, left
        self._width, self._height = figure.bbox.width, figure.bbox.height
        self._line = line = self._height / LINES
        width, strip = max(view.left + view.width for view in views), self._height - STRIP_LINES * line
        title = self._write(0.0, 0.0, recording.title, INK)
        fitting = recording.title
        while fitting and title.get_window_extent().width > views[0].width - line:
            fitting = fitting[:-1]
            title.set_text(f"{fitting.rstrip()} ...")
        self._write(0.0, line, note, FAINT, SMALL)
        for view in views:
            self._label(view)
        self._numbers = [self._write(0.0, strip + i * line, "", INK) for i in range(3)]
        for text in self._numbers:
            text.set_animated(True)
        bounds = (left + 7.5 * line, 1.2 * line, width - 8.2 * line, (STRIP_LINES - 2.0) * line)
        axes = figure.add_axes(tuple(np.array(bounds) / np.tile(figure.bbox.size, 2)), xlim=(0.0, end_s))
        axes.set(ylim=(0.0, most_power), yticks=(0.0, most_power), yticklabels=("0", f"{most_power:.1f} W"))
        axes.set_title("power", loc="left", fontsize=self._points(SMALL), color=FAINT, pad=2.0)
        axes.tick_params(labelsize=self._points(SMALL), colors=FAINT, length=2.0, pad=2.0)
        axes.xaxis.set_major_formatter("{x:g} s")
        axes.spines[["top", "right"]].set_visible(False)
        axes.plot(recording.t, recording.power, color=LEFT, linewidth=line / 16, clip_on=False)
        self._cursor = axes.axvline(0.0, color=FAINT, linewidth=0.8, animated=True)
        (self._dot,) = axes.plot([], [], "o", color=INK, markersize=line / 4, clip_on=False, animated=True)

    def draw(self, k: int) -> None:
        """Draw the numbers of an instant and its place in the chart; everything else is drawn once."""
        record = self._recording
        t, power, fell_at_s = float(record.t[k]), float(record.power[k]), record.simulation.fell_at_s
        fallen = fell_at_s is not None and t >= fell_at_s
        motion = f"fell at {fell_at_s:.2f} s" if fallen else f"{record.speed[k]:.3f} m/s"
        for text, words in zip(self._numbers, (f"{t:.2f} s", motion, f"{power:.2f} W"), strict=True):
            text.set_text(words)
        self._numbers[1].set_color(ALARM if fallen else INK)
        self._cursor.set_xdata([t, t])
        self._dot.set_data([t], [power])
        for artist in (*self._numbers, self._cursor, self._dot):
            self._figure.draw_artist(artist)

    def _label(self, view: View) -> None:
        labels = list(LABELS.get(view.name, {view.name: FAINT}).items())
        corner = (self._left + view.left + self._line / 2, self._height - view.top - view.height + self._line / 4)
        packer = VPacker if view.name == "above" else HPacker
        while labels:
            style = {"fontsize": self._points(SMALL)}
            texts: list[Artist] = [TextArea(text, textprops=style | {"color": colour}) for text, colour in labels]
            box = AnchoredOffsetbox(
                "lower left",
                child=packer(children=texts, pad=0, sep=self._points(SMALL) / 2),
                pad=0,
                borderpad=0,
                frameon=False,
                bbox_to_anchor=corner,
                bbox_transform=IdentityTransform(),
            )
            self._figure.add_artist(box)
            if box.get_window_extent().width <= view.width - self._line:
                return
            box.remove()
            labels.pop()

    def _write(self, x: float, y: float, text: str, colour: str, size: float = LARGE) -> Text:
        """Add text at a place from the upper left corner of the views [pixels]."""
        place = (self._left + x + self._line / 2, self._height - y - self._line / 4)
        return self._figure.text(
            *place, text, transform=IdentityTransform(), va="top", color=colour, fontsize=self._points(size)
        )

    def _points(self, lines: float) -> float:
        return max(6.0, lines * self._line) * 72 / DPI
