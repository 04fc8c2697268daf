"""A problem solved over a grid of parameter values or fixed variables: the true curve that search histories only scatter over."""

from __future__ import annotations

import csv
import io
import itertools
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from compare.figures import COLOURS, new_figure, style
from compare.runner import IPOPT, ProblemSpec, Task, run_task
from compare.storage import write_text
from nlp_gait.backends.continuation import Continuation
from nlp_gait.errors import InputError
from nlp_gait.problems.gait_problem import GaitProblem

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True, kw_only=True)
class Axis:
    """A parameter's values, or the values at which a variable is fixed."""

    name: str
    values: tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class SweepPoint:
    """Optimum at one point of the grid.

    Attributes:
        at: value of each axis.
        objective: exact value, in the problem's sense.
        feasible: a feasible optimum was found.
        status: in words; names the rows in the way if there is none.
        x: by variable name.
        violation: exact total violation.
        evaluations: calls of f.
        time_s: wall time [s].
    """

    at: Mapping[str, float]
    objective: float
    feasible: bool
    status: str
    x: Mapping[str, float]
    violation: float
    evaluations: int
    time_s: float


def parse_axis(text: str) -> Axis:
    """Axis from ``name=low:high:count`` or ``name=v1,v2,...``.

    Raises:
        InputError: anything else.
    """
    name, _, values = text.partition("=")
    try:
        if ":" in values:
            low, high, count = values.split(":")
            numbers = np.linspace(float(low), float(high), int(count)).tolist()
        else:
            numbers = [float(value) for value in values.split(",")]
    except ValueError:
        numbers = []
    if not name or not numbers or not np.all(np.isfinite(numbers)):
        raise InputError(f"--over takes NAME=LOW:HIGH:COUNT or NAME=V1,V2,..., got {text!r}")
    return Axis(name=name, values=tuple(numbers))


def sweep(
    spec: ProblemSpec,
    axes: Sequence[Axis],
    *,
    algorithm: str = IPOPT,
    starts: int = 5,
    evaluations: int = 10_000,
    seed: int = 0,
    progress: Callable[[SweepPoint], None] | None = None,
) -> list[SweepPoint]:
    """Optimum at every point of the grid, in row-major order of the axes.

    IPOPT walks the grid so that each point is a neighbour of the last and starts from it; a search algorithm starts anew
    at each. Infeasible points are kept, with the rows that stand in the way.

    Args:
        spec: problem with its other values.
        axes: at least one.
        algorithm: ``"ipopt"`` or a search algorithm.
        starts: random starts of IPOPT where no neighbour helps.
        evaluations: budget of a search run.
        seed: of starts and searches.
        progress: called after each point.

    Raises:
        UnknownNameError: an axis is neither a variable nor a parameter.
        InputError: a value outside what is allowed.
    """
    grid = [_with(spec, axes, at) for at in _snake(axes)]  # all checked before the work
    path = Continuation(starts=starts, seed=seed)
    found: dict[tuple[float, ...], SweepPoint] = {}
    for at, point_spec in zip(_snake(axes), grid, strict=True):
        task = Task(problem=point_spec, algorithm=algorithm, evaluations=evaluations, seed=seed)
        named = dict(zip((axis.name for axis in axes), at, strict=True))
        point = _ipopt_point(named, path, point_spec.load()) if algorithm == IPOPT else _search_point(named, task)
        found[at] = point
        if progress is not None:
            progress(point)
    return [found[at] for at in itertools.product(*(axis.values for axis in axes))]


def sweep_csv(points: Sequence[SweepPoint], problem: GaitProblem) -> str:
    """Table of all points, one row each, units in the header."""
    axes, names = list(points[0].at), list(problem.names)
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    unit = problem.objective.unit
    objective = problem.objective.name + (f"_{unit}" if unit != "1" else "")
    # A variable may be an axis too; its column then says what the axis asked for, exactly.
    columns = [name for name in names if name not in axes]
    writer.writerow([*axes, objective, "feasible", "violation", *columns, "evaluations", "time_s", "status"])
    for point in points:
        at = [repr(value) for value in point.at.values()]
        x = [repr(point.x[name]) for name in columns]
        numbers = [repr(point.objective), str(point.feasible).lower(), repr(point.violation)]
        writer.writerow([*at, *numbers, *x, point.evaluations, f"{point.time_s:.4f}", point.status])
    return text.getvalue()


