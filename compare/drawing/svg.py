"""Charts and poses as the text of an SVG file: what a page shows and prints, in a hundredth of Matplotlib's time.

Ink is ``INK``, a grid ``GRID``; ``inline_svg`` gives both the colours of a page.
"""

import math
from collections.abc import Iterable, Mapping, Sequence
from html import escape
from typing import NamedTuple

import numpy as np

from compare.drawing.animation import GROUND, MARGIN
from compare.drawing.charts import Chart, Series, assign_chart_looks, count_named
from compare.drawing.figures import INK, Look, format_power_of_ten
from nlp_gait.formulation import Array
from nlp_gait.formulation.display import Skeleton

WIDTH, HEIGHT, ROW = 720, 250, 26  # of a figure, of its charts, and of a named row [pixels]
LETTER, LINE = 6.2, 18  # width of a letter, and height of a line of text
TOP, RIGHT, BOTTOM, LEFT = 8, 10, 44, 58  # margins of the axes
GRID = "#d0d0d0"
DASHES = {"-": "", "--": "6 4", ":": "2 3", "-.": "7 3 2 3"}
MARKERS = {
    "o": "m-3 0a3 3 0 1 0 6 0a3 3 0 1 0-6 0",
    "s": "m-3-3h6v6h-6z",
    "^": "m0-3.4l3.2 5.8h-6.4z",
    "D": "m0-3.6l3.6 3.6l-3.6 3.6l-3.6-3.6z",
}


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


