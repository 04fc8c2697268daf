"""Charts as data, and their drawings: the same for a page (SVG) and for a paper (PNG, PDF); those of a comparison."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, NamedTuple

import numpy as np

from compare.analysis.comparison import SMALLEST_GAP, Comparison, SolverRuns, index_solvers
from compare.analysis.record_statistics import ECDF_TARGETS, compute_band, compute_ecdf
from compare.drawing.figures import (
    CIRCLE,
    LETTER,
    LINE,
    Drawing,
    Label,
    Look,
    Stroke,
    assign_looks,
    draw_legend,
    format_power_of_ten,
    place_drawings,
)
from nlp_gait.formulation import Array

if TYPE_CHECKING:
    from matplotlib.figure import Figure

WIDTH, HEIGHT = 400, 250  # of a chart [pixels]
ROWS_WIDTH, ROW = 440, 22  # of a chart with named rows, and height of a row
TOP, RIGHT, BOTTOM, LEFT = 8, 10, 40, 62  # margins of the axes
GRID = "#d0d0d0"
DASHES = {"-": "", "--": "6 4", ":": "2 3", "-.": "7 3 2 3"}
LARGEST_GAP = 1e300  # that is drawn
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


GRID_POINTS = 120
AXES = {"evaluations": "equivalent evaluations", "seconds": "seconds of the solve"}
GAP = "gap to best known [%]"


def make_final_gap_charts(comparison: Comparison) -> list[Chart]:
    """Return the final gap of each run, one row per solver, and its median as a bar."""
    series, rows = [], []
    for height, solver in zip(range(len(comparison.solvers), 0, -1), comparison.solvers, strict=True):
        gaps = [comparison.gap(cost) for cost in solver.costs]
        shown = [(run, gap) for run, gap in enumerate(gaps) if np.isfinite(gap)]
        notes = [f"{solver.title}, run {run}: {comparison.format_gap(gap)}" for run, gap in shown]
        x, y = clip_percent(np.array([gap for _, gap in shown])), np.full(len(shown), float(height))
        series.append(Series(name=solver.title, x=x, y=y, shape="points", notes=notes))
        if np.isfinite(middle := comparison.gap(solver.median_cost)):
            bar = clip_percent(np.array([middle, middle]))
            series.append(Series(name=solver.title, x=bar, y=np.array([height - 0.35, height + 0.35])))
        rows.append((solver.title, _describe_row(comparison, solver, middle)))
    return [Chart(x="gap to best known [%], bar: median", y="", series=series, log=(True, False), rows=rows)]


def _describe_row(comparison: Comparison, solver: SolverRuns, gap: float) -> str:
    """Return the median gap, and how many runs reach the best known value, or are feasible if not all are."""
    runs, feasible = len(solver.records), len(solver.feasible)
    if feasible < runs:
        return f"{comparison.format_gap(gap)}, {feasible} of {runs} feasible" if feasible else "infeasible"
    return f"{comparison.format_gap(gap)}, {comparison.count_reached(solver)} of {runs} reach it"


def make_convergence_charts(comparison: Comparison) -> list[Chart]:
    """Return bands from the least to the greatest gap of all runs, with the median, over evaluations and over seconds.

    A line begins where half of the runs are feasible, a band where all are. A run of a gradient method is a point at its end.
    """
    charts = []
    for axis, words in AXES.items():
        series = [s for solver in comparison.solvers if solver.has_costs(axis) for s in _trace_gaps(solver, axis)]
        charts += [Chart(x=words, y=GAP, series=series, log=(True, True))] if series else []
    return charts


def _trace_gaps(solver: SolverRuns, axis: str) -> list[Series]:
    costs = [getattr(curve, axis) for curve in solver.curves]
    if all(len(curve.gap) <= 1 for curve in solver.curves):
        ends = [(cost[-1], c.gap[-1]) for cost, c in zip(costs, solver.curves, strict=True) if len(cost)]
        x, gap = np.array([end for end in ends if np.isfinite(end[1])]).reshape(-1, 2).T
        return [Series(name=solver.title, x=x, y=clip_percent(gap), shape="points")]
    used = np.concatenate(costs)
    used = used[used > 0.0]
    if not used.size:
        return []
    grid = np.geomspace(used.min(), used.max(), GRID_POINTS)
    low, middle, high = compute_band(costs, [np.minimum.accumulate(curve.gap) for curve in solver.curves], grid)
    finite, whole = np.isfinite(middle), np.isfinite(high)
    upper = clip_percent(high[whole])
    return [
        Series(name=solver.title, x=grid[whole], y=clip_percent(low[whole]), upper=upper, shape="band"),
        Series(name=solver.title, x=grid[finite], y=clip_percent(middle[finite])),
    ]


def clip_percent(gap: Array) -> Array:
    """Return the gap in percent; those beyond ``SMALLEST_GAP`` and ``LARGEST_GAP`` are drawn at them."""
    return np.clip(gap, SMALLEST_GAP, LARGEST_GAP) * 100.0


def make_ecdf_charts(comparisons: Sequence[Comparison], *, per_variable: bool = False) -> list[Chart]:
    """Return the share of problems, runs and targets solved within evaluations; of solvers that ran on all problems."""
    solvers, shared = index_solvers(comparisons)
    series, last = [], 1.0
    for name in shared:
        runs = [
            (curve, len(s[name].records[0].x) or 1 if per_variable else 1)
            for s in solvers
            if s[name].has_costs("evaluations")
            for curve in s[name].curves
        ]
        costs, share = compute_ecdf(np.array([c.cost_to_reach(target) / n for c, n in runs for target in ECDF_TARGETS]))
        last = max([last, *(curve.total_cost() / n for curve, n in runs)])
        series.append((solvers[0][name].title, costs, share))
    series.sort(key=lambda one: -one[2][-1] if one[2].size else 0.0)
    ends = [(np.append(costs, last), np.append(share, share[-1:])) for _, costs, share in series if share.size]
    names = [name for name, _, share in series if share.size]
    words = "equivalent evaluations per variable" if per_variable else AXES["evaluations"]
    steps = [Series(name=name, x=x, y=y, shape="step") for name, (x, y) in zip(names, ends, strict=True)]
    y = "share of problems, runs and targets" if len(comparisons) > 1 else "share of runs and targets"
    return [Chart(x=words, y=y, series=steps, log=(True, False), range=(0.0, 1.02))]
