"""A problem solved over a grid of parameter values or fixed variables."""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import cached_property
from typing import ClassVar, cast

import matplotlib
import numpy as np
from matplotlib.figure import Figure as Drawing

from compare.analysis.units import format_quantity, list_units, make_axis_label, with_unit
from compare.drawing.figures import COLOURS, make_axes, use_style
from compare.questions.question import Answer, Question, Work, make_record_table
from compare.report.document import Figure, make_text_table
from compare.study.references import find_reference
from compare.study.run import IPOPT, describe_problem
from nlp_gait.backends.exact import build_exact_model, identify_problem
from nlp_gait.backends.solve import solve_both_ways
from nlp_gait.errors import InputError
from nlp_gait.formulation import GaitProblem
from nlp_gait.formulation.solution import Solution
from nlp_gait.interrupts import Interrupted

MOST_POINTS = 10_000  # of an axis, and of the whole grid


@dataclass(frozen=True, kw_only=True)
class Axis:
    """A parameter's values, or the values at which a variable is fixed."""

    name: str
    values: tuple[float, ...]


def parse_axis(text: str) -> Axis:
    """Return the axis ``name=low:high:count`` or ``name=v1,v2,...``; raises InputError for another text or too many points."""
    name, _, values = text.partition("=")
    try:
        if ":" in values:
            low, high, count = values.split(":")
            if int(count) > MOST_POINTS:
                raise InputError(f"--over takes at most {MOST_POINTS} points per axis, got {text!r}")
            numbers = np.linspace(float(low), float(high), int(count)).tolist()
        else:
            numbers = [float(value) for value in values.split(",")]
    except ValueError:
        numbers = []
    if not name or not numbers or not np.all(np.isfinite(numbers)):
        raise InputError(f"--over takes NAME=LOW:HIGH:COUNT or NAME=V1,V2,..., got {text!r}")
    return Axis(name=name, values=tuple(numbers))


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
    metrics: Mapping[str, float] = field(default_factory=dict)  #: exact metrics


@dataclass(frozen=True, kw_only=True, eq=False)
class Sweep(Question[list[SweepPoint]]):
    """How does the optimum move with one or more parameters?

    IPOPT follows the grid forwards and backwards, so that each point is a neighbour of the last and starts from it. Infeasible
    points are part of the result, with the violated constraints.
    """

    name: ClassVar[str] = "sweep"
    counts: ClassVar[str] = "solves"

    axes: Sequence[Axis]  #: at least one
    starts: int = 5  #: random starts at both ends of the path, and where no neighbour helps
    seed: int = 0  #: of the starts

    def __post_init__(self) -> None:
        """Validate the grid.

        Raises:
            UnknownNameError: an axis is neither a variable nor a parameter.
            InputError: a value is not allowed, an axis is duplicated, or the grid has too many points.
        """
        names = [axis.name for axis in self.axes]
        if len(set(names)) < len(names):
            raise InputError(f"each axis must be named once, got {', '.join(names)}")
        points = math.prod(len(axis.values) for axis in self.axes)
        if points > MOST_POINTS:
            spans = " x ".join(f"{len(axis.values)} of {axis.name}" for axis in self.axes)
            raise InputError(
                f"a sweep takes at most {MOST_POINTS} points in all, got {spans} = {points}; take fewer of each"
            )
        for place in self._path:
            self.problem.place(place)

    @property
    def total(self) -> int:
        # Two solves at each point of the grid.
        return math.prod(len(axis.values) for axis in self.axes) * 2

    def find(self, work: Work) -> Iterator[list[SweepPoint]]:
        """Yield the points, in row-major order of the axes."""
        ends: Sequence[Solution | None]
        interrupt = None
        try:
            ends = solve_both_ways(
                [self.problem.place(place) for place in self._path],
                starts=self.starts,
                seed=self.seed,
                progress=lambda: work.progress(""),
            )
        except Interrupted as error:
            ends = cast("list[Solution | None]", error.partial)
            interrupt = Interrupted(f"{error.sentence}, not all of them solved in both directions", None)
        ended = ((place, end) for place, end in zip(self._path, ends, strict=False) if end is not None)
        points = {tuple(place.values()): _make_point(place, end) for place, end in ended}
        grid = [points[place] for place in itertools.product(*(axis.values for axis in self.axes)) if place in points]
        if grid:
            yield grid
        if interrupt is not None:
            raise interrupt

    @cached_property
    def _path(self) -> list[dict[str, float]]:
        """All points of the grid so that neighbours in the list are neighbours on the grid."""
        points: list[dict[str, float]] = [{}]
        for axis in self.axes:
            points = [
                {**point, axis.name: value}
                for row, point in enumerate(points)
                for value in (axis.values if row % 2 == 0 else axis.values[::-1])
            ]
        return points

    def report(self, findings: list[SweepPoint]) -> Answer:
        problem, objective, axes = self.problem, self.problem.objective, tuple(findings[0].at)
        stem = f"{problem.name}-sweep-{'-'.join(axes)}-{IPOPT}"
        rows = [
            (
                *(f"{value:g}" for value in point.at.values()),
                with_unit(point.objective if point.feasible else None, objective.unit),
                point.status,
                _describe_known(problem.place(point.at)),
            )
            for point in findings
        ]
        shown = "Optimum over the first axis; crosses where no feasible point was found."
        return Answer(
            stem=stem,
            title=f"{problem.name} by {IPOPT}",
            parts=(
                make_text_table((*axes, objective.name, "status", "best known"), rows, "Optima"),
                Figure(name=stem, caption=shown, drawing=plot_sweep(findings, problem)),
                make_record_table(stem, findings),
            ),
            data={"problem": problem.name, "points": [asdict(point) for point in findings]},
            results={
                "-".join((problem.name, *(f"{name}-{value:g}" for name, value in point.at.items()))): {
                    **describe_problem(problem.place(point.at)),
                    "x": dict(point.x),
                }
                for point in findings
                if point.feasible and "cost_of_transport" in point.metrics  # for `simulate`
            },
        )


