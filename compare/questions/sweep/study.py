"""A problem solved over a grid of parameter values or fixed variables: the true curve, around which search histories scatter."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import cast

import numpy as np

from compare.study.progress import Progress, unwatched
from compare.study.record import RunRecord
from compare.study.runner import run_task
from compare.study.task import GRADIENT_SOLVERS, IPOPT, ProblemSpec, Stop, Task, check_task
from nlp_gait.backends.interrupts import Interrupted, remembered_interrupts
from nlp_gait.backends.optima.continuation import solve_both_ways
from nlp_gait.backends.solvers.solver import Solver
from nlp_gait.errors import InputError
from nlp_gait.problem import GaitProblem
from nlp_gait.problem.solution import Solution

MOST_POINTS = 10_000  # of an axis


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
    progress: Progress = unwatched,
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
        progress: told of each solve, ``count_solves`` times.

    Raises:
        UnknownNameError: an axis is neither a variable nor a parameter; no such algorithm.
        InputError: a value outside what is allowed, or an axis twice.
        Interrupted: Ctrl-C; carries the points that were tried until then.
    """
    names = [axis.name for axis in axes]
    if len(set(names)) < len(names):
        raise InputError(f"each axis must be named once, got {', '.join(names)}")
    walk = _snake(axes)
    named = [dict(zip(names, at, strict=True)) for at in walk]
    problem = spec.load()
    specs = [replace(spec, values=dict(placed(problem, at).values)) for at in named]  # all checked before the work
    tasks = [Task(problem=s, algorithm=algorithm, stop=Stop(evaluations=evaluations), seed=seed) for s in specs]
    check_task(tasks[0])
    if not tasks[0].is_search:
        solutions, sentence = _solutions([s.load() for s in specs], tasks[0].solver(), starts, seed, progress)
        points = [None if s is None else _solved_point(at, s) for at, s in zip(named, solutions, strict=True)]
    else:
        points, sentence = _search_points(named, tasks, progress)
    found = dict(zip(walk, points, strict=False))
    grid = [found.get(at) for at in itertools.product(*(axis.values for axis in axes))]
    known = [point for point in grid if point is not None]
    if sentence:
        raise Interrupted(sentence, known)
    return known


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


def _solutions(
    problems: Sequence[GaitProblem], solver: Solver, starts: int, seed: int, progress: Progress
) -> tuple[Sequence[Solution | None], str]:
    """Solutions along the walk, and how far it came if it was interrupted."""
    try:
        found = solve_both_ways(problems, starts=starts, seed=seed, solver=solver, progress=lambda: progress(""))
        return found, ""
    except Interrupted as interrupt:
        return cast("list[Solution | None]", interrupt.partial), interrupt.sentence


def _search_points(
    named: Sequence[Mapping[str, float]], tasks: Sequence[Task], progress: Progress
) -> tuple[list[SweepPoint | None], str]:
    """Points along the walk, and how far it came if it was interrupted."""
    points: list[SweepPoint | None] = []
    try:
        for at, task in zip(named, tasks, strict=True):
            with remembered_interrupts() as check:
                record = run_task(task)
                progress("")
                check()
            points.append(_search_point(at, record))
    except KeyboardInterrupt:
        return points, f"interrupted after {len(points)} of {len(tasks)} points"
    return points, ""


def _solved_point(at: Mapping[str, float], solution: Solution) -> SweepPoint:
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


def _search_point(at: Mapping[str, float], record: RunRecord) -> SweepPoint:
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
