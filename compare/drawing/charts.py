"""Charts as data, and their drawings; a page draws the same data with hover and zoom."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np

from compare.drawing.figures import Look, assign_looks, format_power_of_ten
from compare.drawing.shapes import LETTER, LINE, MARKERS, Drawing, Label, Stroke, place_drawings
from nlp_gait.formulation import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDTH, HEIGHT, ROW = 720, 250, 26  # of a figure, of its charts, and of a named row [pixels]
TOP, RIGHT, BOTTOM, LEFT = 8, 10, 44, 58  # margins of the axes
GRID, LIMIT = "#d0d0d0", "#909090"
DASHES = {"-": "", "--": "6 4", ":": "2 3", "-.": "7 3 2 3"}
SIGNIFICANT_DIGITS = 4


@dataclass(frozen=True, kw_only=True, eq=False)
class Series:
    """Points of one solver."""

    name: str  #: of the solver
    x: Array  #: (N,)
    y: Array  #: (N,); lower end of a band
    upper: Array | None = None  #: (N,) upper end of a band
    shape: Literal["line", "step", "points", "band"] = "line"
    notes: Sequence[str] = ()  #: of each point, which a page shows instead of its numbers


@dataclass(frozen=True, kw_only=True, eq=False)
class Chart:
    """Axes with series; those of one solver have one colour."""

    x: str  #: label with unit
    y: str
    series: Sequence[Series]
    log: tuple[bool, bool] = (False, False)
    rows: Sequence[str] = ()  #: names of y = N, N - 1 ... 1, from the top
    range: tuple[float, float] | None = None  #: of y
    mark: float | None = None  #: x of a vertical line


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
    return draw_charts(charts, columns).to_figure()


def draw_charts(charts: Sequence[Chart], columns: int = 2, width: float = WIDTH) -> Drawing:
    """Draw charts next to each other, with a legend below for the first one with the most solvers."""
    columns = min(columns, len(charts))
    height = max((TOP + BOTTOM + ROW * len(chart.rows) for chart in charts if chart.rows), default=HEIGHT)
    drawn = place_drawings([draw_chart(chart, width / columns, height) for chart in charts], columns)
    return add_legend(drawn, charts)


def _count_named(chart: Chart) -> int:
    """Return how many solvers a legend of the chart has; none if its rows have names."""
    return 0 if chart.rows else len({series.name for series in chart.series})


def assign_chart_looks(chart: Chart) -> dict[str, Look]:
    """Return the look of each solver of a chart."""
    return assign_looks(list(dict.fromkeys(series.name for series in chart.series)))


def draw_chart(chart: Chart, width: float, height: float) -> Drawing:
    """Draw axes with a grid, and the series."""
    left = LETTER * max(map(len, chart.rows)) + LINE if chart.rows else LEFT
    x = ChartAxis(*_find_ends(chart, 0), left, width - RIGHT, chart.log[0])
    y = ChartAxis(*_find_ends(chart, 1), height - BOTTOM, TOP, chart.log[1])
    rows = [(float(y.place(np.array(len(chart.rows) - k))), name) for k, name in enumerate(chart.rows)]
    across, up = _choose_ticks(x, max(3, width / 90)), rows or _choose_ticks(y, 6)
    lines = [np.array([[tick, TOP], [tick, y.start]]) for tick, _ in across]
    lines += [np.array([[left, tick], [width - RIGHT, tick]]) for tick, _ in up]
    shapes: list[Stroke | Label] = [Stroke(lines=lines, colour=GRID)]
    shapes += [Label(x=tick, y=y.start + 15, text=text) for tick, text in across]
    shapes += [Label(x=left - 6, y=tick + 4, text=text, anchor="end") for tick, text in up]
    shapes.append(Label(x=(x.start + x.end) / 2, y=height - 8, text=chart.x))
    shapes.append(Label(x=13, y=(y.start + y.end) / 2, text=chart.y, upwards=True))
    if chart.mark is not None:
        limit = float(x.place(np.array(chart.mark)))
        shapes.append(Stroke(lines=[np.array([[limit, TOP], [limit, y.start]])], colour=LIMIT, dash=DASHES[":"]))
    looks = assign_chart_looks(chart)
    shapes += [shape for one in chart.series for shape in _draw_series(one, looks[one.name], x, y, bool(chart.rows))]
    return Drawing(width=width, height=height, shapes=shapes)


def _draw_series(series: Series, look: Look, x: ChartAxis, y: ChartAxis, solid: bool) -> list[Stroke]:
    points = np.column_stack([x.place(series.x), y.place(series.y)])
    finite = np.isfinite(points).all(axis=1)
    points = points[finite]
    if not len(points):
        return []
    if series.upper is not None:
        upper = np.column_stack([points[:, 0], y.place(series.upper)[finite]])
        return [Stroke(lines=[np.concatenate([points, upper[::-1]])], colour=look.colour, opacity=0.15, filled=True)]
    if series.shape == "points":
        return [Stroke(lines=[MARKERS[look.marker] + point for point in points], colour=look.colour, opacity=0.8)]
    if series.shape == "step":
        points = np.column_stack([np.repeat(points[:, 0], 2)[1:], np.repeat(points[:, 1], 2)[:-1]])
    dash = "" if solid else DASHES[look.line]
    return [Stroke(lines=[points], colour=look.colour, width=2.0, dash=dash)]


def add_legend(drawing: Drawing, charts: Sequence[Chart]) -> Drawing:
    """Add the names of the solvers of the first chart with the most below, if there are several and its rows have none."""
    chart = max(charts, key=_count_named)
    looks: Mapping[str, Look] = assign_chart_looks(chart) if _count_named(chart) > 1 else {}
    left, line = float(LEFT), 0
    shapes = list(drawing.shapes)
    for name, look in looks.items():
        width = 50 + LETTER * len(name)
        if left + width > drawing.width and left > LEFT:
            left, line = float(LEFT), line + 1
        y = drawing.height + LINE * line + 8
        sample = np.array([[left, y], [left + 28, y]])
        shapes.append(Stroke(lines=[sample], colour=look.colour, width=2.0, dash=DASHES[look.line]))
        shapes.append(Label(x=left + 34, y=y + 4, text=name, anchor="start"))
        left += width
    return replace(drawing, height=drawing.height + LINE * (line + 1 if looks else 0), shapes=shapes)


def encode_charts(charts: Sequence[Chart]) -> dict[str, Any]:
    """Return charts as plain data for a page."""
    return {"kind": "charts", "charts": [_encode_chart(chart) for chart in charts]}


def _encode_chart(chart: Chart) -> dict[str, Any]:
    looks = assign_chart_looks(chart)
    series = [
        {
            "name": one.name,
            "colour": looks[one.name].colour,
            "line": "-" if chart.rows else looks[one.name].line,
            "shape": one.shape,
            "points": _encode_points(one),
        }
        for one in chart.series
    ]
    plain = {name: getattr(chart, name) for name in ("x", "y", "log", "rows", "range", "mark")}
    return {**plain, "series": series}


def _encode_points(series: Series) -> list[list[Any]]:
    columns: list[Sequence[Any]] = [round_digits(series.x), round_digits(series.y)]
    if series.upper is not None:
        columns.append(round_digits(series.upper))
    if series.notes:
        columns.append(series.notes)
    return [list(point) for point in zip(*columns, strict=True)]


def round_digits(values: Array, digits: int = SIGNIFICANT_DIGITS) -> list[float | int | None]:
    """Round to significant digits; None for infinite and unknown values."""
    rounded = [float(f"{value:.{digits}g}") if np.isfinite(value) else None for value in values]
    return [int(value) if value is not None and value.is_integer() else value for value in rounded]


def _find_ends(chart: Chart, axis: int) -> tuple[float, float]:
    """Return the ends of the data of x (0) or y (1) with some room, in logarithms where the axis has them."""
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


def _choose_ticks(scale: ChartAxis, most: float) -> list[tuple[float, str]]:
    """Return pixels and words of about so many ticks at most: powers of ten, or multiples of 1, 2 or 5."""
    low, high = scale.low, scale.high
    if scale.log and high - low > 0.8:
        step = max(1, math.ceil((high - low) / most))
        powers = range(math.ceil(low), math.floor(high) + 1, step)
        values, words = [10.0**power for power in powers], [format_power_of_ten(10.0**power) for power in powers]
    else:
        unit = 10.0 ** math.floor(math.log10((high - low) / most))
        step_size = next(k * unit for k in (1, 2, 5, 10) if k * unit >= (high - low) / most)
        multiples = [step_size * k for k in range(math.ceil(low / step_size), math.floor(high / step_size) + 1)]
        values = [10.0**value if scale.log else value for value in multiples]
        words = [f"{value:.3g}" for value in values]
    return list(zip(scale.place(np.array(values)).tolist(), words, strict=True))