def _make_point(values: Mapping[str, float], end: Solution) -> SweepPoint:
    return SweepPoint(
        at=values,
        objective=end.best.objective,
        feasible=end.converged,
        status=end.status,
        x=end.x,
        violation=end.best.violation,
        evaluations=end.evaluations.f,
        time_s=end.time_s.solve,
        metrics=build_exact_model(end.problem).at(end.best.x, end.problem.p).metrics,
    )


def _describe_known(problem: GaitProblem) -> str:
    reference = find_reference(identify_problem(problem))
    if reference.objective is None:
        return "-"
    return f"{with_unit(reference.objective, problem.objective.unit)} ({reference.source})"


def plot_sweep(points: Sequence[SweepPoint], problem: GaitProblem) -> Drawing:
    """Plot the optimum over the first axis, with a line for each combination of the others; infeasible points as crosses."""
    first, *other_axes = points[0].at
    units, objective = list_units(problem), problem.objective
    lines = dict.fromkeys(tuple(point.at[name] for name in other_axes) for point in points)
    with use_style():
        shades = matplotlib.colormaps["viridis"](np.linspace(0.0, 0.85, len(lines)))
        figure, axes = make_axes(4.2 if not other_axes else 6.3, 3.0)
        for key, shade in zip(lines, shades, strict=True):
            line = [point for point in points if tuple(point.at[name] for name in other_axes) == key]
            label = ", ".join(
                format_quantity(name, units[name], value) for name, value in zip(other_axes, key, strict=True)
            )
            values = [point.objective if point.feasible else np.nan for point in line]
            colour = shade if other_axes else COLOURS[IPOPT]
            axes.plot([point.at[first] for point in line], values, "o-", color=colour, label=label or IPOPT)
        if missing := sorted({point.at[first] for point in points if not point.feasible}):
            low = [0.03] * len(missing)
            axes.plot(missing, low, "x", color="0.4", label="infeasible", transform=axes.get_xaxis_transform())
        axes.set_xlabel(make_axis_label(first, units[first]))
        axes.set_ylabel("least " * (objective.sign > 0) + make_axis_label(objective.name, objective.unit))
        figure.legend(loc="outside right upper") if other_axes else axes.legend()
    return figure
