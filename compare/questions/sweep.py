"""A problem solved over a grid of parameter values or fixed variables."""

import itertools
import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, replace
from functools import cached_property, partial
from typing import Any, ClassVar, cast

import matplotlib
import numpy as np
from matplotlib.figure import Figure as Drawing

from compare.analysis.units import format_quantity, list_units, make_axis_label, with_unit
from compare.drawing.figures import COLOURS, make_axes, mark_values, use_style
from compare.questions.question import Answer, Question, Work, make_record_table
from compare.questions.swept_walks import COST, SweepPoint, check_cycle, report_walks, simulate_walk
from compare.report.document import Figure, make_text_table
from compare.study.record import RunRecord, Verdict, parse_record
from compare.study.references import find_reference
from compare.study.run_task import run_task, try_task
from compare.study.task import GRADIENT_SOLVERS, IPOPT, ProblemSpec, Stop, Task, check_task, describe_problem
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.identity import identify_problem
from nlp_gait.backends.solve import solve_both_ways
from nlp_gait.errors import InputError
from nlp_gait.formulation import GaitProblem, Result
from nlp_gait.formulation.solution import Outcome, Solution
from nlp_gait.interrupts import Interrupted, remember_interrupts
from nlp_gait.simulation.engine import load_mujoco

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


