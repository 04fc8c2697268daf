"""Prices as an answer: tables and picture."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import asdict

from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing

from compare.analysis.units import heading, with_unit
from compare.drawing.figures import new_figure, style
from compare.drawing.labels import name_in_words
from compare.questions.answer import Answer, all_digits
from compare.questions.prices.price import Price, Prices
from compare.report.document import Figure, Part, Table, Value, text_table
from nlp_gait.formulation import GaitProblem

SHOWN = 10  # bars of each kind
LISTED = 12  # rows of the robot's table; all are in the CSV file
UP, DOWN = "#D55E00", "#0072B2"
# Scales at which most bars read as small numbers.
PREFIXED = {"W": ("mW", 1e3), "J": ("J", 1.0)}


def prices_answer(found: Prices, problem: GaitProblem) -> Answer:
    """What holds the optimum back, and which error of the robot would change it most."""
    ranges = problem.by_name(problem.scale)
    stem, optimum = f"{found.problem}-prices", with_unit(found.objective, found.unit)
    parts: list[Part] = []
    if found.limits:
        title = "What holds it back: change of the optimum for one step upwards of a limit or coefficient"
        parts.append(text_table(_header(found), [_row(price, ranges) for price in found.limits], title))
    parts.append(f"{found.free} other parameters cost nothing here")
    if found.robot:
        title = (
            f"Which error of the robot would change it most, limits as they are (first {LISTED} of {len(found.robot)})"
        )
        parts.append(text_table(_header(found), [_row(price, ranges) for price in found.robot[:LISTED]], title))
    parts.append(
        f"First-order conditions hold to {found.residual:.1e}; {found.dependent} of the active rows follow from others. "
        "x* moves along a line only as far as the last column says: beyond it, another kink or limit takes over."
    )
    parts.append(
        "The slope is the derivative of the optimum with respect to the quantity, from the multipliers; beside it, what solving "
        "again one step lower and one step higher gives. The line is the straight line on which x* moves, in steps of the "
        "quantity; dbm is the dynamic balance margin, the distance of the zero-moment point from the edge of the soles."
    )
    if found.weak:
        parts.append(f"Held without a price, so that derivatives may differ on both sides: {', '.join(found.weak)}")
    if found.limits or found.robot:
        shown = "What one natural step of each limit costs, and what an error of the robot would change."
        parts.append(Figure(name=stem, caption=shown, drawing=prices_figure(found)))
    parts.append(_numbers(stem, found))
    return Answer(
        stem=stem,
        title=f"{found.problem}: what each limit costs",
        verdict=(f"{found.objective_name} {optimum}, to {found.sense}",),
        parts=parts,
        data=asdict(found),
    )


def _header(found: Prices) -> tuple[str, ...]:
    steps = (heading(words, found.unit) for words in ("by the slope", "- step", "+ step"))
    return ("quantity", "step", *steps, "error of slope, x*", "x* moves most in", "line [steps]")


def _row(price: Price, ranges: Mapping[str, float]) -> tuple[str, ...]:
    furthest = price.furthest(ranges)
    moves = "no derivative" if price.x is None else "-" if furthest is None else f"{furthest[0]} {furthest[1]:+.3g}"
    down, up = (value / price.step for value in price.reach)
    steps = ("-", "-") if price.one_step is None else ("none" if v is None else f"{v:+z.5f}" for v in price.one_step)
    line = f"{down:+.2g} to {up:+.2g}"
    return (price.name, price.words, f"{price.per_step:+z.5f}", *steps, _agreement(price), moves, line)


def _agreement(price: Price) -> str:
    """Relative difference of the slope of the optimum, and of x*, from what solving again gives."""
    if price.one_step is None:
        return "-"
    return ", ".join("-" if error is None else f"{error:.0e}" for error in (price.error, price.x_error))


def _numbers(stem: str, found: Prices) -> Table:
    """All quantities; slopes are those of the objective and of x* for each unit of the quantity."""
    header = [
        *("kind", "quantity", "unit", "value", "slope", "choose_natural_step", "change_per_step", "resolved_slope"),
        *("one_step_less", "one_step_more", "turns_below", "turns_above", *(f"d_{name}" for name in found.x)),
    ]
    rows: list[list[Value]] = [
        [
            *(kind, price.name, price.unit, price.value, price.slope, price.step, price.per_step, price.resolved),
            *(price.one_step or (None, None)),
            *price.reach,
            *(None if price.x is None else price.x[name] for name in found.x),
        ]
        for kind, group in (("limit", found.limits), ("robot", found.robot))
        for price in group
    ]
    return all_digits(stem, header, rows)


def prices_figure(found: Prices) -> Drawing:
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
            axes.set_xlabel(heading(f"change of {found.objective_name}", unit))
    return figure


def _bars(axes: Axes, group: Sequence[Price], scale: float) -> None:
    values = [scale * price.per_step for price in group]
    places = range(len(group))
    axes.barh(places, values, color=[UP if value > 0.0 else DOWN for value in values])
    axes.set_yticks(places, [f"{name_in_words(price.name, price.unit)}, {price.words}" for price in group])
    axes.invert_yaxis()
    axes.axvline(0.0, color="0.3", linewidth=0.6)
    axes.grid(visible=False, axis="y")
