"""Runs of a reproduction as tasks and records of a study, and what its tables need to know of several records."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from compare.study.record import RunRecord
from compare.study.runner import Run, run_task
from compare.study.study import Study, record_file, run_study
from compare.study.task import IPOPT, ProblemSpec, Stop, Task
from metaheuristics.interface import Algorithm
from nlp_gait.backends.kernel.compiled import available_cores
from nlp_gait.errors import InputError
from nlp_gait.progress import Progress

Runs = dict[tuple[str, str], list[RunRecord]]
"""Records in the order of their runs, by title of the problem and of the solver."""


def starts(problem: ProblemSpec, count: int, *, seed: int = 0, settings: Mapping[str, Any] | None = None) -> list[Task]:
    """IPOPT from random points that are drawn one after another from one seed, as ``nlp_gait.solve`` draws them."""
    model, rng = problem.load(), np.random.default_rng(seed)
    points = [model.by_name(model.start_point(rng)) for _ in range(count)]
    return [
        Task(problem=problem, solver=IPOPT, settings=settings or {}, seed=seed, run=run, start=point)
        for run, point in enumerate(points)
    ]


def searches(problem: ProblemSpec, label: str, algorithm: Algorithm, runs: int, evaluations: int) -> list[Task]:
    """Runs of a search algorithm; run k has seed k."""
    stop = Stop(evaluations=evaluations)
    return [Task(problem=problem, solver=algorithm, label=label, stop=stop, run=run) for run in range(runs)]


def run_all(folder: Path, tasks: Iterable[Task], progress: Progress, run: Run = run_task) -> Runs:
    """Run all tasks and return their records; a run that an earlier call has finished is read from its file.

    Args:
        folder: of the reproduction.
        tasks: with different titles.
        progress: told of each run.
        run: does one run.

    Raises:
        InputError: a run failed before it had a point, or the folder holds runs of other tasks.
    """
    study = Study(tasks=tuple(tasks), folder=folder, jobs=available_cores(), run=run)

    def keep(count: int) -> None:
        for _ in range(count):
            progress("stored by an earlier run")

    found: Runs = {}
    records = run_study(study, lambda task, _: progress(f"{task.problem.title}, {task.title} {task.run}"), keep)
    for task, record in zip(study.tasks, records, strict=True):
        if not record.x:
            file = record_file(folder, task)
            raise InputError(f"{file.parent.name}/{file.stem} {record.status}; mend that and delete {str(file)!r}")
        found.setdefault((record.problem, record.solver), []).append(record)
    return found


def best(records: Iterable[RunRecord]) -> RunRecord:
    """The best run: successful ones come first, then feasible ones, both by objective, then the others by violation."""
    return min(records, key=_rank)


def _rank(record: RunRecord) -> tuple[bool, bool, float]:
    verdict = record.verdict
    sign = 1.0 if record.definition["objective"]["sense"] == "minimise" else -1.0
    return not record.claimed, not verdict.feasible, sign * verdict.objective if verdict.feasible else verdict.violation


def objectives(records: Iterable[RunRecord]) -> list[float]:
    """Exact objective at the end of each run, in the problem's sense."""
    return [record.verdict.objective for record in records]


def point(record: RunRecord) -> list[float]:
    """x in the problem's order."""
    return list(record.x.values())
