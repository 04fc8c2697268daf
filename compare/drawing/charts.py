"""Charts as data, drawn by Matplotlib; a page draws the same data with hover and zoom."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from compare.drawing.figures import Look, add_legend_below, assign_looks, make_figure, use_log_axes, use_style
from nlp_gait.formulation import Array

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

WIDTH_IN, HEIGHT_IN = 7.4, 2.6
ROW_IN = 0.28  # height of a row with a name
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


def plot_charts(charts: Sequence[Chart], columns: int = 2, *, column: bool = False) -> Figure:
    """Plot charts next to each other; the first one alone, in the style's size, for a printed column."""
    shown = charts[:1] if column else charts
    columns = min(columns, len(shown))
    rows = -(-len(shown) // columns)
    height = max((0.8 + ROW_IN * len(chart.rows) for chart in shown if chart.rows), default=HEIGHT_IN)
    with use_style():
        figure = make_figure(None if column else WIDTH_IN, height * rows)
        if shown[0].rows:
            figure.set_figheight(height * rows)
        axes = list(figure.subplots(rows, columns, squeeze=False).flat)
        for axis, chart in zip(axes, shown, strict=False):
            draw_chart(axis, chart)
        for empty in axes[len(shown) :]:
            empty.set_axis_off()
        add_legends(figure, axes, shown)
    return figure


def add_legends(figure: Figure, axes: Sequence[Axes], charts: Sequence[Chart]) -> None:
    """Add a legend below the figure for the first chart with the most solvers, if there are several without named rows."""
    solvers = [count_named(chart) for chart in charts]
    if max(solvers, default=0) > 1:
        add_legend_below(figure, axes[solvers.index(max(solvers))])


def count_named(chart: Chart) -> int:
    """Return how many solvers a legend of the chart has; none if its rows have names."""
    return 0 if chart.rows else len({series.name for series in chart.series})


def assign_chart_looks(chart: Chart) -> dict[str, Look]:
    """Return the look of each solver of a chart."""
    return assign_looks(list(dict.fromkeys(series.name for series in chart.series)))


def draw_chart(axes: Axes, chart: Chart) -> None:
    """Draw a chart into axes."""
    labelled: set[str] = set()
    looks = assign_chart_looks(chart)
    for series in chart.series:
        look = looks[series.name]
        style: dict[str, Any] = {"color": look.colour, "label": "" if series.name in labelled else series.name}
        if series.upper is not None:
            axes.fill_between(series.x, series.y, series.upper, color=look.colour, alpha=0.15, linewidth=0)
            continue
        if series.shape == "points":
            axes.plot(series.x, series.y, look.marker, markerfacecolor="none", alpha=0.8, **style)
        elif series.shape == "step":
            axes.step(series.x, series.y, where="post", linestyle=look.line, **style)
        else:
            axes.plot(series.x, series.y, linestyle="-" if chart.rows else look.line, **style)
        labelled.add(series.name)
    if chart.log[0]:
        use_log_axes(axes, both=chart.log[1])
    if chart.mark is not None:
        axes.axvline(chart.mark, color="#909090", linestyle=":", linewidth=1.0)
    if chart.rows:
        axes.set_yticks(range(len(chart.rows), 0, -1), labels=list(chart.rows))
    if chart.range is not None:
        axes.set_ylim(*chart.range)
    axes.set_xlabel(chart.x)
    axes.set_ylabel(chart.y)


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