@dataclass(frozen=True, kw_only=True, eq=False)
class Sweep(Question[list[SweepPoint]]):
    """How does the optimum move with one or more parameters?

    An NLP solver follows the grid forwards and backwards, so that each point is a neighbour of the last and starts from it; a
    search starts afresh at each. Infeasible points are part of the result, with the violated constraints.
    """

    name: ClassVar[str] = "sweep"
    counts: ClassVar[str] = "solves"

    axes: Sequence[Axis]  #: at least one
    algorithm: str = IPOPT  #: an NLP solver or a search algorithm
    starts: int = 5  #: random starts of an NLP solver at both ends of its path, and where no neighbour helps
    evaluations: int = 10_000  #: budget of a search, and of a run of SLSQP
    seed: int = 0  #: of starts and searches
    steps: int = 0  #: of each walking cycle to simulate in the engine, open loop; 0 for none (extra ``sim``)

    def __post_init__(self) -> None:
        """Validate the grid and the algorithm.

        Raises:
            UnknownNameError: an axis is neither a variable nor a parameter; an unknown algorithm.
            InputError: a value is not allowed, an axis is duplicated, the grid has too many points, or the problem is not a
                walking cycle whose steps can be simulated.
            MissingExtraError: MuJoCo is needed and not installed.
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
        check_task(self._tasks[0])
        if self.steps:
            check_cycle(self.problem)
            load_mujoco()

    @property
    def total(self) -> int:
        # An NLP solver solves twice at each point of the grid.
        solves = 2 if self.algorithm in GRADIENT_SOLVERS else 1
        return math.prod(len(axis.values) for axis in self.axes) * (solves + bool(self.steps))

    def find(self, work: Work) -> Iterator[list[SweepPoint]]:
        """Yield the points, in row-major order of the axes."""
        path, tasks = self._path, self._tasks
        ends: Sequence[Solution | RunRecord | None]
        interrupt = None
        try:
            if tasks[0].is_search:
                ends = _run_searches(tasks, work)
            else:
                ends = solve_both_ways(
                    [task.problem.load() for task in tasks],
                    starts=self.starts,
                    seed=self.seed,
                    solver=work.solver(tasks[0].make_solver()),
                    progress=lambda: work.progress(""),
                )
        except Interrupted as error:
            ends, interrupt = cast("list[Solution | RunRecord | None]", error.partial), error
            if not tasks[0].is_search:
                interrupt = Interrupted(f"{error.sentence}, not all of them solved in both directions", None)
        ended = ((place, end) for place, end in zip(path, ends, strict=False) if end is not None)
        points = {tuple(place.values()): self._make_point(place, end) for place, end in ended}
        grid = [points[place] for place in itertools.product(*(axis.values for axis in self.axes)) if place in points]
        if grid:
            yield grid
        if interrupt is not None:
            raise interrupt
        for i, point in enumerate(grid if self.steps else ()):
            if point.feasible:
                placed = self.problem.place(point.at)
                result = Result(problem=placed, x=placed.check_x(point.x))
                grid[i] = replace(point, walk=simulate_walk(result, self.steps, work))
                yield grid
            work.progress("")

    def _make_point(self, at: Mapping[str, float], end: Solution | RunRecord) -> SweepPoint:
        judged: Outcome | Verdict
        indexes: Mapping[str, float]
        if isinstance(end, Solution):
            judged, feasible, status, evaluations = end.best, end.converged, end.status, end.evaluations.f
            indexes = build_exact_model(end.problem).at(end.best.x, end.problem.p).indexes
        else:
            judged, feasible, status, evaluations = end.verdict, end.verdict.feasible, end.status, end.evaluations["f"]
            status = status if feasible else f"infeasible: {'; '.join(end.verdict.violated)}"
            indexes = end.verdict.indexes
        return SweepPoint(
            at=at,
            objective=judged.objective,
            feasible=feasible,
            status=status,
            x=end.x,
            violation=judged.violation,
            evaluations=evaluations,
            time_s=end.time_s.solve,
            indexes=indexes,
        )

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

    @cached_property
    def _tasks(self) -> list[Task]:
        stop = Stop(evaluations=self.evaluations)
        problems = [ProblemSpec(name=self.problem.place(place)) for place in self._path]
        return [Task(problem=problem, solver=self.algorithm, stop=stop, seed=self.seed) for problem in problems]

    def report(self, findings: list[SweepPoint]) -> Answer:
        problem, objective, axes = self.problem, self.problem.objective, tuple(findings[0].at)
        solver = Task(problem=ProblemSpec(name=problem), solver=self.algorithm).title
        stem = f"{problem.name}-sweep-{'-'.join(axes)}-{solver}"
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
            title=f"{problem.name} by {solver}",
            parts=(
                make_text_table((*axes, objective.name, "status", "best known"), rows, "Optima"),
                Figure(name=stem, caption=shown, drawing=plot_sweep(findings, problem, solver)),
                *report_walks(problem, findings),
                make_record_table(stem, [point.to_row() for point in findings]),
            ),
            data={"problem": problem.name, "points": [asdict(point) for point in findings]},
            results={
                "-".join((problem.name, *(f"{name}-{value:g}" for name, value in point.at.items()))): {
                    **describe_problem(problem.place(point.at)),
                    "x": dict(point.x),
                }
                for point in findings
                if point.feasible and COST in point.indexes
            },
        )


def _describe_known(problem: GaitProblem) -> str:
    known = find_reference(identify_problem(problem))
    return "-" if known.objective is None else f"{with_unit(known.objective, problem.objective.unit)} ({known.source})"


def _run_searches(tasks: Sequence[Task], work: Work) -> list[RunRecord]:
    """Records along the path; an interrupt carries those that are finished."""
    records: list[RunRecord] = []
    try:
        for task in tasks:
            record = work.store.compute("search", asdict(task.inputs()), partial(_run_search, task))
            records.append(parse_record(record))
            work.progress("")
    except KeyboardInterrupt:
        raise Interrupted(f"interrupted after {len(records)} of {len(tasks)} points", records) from None
    return records


def _run_search(task: Task) -> dict[str, Any]:
    with remember_interrupts() as check:
        record = try_task(task) if task.is_user_code else run_task(task)
        check()
    return record.to_json()


def plot_sweep(points: Sequence[SweepPoint], problem: GaitProblem, solver: str) -> Drawing:
    """Plot the optimum over the first axis, with a line for each combination of the others; infeasible points as crosses."""
    first, *others = points[0].at
    units, objective = list_units(problem), problem.objective
    lines = dict.fromkeys(tuple(point.at[name] for name in others) for point in points)
    with use_style():
        shades = matplotlib.colormaps["viridis"](np.linspace(0.0, 0.85, len(lines)))
        figure, axes = make_axes(4.2 if not others else 6.3, 3.0)
        for key, shade in zip(lines, shades, strict=True):
            line = [point for point in points if tuple(point.at[name] for name in others) == key]
            label = ", ".join(
                format_quantity(name, units[name], value) for name, value in zip(others, key, strict=True)
            )
            values = [point.objective if point.feasible else np.nan for point in line]
            colour = shade if others else COLOURS.get(solver, shade)
            axes.plot([point.at[first] for point in line], values, "o-", color=colour, label=label or solver)
        mark_values(axes, sorted({point.at[first] for point in points if not point.feasible}), "infeasible")
        axes.set_xlabel(make_axis_label(first, units[first]))
        axes.set_ylabel("least " * (objective.sign > 0) + make_axis_label(objective.name, objective.unit))
        figure.legend(loc="outside right upper") if others else axes.legend()
    return figure
