"""Charts as data, and their drawings: the same for a page (SVG) and for a paper (PNG, PDF)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from compare.drawing.figures import Look, assign_looks, format_power_of_ten
from compare.drawing.shapes import CIRCLE, LETTER, LINE, Drawing, Label, Stroke, draw_legend, place_drawings
from nlp_gait.formulation import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDTH, HEIGHT = 400, 250  # of a chart [pixels]
ROWS_WIDTH, ROW = 440, 22  # of a chart with named rows, and height of a row
TOP, RIGHT, BOTTOM, LEFT = 8, 10, 40, 62  # margins of the axes
GRID = "#d0d0d0"
DASHES = {"-": "", "--": "6 4", ":": "2 3", "-.": "7 3 2 3"}
FACTORS = (1, 2, 5)  # of powers of ten, at ticks


@dataclass(frozen=True, kw_only=True, eq=False)
class Series:
    """Points of one solver."""

    name: str  #: of the solver
    x: Array  #: (N,)
    y: Array  #: (N,); lower end of a band
    upper: Array | None = None  #: (N,) upper end of a band
    shape: Literal["line", "step", "points", "band"] = "line"
    notes: Sequence[str] = ()  #: of each point, which a page shows at the pointer


@dataclass(frozen=True, kw_only=True, eq=False)
class Chart:
    """Axes with series; those of one solver have one colour."""

    x: str  #: label with unit
    y: str
    series: Sequence[Series]
    log: tuple[bool, bool] = (False, False)
    #: Names of y = N, N - 1 ... 1, from the top, each with a note, which stands to the right of its row
    rows: Sequence[tuple[str, str]] = ()
    range: tuple[float, float] | None = None  #: of y
    is_time: bool = False  #: whether a page shows the time of the gait that it plays


class ChartAxis(NamedTuple):
    """A linear or logarithmic axis: the ends of the data, in logarithms where it has them, and of the axis in pixels."""

    low: float
    high: float
    start: float
    end: float
    log: bool

    def place(self, values: Array) -> Array:
        """Return the pixels of values."""
        data = np.log10(np.maximum(values, 1e-300)) if self.log else values
        return self.start + (data - self.low) / (self.high - self.low) * (self.end - self.start)


def plot_charts(charts: Sequence[Chart], columns: int = 2) -> Figure:
    """Plot charts next to each other."""
    return place_drawings([draw_chart(chart) for chart in charts], columns).to_figure()


def draw_chart(chart: Chart, width: float = WIDTH, height: float = HEIGHT) -> Drawing:
    """Draw axes with a grid, the series, and their names below if there are several and the rows have none."""
    left, right, top = float(LEFT), float(RIGHT), float(TOP)
    if chart.rows:
        width, height = ROWS_WIDTH if width == WIDTH else width, TOP + BOTTOM + ROW * len(chart.rows)
        left, right = (LETTER * max(map(len, words)) + LINE for words in zip(*chart.rows, strict=True))
    x = ChartAxis(*_find_ends(chart, 0), left, width - right, chart.log[0])
    y = ChartAxis(*_find_ends(chart, 1), height - BOTTOM, top, chart.log[1])
    places = y.place(np.arange(len(chart.rows), 0.0, -1.0)).tolist()
    across = _choose_ticks(x, max(3, (x.end - left) / 60))
    up = list(zip(places, (name for name, _ in chart.rows), strict=True)) or _choose_ticks(y, 6)
    lines = [np.array([[tick, top], [tick, y.start]]) for tick, _ in across]
    lines += [np.array([[left, tick], [x.end, tick]]) for tick, _ in up]
    shapes: list[Stroke | Label] = [Stroke(lines=lines, colour=GRID)]
    shapes += [Label(x=tick, y=y.start + 15, text=text) for tick, text in across]
    shapes += [Label(x=left - 6, y=tick + 4, text=text, anchor="end") for tick, text in up]
    notes = zip(places, (note for _, note in chart.rows), strict=True)
    shapes += [Label(x=x.end + 8, y=place + 4, text=note, anchor="start") for place, note in notes if note]
    shapes.append(Label(x=max((x.start + x.end) / 2, LETTER * len(chart.x) / 2), y=height - 6, text=chart.x))
    if chart.y:
        shapes.append(Label(x=13, y=(y.start + y.end) / 2, text=chart.y, upwards=True))
    looks = assign_looks(list(dict.fromkeys(series.name for series in chart.series)))
    shapes += [shape for one in chart.series for shape in _draw_series(one, looks[one.name], x, y, bool(chart.rows))]
    if not chart.rows and len(looks) > 1:
        entries = [(name, look.colour, DASHES[look.line]) for name, look in looks.items()]
        legend, more = draw_legend(entries, left, height, width)
        shapes, height = [*shapes, *legend], height + more
    time = (x.start, x.end, x.low, x.high) if chart.is_time else None
    return Drawing(width=width, height=height, shapes=shapes, time=time)


def _draw_series(series: Series, look: Look, x: ChartAxis, y: ChartAxis, solid: bool) -> list[Stroke]:
    points = np.column_stack([x.place(series.x), y.place(series.y)])
    finite = np.isfinite(points[:, 0] + points[:, 1])
    if not finite.any():
        return []
    if series.shape == "points":
        notes = [*series.notes] or [
            f"{series.name}: {b:.4g} at {a:.4g}" for a, b in zip(series.x, series.y, strict=True)
        ]
        marks = [(CIRCLE + point, note) for point, note, ok in zip(points, notes, finite, strict=True) if ok]
        return [Stroke(lines=[mark], colour=look.colour, opacity=0.8, note=note) for mark, note in marks]
    points = points[finite]
    if series.upper is not None:
        upper = np.column_stack([points[:, 0], y.place(series.upper)[finite]])
        return [Stroke(lines=[np.concatenate([points, upper[::-1]])], colour=look.colour, opacity=0.15, filled=True)]
    if series.shape == "step":
        points = np.column_stack([np.repeat(points[:, 0], 2)[1:], np.repeat(points[:, 1], 2)[:-1]])
    dash = "" if solid else DASHES[look.line]
    return [Stroke(lines=[points], colour=look.colour, width=2.0, dash=dash, note=series.name)]


def _find_ends(chart: Chart, axis: int) -> tuple[float, float]:
    """Return the ends of the data of x (0) or y (1) with some room, in logarithms where the axis has them."""
    if axis and chart.rows:
        return 0.4, len(chart.rows) + 0.6
    if axis and chart.range is not None:
        return chart.range
    columns = [column for s in chart.series for column in ((s.y, s.upper) if axis else (s.x,)) if column is not None]
    values = np.concatenate([np.ravel(column) for column in columns]) if columns else np.array([])
    values = values[np.isfinite(values) & (values > 0.0 if chart.log[axis] else True)]
    if not values.size:
        return 0.0, 1.0
    data = np.log10(values) if chart.log[axis] else values
    low, high = float(data.min()), float(data.max())
    room = 0.03 * (high - low) or 0.5 * (1.0 if chart.log[axis] else abs(high) or 1.0)
    return low - room, high + room


def _choose_ticks(axis: ChartAxis, most: float) -> list[tuple[float, str]]:
    """Return pixels and words of about so many ticks at most, all of one kind: powers of ten, or plain numbers."""
    low, high = axis.low, axis.high
    powers = range(math.ceil(low), math.floor(high) + 1) if axis.log else range(0)
    if len(powers) > 1:
        values = [10.0**power for power in powers[:: math.ceil(len(powers) / most)]]
        words = [format_power_of_ten(value) for value in values]
    else:
        decades = range(math.floor(low), math.ceil(high)) if axis.log else range(0)
        values = [k * 10.0**decade for decade in decades for k in FACTORS if low <= decade + math.log10(k) <= high]
        if len(values) < 2:  # on a logarithmic axis that is as short as a linear one
            least, largest = (10.0**low, 10.0**high) if axis.log else (low, high)
            unit = 10.0 ** math.floor(math.log10((largest - least) / most))
            step = next(k * unit for k in (*FACTORS, 10) if k * unit >= (largest - least) / most)
            values = [step * k for k in range(math.ceil(least / step), math.floor(largest / step) + 1)]
        words = [f"{value:.6g}" for value in values]
    return list(zip(axis.place(np.array(values)).tolist(), words, strict=True))