def sweep_figure(points: Sequence[SweepPoint], problem: GaitProblem, algorithm: str) -> Figure:
    """Objective over the first axis, one line for each combination of the others; infeasible points as crosses."""
    first, *others = points[0].at
    objective = problem.objective
    with style():
        figure = new_figure(4.2, 3.0)
        axes = figure.subplots()
        groups = dict.fromkeys(tuple(point.at[name] for name in others) for point in points)
        for number, group in enumerate(groups):
            line = [p for p in points if tuple(p.at[name] for name in others) == group]
            good = [p for p in line if p.feasible]
            bad = [p.at[first] for p in line if not p.feasible]
            label = ", ".join(f"{name} = {value:g}" for name, value in zip(others, group, strict=True)) or algorithm
            colour = COLOURS.get(algorithm) if not others else f"C{number % 7}"
            axes.plot([p.at[first] for p in good], [p.objective for p in good], "o-", color=colour, label=label)
            lowest = min((p.objective for p in points if p.feasible), default=0.0)
            if bad:
                axes.plot(bad, [lowest] * len(bad), "x", color=colour, label="infeasible")
        axes.set_xlabel(_with_unit(problem, first))
        axes.set_ylabel(f"optimal {objective.name}" + (f" [{objective.unit}]" if objective.unit != "1" else ""))
        axes.legend()
    return figure


def write_sweep(folder: Path, points: Sequence[SweepPoint], problem: GaitProblem, algorithm: str) -> list[Path]:
    """Write the table and the picture of a sweep; returns their paths."""
    from compare.figures import save

    stem = folder / f"{problem.name}-sweep-{'-'.join(points[0].at)}-{algorithm}"
    table = stem.with_name(f"{stem.name}.csv")
    write_text(table, sweep_csv(points, problem))
    return [table, *save(sweep_figure(points, problem, algorithm), stem)]


def _with_unit(problem: GaitProblem, name: str) -> str:
    units = {v.name: v.unit for v in problem.variables} | {q.name: q.unit for q in problem.parameters}
    unit = units[name]
    stem = name.removesuffix("_" + unit.replace("/", "_").replace("^", ""))
    return f"{stem.replace('_', ' ')} [{unit}]" if unit != "1" else stem


def _with(spec: ProblemSpec, axes: Sequence[Axis], at: Sequence[float]) -> ProblemSpec:
    """The problem at one point of the grid."""
    problem = spec.load()
    for axis, value in zip(axes, at, strict=True):
        fixed = axis.name in problem.names
        problem = problem.fix(**{axis.name: value}) if fixed else problem.with_values(**{axis.name: value})
    return replace(spec, values=dict(problem.values))


def _snake(axes: Sequence[Axis]) -> list[tuple[float, ...]]:
    """All points of the grid so that neighbours in the list are neighbours on the grid."""
    points: list[tuple[float, ...]] = [()]
    for axis in axes:
        points = [
            (*point, value)
            for row, point in enumerate(points)
            for value in (axis.values if row % 2 == 0 else axis.values[::-1])
        ]
    return points


def _ipopt_point(at: Mapping[str, float], path: Continuation, problem: GaitProblem) -> SweepPoint:
    solution = path.solve(problem)
    return SweepPoint(
        at=at,
        objective=solution.objective,
        feasible=solution.success,
        status=solution.status,
        x=solution.x,
        violation=solution.violation,
        evaluations=solution.evaluations.f,
        time_s=solution.time_s.solve,
    )


def _search_point(at: Mapping[str, float], task: Task) -> SweepPoint:
    record = run_task(task)
    verdict = record.verdict
    return SweepPoint(
        at=at,
        objective=verdict.objective,
        feasible=verdict.feasible,
        status=record.status if verdict.feasible else f"infeasible: {'; '.join(verdict.violated)}",
        x=record.x,
        violation=verdict.violation,
        evaluations=record.evaluations["f"],
        time_s=record.time_s.solve,
    )
