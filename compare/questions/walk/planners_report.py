"""What optimisation buys over other planners on the same footsteps: tables, sentences and a picture."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from typing import Literal, NamedTuple

from matplotlib.figure import Figure as Drawing

from compare.analysis.units import with_unit
from compare.drawing.figures import new_figure, style
from compare.drawing.labels import axis_label, units_of
from compare.questions.answer import all_digits, table_of
from compare.questions.walk.planners import CART_TABLE, LEAST_POWER, LEAST_TORQUE, Rival
from compare.questions.walk.study import Gait
from compare.report.document import Figure, Part
from nlp_gait.formulation import GaitProblem
from nlp_gait.simulation.measurements import Walk

COLOURS = {CART_TABLE: "#D55E00", LEAST_TORQUE: "#009E73", LEAST_POWER: "#000000"}
# By how much the battery's energy fell from the cart-table to the least squared torques, at 0.5 to 1.3 m/min [%].
PUBLISHED = (9.16, 13.35)
SOURCE = (
    "the electric energy of a small biped, three speeds of ten runs each (doi 10.1177/1729881420917808; abstract read)"
)
SHOWN_LIMITS = 2
Place = Literal["model", "engine"]
PLACES: tuple[Place, ...] = ("model", "engine")


class Planned(NamedTuple):
    """One gait of one planner."""

    planner: str
    at: float
    indexes: Mapping[str, float]
    broken: tuple[str, ...]
    note: str
    walk: Walk | None

    def energy(self, where: Place) -> float | None:
        """For each planned metre [J/m], if it is known."""
        if where == "model":
            return self.indexes.get("energy_J_per_m")
        return None if self.walk is None else self.walk.engine_J_per_planned_m


def planners_parts(problem: GaitProblem, gaits: Sequence[Gait], rivals: Sequence[Rival]) -> list[Part]:
    """Parts of the answer: table, verdicts, picture and CSV; none without rivals."""
    if not rivals:
        return []
    (name,) = gaits[0].found.at
    least = [Planned(LEAST_POWER, gait.at, gait.indexes, (), "", gait.walk) for gait in gaits if gait.found.feasible]
    others = [Planned(r.planner, r.at, r.indexes, r.broken, r.note, r.walk) for r in rivals]
    planned = sorted([*least, *others], key=lambda row: (row.at, list(COLOURS).index(row.planner)))
    floor = {row.at: row for row in least}
    columns: dict[str, Callable[[Planned], str]] = {
        name: lambda row: f"{row.at:g}",
        "planner": lambda row: row.planner,
        "model": lambda row: with_unit(row.energy("model"), "J/m", ".2f"),
        "engine": lambda row: with_unit(row.energy("engine"), "J/m", ".2f"),
        "least power saves": lambda row: _saved(row, floor[row.at]),
        "in the engine": _fate,
    }
    figure = Figure(
        name=f"{problem.name}-planners",
        caption="Energy for each planned metre over the same footsteps; solid: model, dashed: physics engine.",
        drawing=planners_figure(name, problem, planned),
    )
    return [
        table_of("Planners over the same footsteps, times and swing heights", planned, columns),
        *_verdicts(planned),
        figure,
        all_digits(
            f"{problem.name}-planners",
            [name, "planner", "model_J_per_m", "engine_J_per_m", "step_length_m", "broken", "note"],
            [
                [
                    row.at,
                    row.planner,
                    row.energy("model"),
                    row.energy("engine"),
                    row.indexes.get("step_length_m"),
                    "; ".join(row.broken),
                    row.note,
                ]
                for row in planned
            ],
        ),
    ]


def _saved(row: Planned, least: Planned) -> str:
    share = _share(row.energy("model"), least.energy("model"))
    return "-" if row is least or share is None else f"{share:.1f} %"


def _share(of: float | None, less: float | None) -> float | None:
    """By how much one is less than the other [%]."""
    return None if of is None or less is None else 100.0 * (1.0 - less / of)


def _fate(row: Planned) -> str:
    if row.walk is None:
        return row.note if row.energy("model") is None else "not played"
    fell_at_s = row.walk.measurements.fell_at_s
    return "walks" if fell_at_s is None else f"falls at {fell_at_s:.2f} s"


def _verdicts(planned: Sequence[Planned]) -> list[Part]:
    """Sentences: what least power saves, what least torques save beside the published range, and which limits break."""
    by = {(row.planner, row.at): row for row in planned}
    said: list[Part] = []
    for better, worse in ((LEAST_POWER, CART_TABLE), (LEAST_POWER, LEAST_TORQUE), (LEAST_TORQUE, CART_TABLE)):
        pairs = [(by[worse, at], by[better, at]) for name, at in by if name == worse and (better, at) in by]
        ranges = []
        for where in PLACES:
            shares = [share for a, b in pairs if (share := _share(a.energy(where), b.energy(where))) is not None]
            if shares:
                ranges.append(f"{min(shares):.1f} to {max(shares):.1f} % in the {where}")
        if ranges:
            said.append(f"Less energy by {better} than by {worse}: {', '.join(ranges)}.")
            if better == LEAST_TORQUE:
                low, high = PUBLISHED
                said.append(f"Published: {low} to {high} %, {SOURCE}.")
    for planner in COLOURS:
        worst = {limit.split(" by ")[0]: limit for row in planned if row.planner == planner for limit in row.broken}
        if worst:
            named = ", ".join(list(worst.values())[:SHOWN_LIMITS])
            more = f" and {len(worst) - SHOWN_LIMITS} more" if len(worst) > SHOWN_LIMITS else ""
            said.append(f"Limits that {planner} breaks, for example: {named}{more}.")
    return said


def planners_figure(name: str, problem: GaitProblem, planned: Sequence[Planned]) -> Drawing:
    """Energy per metre along the axis, a colour for each planner."""
    with style():
        figure = new_figure(6.3, 3.2)
        axes = figure.subplots()
        for planner, colour in COLOURS.items():
            rows = [row for row in planned if row.planner == planner]
            for where, line in zip(PLACES, ("o-", "s--"), strict=True):
                points = [(row.at, value) for row in rows if (value := row.energy(where)) is not None]
                if points:
                    label = planner if where == "model" else None
                    axes.plot(*zip(*points, strict=True), line, color=colour, label=label, markersize=4)
        axes.set(ylabel="energy [J/m]", xlabel=axis_label(name, units_of(problem)[name]))
        axes.set_ylim(bottom=0.0)
        axes.legend()
    return figure
