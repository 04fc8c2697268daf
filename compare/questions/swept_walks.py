"""Points of a sweep; of walking cycles among them the cost of transport, and their simulation in the engine."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

from matplotlib.axes import Axes
from matplotlib.figure import Figure as Drawing

from compare.analysis.units import format_millimetres, list_units, make_axis_label, name_in_words, with_unit
from compare.drawing.figures import make_figure, use_style
from compare.questions.question import Work, make_table
from compare.report.document import Figure, Part
from nlp_gait.backends.identity import identify_problem
from nlp_gait.errors import InputError
from nlp_gait.formulation import GaitProblem, Result
from nlp_gait.simulation.drive import Drive
from nlp_gait.simulation.measurements import Walk, measure_walk
from nlp_gait.simulation.plan import make_plan
from nlp_gait.simulation.simulate import simulate_plan

MODEL, ENGINE, FALLS = "#000000", "#56B4E9", "#D55E00"
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
    walk: Walk | None = None  #: of the gait in the engine; None without a simulation

    def to_row(self) -> dict[str, Any]:
        """Return the cells of a table, with the main numbers of the simulation."""
        row = {name: value for name, value in vars(self).items() if name != "walk"}
        if self.walk is not None:
            numbers = self.walk.measurements
            power = {"mechanical_W": numbers.measured.mechanical_W, "heat_W": numbers.measured.heat_W}
            row["engine"] = {**self.walk.course(), "largest_tilt_deg": numbers.largest_tilt_deg, **power}
        return row


def check_cycle(problem: GaitProblem) -> None:
    """Raise InputError for a problem that is not a walking cycle."""
    model = problem.display.simulation_model
    if model is None or not model.repeats:
        raise InputError(f"--engine simulates steps of walking cycles, such as nao-cycle; {problem.name!r} is not one")


def simulate_walk(result: Result, steps: int, work: Work) -> Walk:
    """Simulate so many steps of a gait in open loop; raises MissingExtraError without MuJoCo."""
    inputs = {**identify_problem(result.problem), "x": result.x.tolist(), "steps": steps, "drive": repr(Drive())}
    return work.compute(Walk, "walk", inputs, partial(_simulate_walk, result, steps))


def _simulate_walk(result: Result, steps: int) -> Walk:
    plan = make_plan(result, steps)
    return measure_walk(plan, simulate_plan(plan), Drive(), steps)


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
    parts += _report_simulations(", ".join(axes), feasible)
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


def _report_simulations(axes: str, points: Sequence[SweepPoint]) -> list[Part]:
    """Table of the simulated gaits, and how well they confirm the model."""
    walks = [(_format_place(point), point.walk) for point in points if point.walk is not None]
    if not walks:
        return []
    columns: Mapping[str, Callable[[tuple[str, Walk]], str]] = {
        axes: lambda row: row[0],
        "model": lambda row: with_unit(row[1].model_J_per_m, "J/m", ".2f"),
        "engine": lambda row: with_unit(row[1].engine_J_per_planned_m, "J/m", ".2f"),
        "error": lambda row: _format_error(row[1]),
        "walked": lambda row: format_millimetres(row[1].walked_m, ".0f"),
        "of": lambda row: format_millimetres(row[1].planned_m, ".0f"),
        "drift": lambda row: format_millimetres(row[1].drift_m),
        "end": lambda row: _describe_end(row[1]),
    }
    title = f"Energy of {walks[0][1].steps} steps in the engine, for each planned metre, and their course"
    pairs = [(walk.model_J_per_m, walk.engine_J_per_planned_m) for _, walk in walks]
    errors = [100.0 * abs(engine / model - 1.0) for model, engine in pairs if engine is not None]
    text = f"{len(walks)} gaits were simulated, {len(walks) - len(errors)} fell."
    if errors:
        text += f" Error of the model: {sum(errors) / len(errors):.2f} % mean, {max(errors):.2f} % at most."
    return [make_table(title, walks, columns), text]


def _format_error(walk: Walk) -> str:
    if walk.engine_J_per_planned_m is None:
        return "-"
    return f"{100.0 * (walk.engine_J_per_planned_m / walk.model_J_per_m - 1.0):+z.2f} %"


def _describe_end(walk: Walk) -> str:
    fell_at_s = walk.measurements.fell_at_s
    end = "walks" if fell_at_s is None else f"falls at {fell_at_s:.2f} s"
    return end if walk.steps_done == walk.steps else f"{end}, {walk.steps_done} steps"


def plot_costs(points: Sequence[SweepPoint], problem: GaitProblem) -> Drawing:
    """Plot cost of transport, step length and durations along the only axis; infeasible points as crosses."""
    (name,) = points[0].at
    good = [point for point in points if point.feasible]
    places = [point.at[name] for point in good]
    with use_style():
        figure = make_figure(6.3, 5.0)
        cost, lengths, times = figure.subplots(3, 1, sharex=True, height_ratios=(2, 1, 1))
        cost.plot(places, [point.indexes[COST] for point in good], "o-", color=MODEL, label="model")
        walks = [(point, point.walk) for point in good if point.walk is not None]
        covered = [  # energy over the distance that was really covered
            (point.at[name], walk.engine_J_per_m / point.indexes["energy_J_per_m"] * point.indexes[COST])
            for point, walk in walks
            if walk.engine_J_per_m is not None
        ]
        if covered:
            cost.plot(*zip(*covered, strict=True), "s--", color=ENGINE, label="engine")
        fallen = [point.at[name] for point, walk in walks if walk.measurements.fallen]
        mark_values(cost, fallen, "falls", "v", FALLS, 0.1)
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


def mark_values(
    axes: Axes, values: Sequence[float], label: str, marker: str = "x", colour: str = "0.4", height: float = 0.03
) -> None:
    """Mark values of x at a share of the axes' height."""
    if values:
        transform = axes.get_xaxis_transform()
        axes.plot(values, [height] * len(values), marker, color=colour, label=label, transform=transform)