def draw_charts(charts: Sequence[Chart], columns: int = 2) -> str:
    """Return charts next to each other, with a legend below for the first one with the most solvers."""
    columns = min(columns, len(charts))
    width = WIDTH / columns
    height = max((TOP + BOTTOM + ROW * len(chart.rows) for chart in charts if chart.rows), default=HEIGHT)
    body = [
        f'<g transform="translate({width * (k % columns):g} {height * (k // columns):g})">{_draw(chart, width, height)}</g>'
        for k, chart in enumerate(charts)
    ]
    below = height * -(-len(charts) // columns)
    legend, lines = _draw_legend(max(charts, key=count_named), below)
    return _wrap([*body, legend], WIDTH, below + LINE * lines)


def draw_poses(name: str, first: Skeleton, over: tuple[str, Skeleton, Look] | None, count: int) -> str:
    """Return poses of a gait from the side, later ones darker, and some of another gait dashed over it."""
    low, high = first.box()
    size = high - low + 2 * MARGIN
    scale = min((WIDTH / 2 - 2 * RIGHT) / float(size[0]), HEIGHT / float(size[2]))
    left, bottom = (WIDTH / 2 - scale * float(size[0])) / 2, TOP + LINE + scale * float(size[2])

    def trace(points: Array, style: str) -> str:
        x = left + scale * (points[:, 0] - low[0] + MARGIN)
        return f'<path d="{_join(x, bottom - scale * (points[:, 2] - low[2] + MARGIN))}" {style}/>'

    ground = np.column_stack([first.ground[:, 0], np.zeros(len(first.ground)), first.ground[:, 1]])
    body = [trace(ground, f'stroke="{GROUND}"')]
    chosen = np.unique(np.linspace(0, len(first.t) - 1, count).round().astype(int)).tolist()
    for k, opacity in zip(chosen, np.linspace(0.25, 1.0, len(chosen)).tolist(), strict=True):
        for part, width in [(limb.points, 1.5) for limb in first.limbs] + [(sole.corners, 2.4) for sole in first.soles]:
            body.append(trace(part[k], f'stroke="{INK}" stroke-width="{width}" opacity="{opacity:.2g}"'))
    title = name
    if over is not None:
        other, skeleton, look = over
        title = f"{name}, and {other} dashed"
        for k in (0, len(skeleton.t) // 2, -1):
            style = f'stroke="{look.colour}" stroke-dasharray="5 3"'
            body += [trace(limb.points[k], style) for limb in skeleton.limbs]
    return _wrap([_write(WIDTH / 4, TOP + 10, title), f'<g fill="none">{"".join(body)}</g>'], WIDTH / 2, bottom + TOP)


def _wrap(parts: Iterable[str], width: float, height: float) -> str:
    view = f'xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width:g} {height:.0f}"'
    return f'<svg {view} font-family="sans-serif" font-size="12">\n{chr(10).join(parts)}\n</svg>\n'


def _draw(chart: Chart, width: float, height: float) -> str:
    left = LETTER * max(map(len, chart.rows)) + LINE if chart.rows else LEFT
    x = ChartAxis(*_find_ends(chart, 0), left, width - RIGHT, chart.log[0])
    y = ChartAxis(*_find_ends(chart, 1), height - BOTTOM, TOP, chart.log[1])
    rows = {len(chart.rows) - k: name for k, name in enumerate(chart.rows)}
    lines, words = [], []
    for at, text in _choose_ticks(x, max(3, width / 90)):
        lines.append(f"M{at:.1f} {TOP}V{y.start:.1f}")
        words.append(_write(at, y.start + 15, text))
    for at, text in [(float(y.place(np.array(k))), name) for k, name in rows.items()] or _choose_ticks(y, 6):
        lines.append(f"M{left:.1f} {at:.1f}H{width - RIGHT:.1f}")
        words.append(_write(left - 6, at + 4, text, "end"))
    words.append(_write((x.start + x.end) / 2, height - 8, chart.x))
    middle = f'transform="translate(13 {(y.start + y.end) / 2:.1f}) rotate(-90)"'
    words.append(f'<text text-anchor="middle" {middle}>{escape(chart.y)}</text>')
    mark = ""
    if chart.mark is not None:
        at = float(x.place(np.array(chart.mark)))
        mark = f'<path d="M{at:.1f} {TOP}V{y.start:.1f}" stroke="#909090" stroke-dasharray="2 3"/>'
    looks = assign_chart_looks(chart)
    series = "".join(_draw_series(one, looks[one.name], x, y, bool(chart.rows)) for one in chart.series)
    return f'<path d="{"".join(lines)}" stroke="{GRID}"/>{"".join(words)}<g fill="none">{mark}{series}</g>'


def _draw_series(series: Series, look: Look, x: ChartAxis, y: ChartAxis, solid: bool) -> str:
    across, up = x.place(series.x), y.place(series.y)
    known = np.isfinite(across) & np.isfinite(up)
    across, up = across[known], up[known]
    if not len(across):
        return ""
    if series.upper is not None:
        upper = y.place(series.upper)[known]
        path = _join(np.append(across, across[::-1]), np.append(up, upper[::-1]))
        return f'<path d="{path}Z" fill="{look.colour}" opacity="0.15"/>'
    if series.shape == "points":
        path = "".join(f"M{a:.1f} {b:.1f}{MARKERS[look.marker]}" for a, b in zip(across, up, strict=True))
        return f'<path d="{path}" stroke="{look.colour}" opacity="0.8"/>'
    if series.shape == "step":
        across, up = np.repeat(across, 2)[1:], np.repeat(up, 2)[:-1]
    dash = "" if solid or not DASHES[look.line] else f' stroke-dasharray="{DASHES[look.line]}"'
    return f'<path d="{_join(across, up)}" stroke="{look.colour}" stroke-width="2"{dash}/>'


def _draw_legend(chart: Chart, top: float) -> tuple[str, int]:
    """Return the legend, and the number of its lines; none for rows with names and for one solver."""
    looks: Mapping[str, Look] = assign_chart_looks(chart) if count_named(chart) > 1 else {}
    left, line, parts = float(LEFT), 0, []
    for name, look in looks.items():
        width = 36 + LETTER * len(name) + 14
        if left + width > WIDTH and left > LEFT:
            left, line = float(LEFT), line + 1
        y = top + LINE * line + 8
        dash = f' stroke-dasharray="{DASHES[look.line]}"' if DASHES[look.line] else ""
        parts.append(f'<path d="M{left:.1f} {y:.1f}h28" stroke="{look.colour}" stroke-width="2"{dash}/>')
        parts.append(_write(left + 34, y + 4, name, "start"))
        left += width
    return "".join(parts), line + 1 if looks else 0


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


def _join(x: Array, y: Array) -> str:
    return "M" + "L".join(f"{a:.1f} {b:.1f}" for a, b in zip(x.tolist(), y.tolist(), strict=True))


def _write(x: float, y: float, text: str, anchor: str = "middle") -> str:
    return f'<text x="{x:.1f}" y="{y:.1f}" text-anchor="{anchor}">{escape(text)}</text>'
