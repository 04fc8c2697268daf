"""A study: solvers x problems x runs in worker processes, one file for each finished run."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from compare.record import RunRecord, read_record
from compare.runner import Task, check_task, run_task
from compare.storage import writable_folder
from nlp_gait.errors import InputError


@dataclass(frozen=True, kw_only=True)
class Study:
    """What to run.

    Attributes:
        tasks: every run.
        folder: where records go: ``<folder>/records/<problem>/<algorithm>-<run>.json``; None keeps nothing.
        jobs: worker processes; 1 runs in this one.
    """

    tasks: tuple[Task, ...]
    folder: Path | None = None
    jobs: int = 1

    def __post_init__(self) -> None:
        """Refuse what cannot run."""
        if self.jobs < 1:
            raise InputError(f"jobs must be at least 1, got {self.jobs}")
        if not self.tasks:
            raise InputError("a study needs at least one problem, one algorithm and one run")


def run_study(study: Study, progress: Callable[[Task, RunRecord], None] | None = None) -> list[RunRecord]:
    """Run what has no record yet, and return the records of all tasks in their order.

    Each record is written as soon as its run has ended, so whatever stops the study loses only the runs in progress.

    Raises:
        UnknownNameError: a problem, option, parameter, algorithm or setting does not exist.
        OutputError: the folder cannot be written to; found out before the first run.
    """
    for task in {(t.problem.name, t.algorithm): t for t in study.tasks}.values():
        check_task(task)
    paths = _paths(study)
    records: dict[int, RunRecord] = {}
    for index, path in enumerate(paths):
        if path is not None and path.exists():
            records[index] = _matching(path, study.tasks[index])
    waiting = [index for index in range(len(study.tasks)) if index not in records]
    for index, record in _run_all(study, waiting, paths):
        records[index] = record
        if progress is not None:
            progress(study.tasks[index], record)
    return [records[index] for index in range(len(study.tasks))]


def default_jobs() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1


def _paths(study: Study) -> list[Path | None]:
    if study.folder is None:
        return [None] * len(study.tasks)
    folder = writable_folder(study.folder / "records")
    for problem in {task.problem.name for task in study.tasks}:
        writable_folder(folder / problem)
    return [folder / task.problem.name / f"{task.algorithm}-{task.run:04d}.json" for task in study.tasks]


def _matching(path: Path, task: Task) -> RunRecord:
    """Record of an earlier call, if it is of the same task."""
    record = read_record(path)
    problem = task.problem.load()
    same = (
        record.seed == task.run_seed
        and dict(record.options) == dict(problem.options)
        and dict(record.parameters) == dict(problem.values)
        and record.settings.get("evaluations", task.evaluations) == task.evaluations
    )
    if not same:
        raise InputError(
            f"{str(path.parent.parent.parent)!r} holds another study ({path.name} differs in seed, budget, options or "
            "parameters); choose another folder with --out, or delete it"
        )
    return record


def _run_all(study: Study, waiting: Sequence[int], paths: Sequence[Path | None]) -> Iterator[tuple[int, RunRecord]]:
    if study.jobs == 1 or len(waiting) <= 1:
        for index in waiting:
            yield _run_one(index, study.tasks[index], paths[index])
        return
    from joblib import Parallel, delayed  # costs 0.1 s to import

    parallel = Parallel(n_jobs=study.jobs, return_as="generator_unordered", batch_size=1)
    yield from parallel(delayed(_run_one)(index, study.tasks[index], paths[index]) for index in waiting)


def _run_one(index: int, task: Task, path: Path | None) -> tuple[int, RunRecord]:
    record = run_task(task)
    if path is not None:
        record.write(path)
    return index, record
