"""Table and picture of prices."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from compare.drawing.figures import new_figure, save, style
from compare.drawing.labels import name_in_words
from compare.questions.prices.price import Price, Prices
from nlp_gait.files import csv_text, write_text

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SHOWN = 10  # bars of each kind
UP, DOWN = "#D55E00", "#0072B2"
# Scales at which most bars read as small numbers.
PREFIXED = {"W": ("mW", 1e3), "J": ("J", 1.0)}


def prices_csv(found: Prices) -> str:
    """All quantities, one row each; slopes are those of the objective and of x* for each unit of the quantity."""
    table: list[Sequence[object]] = []
    names = list(found.x)
    table.append(
        (
            "kind",
            "quantity",
            "unit",
            "value",
            "slope",
            "natural_step",
            "change_per_step",
            "resolved_slope",
            "one_step_less",
        )
        + ("one_step_more", "turns_below", "turns_above", *(f"d_{name}" for name in names))
    )
    for kind, group in (("limit", found.limits), ("robot", found.robot)):
        for price in group:
            steps = price.one_step or (None, None)
            numbers = (price.value, price.slope, price.step, price.per_step, price.resolved, *steps, *price.reach)
            moves = [None if price.x is None else price.x[name] for name in names]
            cells = ("" if value is None else repr(value) for value in (*numbers, *moves))
            table.append((kind, price.name, price.unit, *cells))
    return csv_text(table)


def prices_figure(found: Prices) -> Figure:
    """Bars: what a natural step of each limit costs, and what an error of the robot would change."""
    groups = [group for group in (found.limits, found.robot) if group]
    titles = ("raising a limit", "another robot under the same limits")
    unit, scale = PREFIXED.get(found.unit, (found.unit, 1.0))
    with style():
        height = 1.0 + 0.24 * max(min(SHOWN, len(group)) for group in groups)
        figure = new_figure(3.6 * len(groups), height)
        for axes, group, title in zip(figure.subplots(1, len(groups), squeeze=False)[0], groups, titles, strict=False):
            _bars(axes, group[:SHOWN], scale)
            axes.set_title(title)
            axes.set_xlabel(f"change of {found.objective_name}" + ("" if unit == "1" else f" [{unit}]"))
    return figure


def _bars(axes: Axes, group: Sequence[Price], scale: float) -> None:
    values = [scale * price.per_step for price in group]
    places = range(len(group))
    axes.barh(places, values, color=[UP if value > 0.0 else DOWN for value in values])
    axes.set_yticks(places, [f"{name_in_words(price.name, price.unit)}, {price.words}" for price in group])
    axes.invert_yaxis()
    axes.axvline(0.0, color="0.3", linewidth=0.6)
    axes.grid(visible=False, axis="y")


def write_prices(folder: Path, found: Prices) -> list[Path]:
    """Write table and picture; returns their paths."""
    stem = folder / f"{found.problem}-prices"
    table = stem.with_name(f"{stem.name}.csv")
    write_text(table, prices_csv(found))
    return [table, *save(prices_figure(found), stem)] if found.limits or found.robot else [table]
