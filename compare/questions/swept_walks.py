"""Points of a sweep; of walking cycles among them the cost of transport."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing

from compare.analysis.units import list_units, make_axis_label, name_in_words
from compare.drawing.figures import make_figure, use_style
from compare.questions.question import make_table
from compare.report.document import Figure, Part
from nlp_gait.formulation import GaitProblem

MODEL = "#000000"
PHASE_COLOURS = ("#0072B2", "#D55E00")
COST = "cost_of_transport"  # index that only walking cycles have


@dataclass(frozen=True, kw_only=True)
class SweepPoint:
    """Result at one point of the grid."""

    at: Mapping[str, float]  #: value of each axis
    objective: float  #: exact value, in the problem's sense
    feasible: bool  #: a feasible optimum was found
    status: str  #: in words; without a feasible point it names the violated constraints
    x: Mapping[str, float]  #: by variable name
    violation: float  #: exact total violation
    evaluations: int  #: calls of f
    time_s: float  #: wall time [s]
    indexes: Mapping[str, float] = field(default_factory=dict)  #: exact performance indexes


def report_walks(problem: GaitProblem, points: Sequence[SweepPoint]) -> list[Part]:
    """Return tables and figure of the feasible cycles; nothing for problems without a cost of transport."""
    feasible = [point for point in points if point.feasible]
    if not any(COST in point.indexes for point in feasible):
        return []
    axes = tuple(points[0].at)
    columns: dict[str, Callable[[SweepPoint], str]] = {
        ", ".join(axes): _format_place,
        "power": lambda point: f"{point.indexes['power_W']:.4f} W",
        "cost of transport": lambda point: f"{point.indexes[COST]:.4f}",
        "step": lambda point: f"{point.indexes['step_length_m']:.4f} m",
        **{_name_phase(time): partial(_format_duration, time) for time in problem.display.durations},
    }
    parts: list[Part] = [make_table("Cheapest cycles, with the durations of their phases", feasible, columns)]
    if len(axes) == 1:
        caption = "Cost of transport, step and durations; crosses where no feasible cycle was found."
        parts.append(Figure(name=f"{problem.name}-cost", caption=caption, drawing=plot_costs(points, problem)))
    return parts


def _format_place(point: SweepPoint) -> str:
    return ", ".join(f"{value:g}" for value in point.at.values())


def _format_duration(name: str, point: SweepPoint) -> str:
    return f"{point.x[name]:.3f} s"


def _name_phase(time: str) -> str:
    """Return for example "single support"."""
    return name_in_words(time, "s").removesuffix(" time")


def plot_costs(points: Sequence[SweepPoint], problem: GaitProblem) -> Drawing:
    """Plot cost of transport, step length and durations along the only axis; infeasible points as crosses."""
    (name,) = points[0].at
    good = [point for point in points if point.feasible]
    places = [point.at[name] for point in good]
    with use_style():
        figure = make_figure(6.3, 5.0)
        cost, lengths, times = figure.subplots(3, 1, sharex=True, height_ratios=(2, 1, 1))
        cost.plot(places, [point.indexes[COST] for point in good], "o-", color=MODEL, label="optimum")
        mark_values(cost, [point.at[name] for point in points if not point.feasible], "infeasible")
        cost.set(ylabel="cost of transport\nP / (m g v)")
        cost.legend()
        lengths.plot(places, [1000.0 * point.indexes["step_length_m"] for point in good], "o-", color=MODEL)
        lengths.set(ylabel="step\n[mm]")
        for time, colour in zip(problem.display.durations, PHASE_COLOURS, strict=False):
            times.plot(places, [point.x[time] for point in good], "o-", color=colour, label=_name_phase(time))
        times.set(ylabel="time [s]", xlabel=make_axis_label(name, list_units(problem)[name]))
        times.legend(ncols=2)
        for axes in (cost, lengths, times):
            axes.set_ylim(bottom=0.0)
    return figure


def mark_values(axes: Axes, values: Sequence[float], label: str) -> None:
    """Mark values of x near the lower end of the axes."""
    if values:
        axes.plot(values, [0.03] * len(values), "x", color="0.4", label=label, transform=axes.get_xaxis_transform())
