"""A problem solved over a grid of parameter values or fixed variables: the true curve, around which search histories scatter."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any, cast

import numpy as np

from compare.study.record import RunRecord, parse_record
from compare.study.run_task import run_task, try_task
from compare.study.store import Store
from compare.study.stored_solver import store_runs
from compare.study.task import GRADIENT_SOLVERS, IPOPT, ProblemSpec, Stop, Task, check_task
from nlp_gait.backends.optima.continuation import solve_both_ways
from nlp_gait.errors import InputError
from nlp_gait.formulation import GaitProblem
from nlp_gait.formulation.solution import Solution
from nlp_gait.interrupts import Interrupted, remember_interrupts
from nlp_gait.progress import Progress, ignore_progress

MOST_POINTS = 10_000  # of an axis, and of the whole grid


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
        status: in words; without a feasible point it names the rows that stand in the way.
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
            if int(count) > MOST_POINTS:
                raise InputError(f"--over takes at most {MOST_POINTS} points an axis, got {text!r}")
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
    store: Store | None = None,
    progress: Progress = ignore_progress,
) -> list[SweepPoint]:
    """Optimum at every point of the grid, in row-major order of the axes.

    An NLP solver walks the grid there and back so that each point is a neighbour of the last and starts from it; a search
    algorithm starts anew at each. Infeasible points are kept, with the rows that stand in the way.

    Args:
        spec: problem with its other values.
        axes: at least one.
        algorithm: an NLP solver or a search algorithm.
        starts: random starts of an NLP solver at both ends of its walk, and where no neighbour helps.
        evaluations: budget of a search run, and of a run of SLSQP.
        seed: of starts and searches.
        store: of finished results; None stores nothing.
        progress: told of each solve, ``count_solves`` times.

    Raises:
        UnknownNameError: an axis is neither a variable nor a parameter; no such algorithm.
        InputError: a value outside what is allowed, an axis twice, or a grid of too many points.
        Interrupted: Ctrl-C; carries the points that were tried until then.
    """
    names = [axis.name for axis in axes]
    if len(set(names)) < len(names):
        raise InputError(f"each axis must be named once, got {', '.join(names)}")
    check_size(axes)
    walk = [dict(zip(names, at, strict=True)) for at in _snake(axes)]
    problem = spec.load()
    specs = [replace(spec, values=dict(placed(problem, at).values)) for at in walk]  # all checked before the work
    tasks = [Task(problem=s, solver=algorithm, stop=Stop(evaluations=evaluations), seed=seed) for s in specs]
    check_task(tasks[0])
    store = store or Store()
    asked = {axis.name: list(axis.values) for axis in axes}
    store.report_changes(
        "sweep", problem, over=asked, algorithm=algorithm, starts=starts, evaluations=evaluations, seed=seed
    )
    ends: Sequence[Solution | RunRecord | None]
    sentence = ""
    try:
        if tasks[0].is_search:
            ends = _searched(tasks, store, progress)
        else:
            problems, solver = [s.load() for s in specs], store_runs(store, tasks[0].make_solver())
            ends = solve_both_ways(problems, starts=starts, seed=seed, solver=solver, progress=lambda: progress(""))
    except Interrupted as interrupt:
        ends, sentence = cast("list[Solution | RunRecord | None]", interrupt.partial), interrupt.sentence
    found = {tuple(at.values()): _point(at, end) for at, end in zip(walk, ends, strict=False) if end is not None}
    grid = [found[at] for at in itertools.product(*(axis.values for axis in axes)) if at in found]
    if sentence:
        raise Interrupted(sentence, grid)
    return grid


def check_size(axes: Sequence[Axis]) -> None:
    """Raise InputError if the axes span more points than a sweep takes."""
    points = math.prod(len(axis.values) for axis in axes)
    if points > MOST_POINTS:
        spans = " x ".join(f"{len(axis.values)} of {axis.name}" for axis in axes)
        raise InputError(
            f"a sweep takes at most {MOST_POINTS} points in all, got {spans} = {points}; take fewer of each"
        )


def count_solves(axes: Sequence[Axis], algorithm: str) -> int:
    """How often a sweep solves a problem: an NLP solver twice at each point of the grid."""
    return math.prod(len(axis.values) for axis in axes) * (2 if algorithm in GRADIENT_SOLVERS else 1)


def placed(problem: GaitProblem, at: Mapping[str, float]) -> GaitProblem:
    """The problem at one point of the grid: parameters set, variables fixed."""
    fixed = {name: value for name, value in at.items() if name in problem.names}
    return problem.with_values(**{name: at[name] for name in at if name not in fixed}).fix(**fixed)


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


def _searched(tasks: Sequence[Task], store: Store, progress: Progress) -> list[RunRecord]:
    """Records along the walk; an interrupt carries those that were made until then."""
    records: list[RunRecord] = []
    try:
        for task in tasks:
            records.append(parse_record(store.compute("search-{key}", task.definition(), partial(_run, task))))
            progress("")
    except KeyboardInterrupt:
        raise Interrupted(f"interrupted after {len(records)} of {len(tasks)} points", records) from None
    return records


def _run(task: Task) -> dict[str, Any]:
    with remember_interrupts() as check:
        record = try_task(task) if task.is_user_code else run_task(task)
        check()
    return record.to_json()


def _point(at: Mapping[str, float], end: Solution | RunRecord) -> SweepPoint:
    if isinstance(end, Solution):
        return SweepPoint(
            at=at,
            objective=end.objective,
            feasible=end.converged,
            status=end.status,
            x=end.x,
            violation=end.violation,
            evaluations=end.evaluations.f,
            time_s=end.time_s.solve,
        )
    verdict = end.verdict
    return SweepPoint(
        at=at,
        objective=verdict.objective,
        feasible=verdict.feasible,
        status=end.status if verdict.feasible else f"infeasible: {'; '.join(verdict.violated)}",
        x=end.x,
        violation=verdict.violation,
        evaluations=end.evaluations["f"],
        time_s=end.time_s.solve,
    )
