"""A study: solvers x problems x runs, one file for each finished run."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from compare.study.record import RunRecord, read_record
from compare.study.runner import Run, run_task
from compare.study.task import Task, check_task
from compare.study.workers import default_jobs, run_jobs
from nlp_gait.backends.interrupts import Interrupted
from nlp_gait.errors import InputError, OutputError
from nlp_gait.files import refusing, remove_leftovers, writable_folder, write_json

__all__ = ["Study", "check_study", "default_jobs", "read_records", "record_file", "run_study"]

RECORDS = "records"


@dataclass(frozen=True, kw_only=True)
class Study:
    """What to run.

    Attributes:
        tasks: every run; those that polish others may stand anywhere.
        folder: where records go, see ``record_file``; None keeps nothing.
        jobs: worker processes; 1 runs in this one.
        scheduler: address of a Dask scheduler that takes their place.
        run: does one run, and may keep more than its record.
    """

    tasks: tuple[Task, ...]
    folder: Path | None = None
    jobs: int = 1
    scheduler: str | None = None
    run: Run = run_task

    def __post_init__(self) -> None:
        """Refuse what cannot run."""
        if self.jobs < 1:
            raise InputError(f"jobs must be at least 1, got {self.jobs}")
        if not self.tasks:
            raise InputError("a study needs at least one problem, one algorithm and one run")
        files = Counter(record_file(Path(), task) for task in self.tasks)
        twice = next((file for file, count in files.items() if count > 1), None)
        if twice is not None:
            raise InputError(
                f"two solvers of the study are called {twice.stem!r} on {twice.parent.name!r}: label them apart"
            )


def run_study(
    study: Study,
    progress: Callable[[Task, RunRecord], None] | None = None,
    kept: Callable[[int], None] | None = None,
) -> list[RunRecord]:
    """Run what has no record yet, and return the records of all tasks in their order.

    Each record is written as soon as its run has ended, so whatever stops the study loses only the runs in progress.

    Args:
        study: what to run.
        progress: called after each run.
        kept: called once with the number of runs that had a record already.

    Raises:
        UnknownNameError: a problem, option, parameter, algorithm or setting does not exist.
        InputError: the folder holds another study.
        OutputError: the folder cannot be written to; found out before the first run.
        Interrupted: Ctrl-C; carries the records of the finished runs.
    """
    check_study(study)
    records = _finished(study)
    if kept is not None:
        kept(len(records))
    try:
        _run_waiting(study, records, progress)
    except KeyboardInterrupt:
        finished = [records[index] for index in sorted(records)]
        raise Interrupted(f"interrupted after {len(finished)} of {len(study.tasks)} runs", finished) from None
    return [records[index] for index in range(len(study.tasks))]


def _run_waiting(
    study: Study, records: dict[int, RunRecord], progress: Callable[[Task, RunRecord], None] | None
) -> None:
    """Run what is not among the records, by index of the task, and add it."""
    by_title = {(task.problem.title, task.title, task.run): index for index, task in enumerate(study.tasks)}
    for polishing in (False, True):
        waiting = [i for i, t in enumerate(study.tasks) if i not in records and bool(t.polishes) == polishing]
        # Long runs first, so that no worker is left alone with one at the end; and runs of all problems in turn.
        waiting.sort(key=lambda i: (study.tasks[i].is_search, study.tasks[i].run))
        tasks = [study.tasks[i] for i in waiting]
        starts = [records[by_title[t.problem.title, t.polishes, t.run]] if polishing else None for t in tasks]
        for position, record in run_jobs(list(zip(tasks, starts, strict=True)), study.jobs, study.scheduler, study.run):
            index = waiting[position]
            if study.folder is not None:
                _keep(record, record_file(study.folder, study.tasks[index]), len(records))
            records[index] = record
            if progress is not None:
                progress(study.tasks[index], record)


def _keep(record: RunRecord, path: Path, before: int) -> None:
    try:
        write_json(path, record.to_json())
    except OutputError as error:
        raise OutputError(
            f"{error}; the {before} runs before it are kept: mend that, and the same call continues"
        ) from error


def check_study(study: Study) -> None:
    """Raise now what would fail in every run of a solver; see ``check_task``."""
    for task in {(t.problem.title, t.title): t for t in study.tasks}.values():
        check_task(task)


def record_file(folder: Path, task: Task) -> Path:
    """``<folder>/records/<problem>/<solver>-<run>.json``; a colon in a label becomes a full stop."""
    return _file(folder, task.problem.title, task.title, task.run)


def _file(folder: Path, problem: str, solver: str, run: int) -> Path:
    problem, solver = (title.replace(":", ".") for title in (problem, solver))
    return folder / RECORDS / problem / f"{solver}-{run:04d}.json"


def read_records(folder: Path) -> list[RunRecord]:
    """All records below a folder, in the order of their names.

    Raises:
        InputError: there are none, or one is damaged.
    """
    with refusing(f"folder {str(folder)!r} cannot be read", InputError):
        paths = sorted((folder / RECORDS).glob("*/*.json"))
    if not paths:
        raise InputError(f"{str(folder)!r} holds no records ({RECORDS}/<problem>/<solver>-<run>.json)")
    return [_named_alike(path, read_record(path)) for path in paths]


def _named_alike(path: Path, record: RunRecord) -> RunRecord:
    """The record, if it lies where a study puts it: a copy under another name would count twice."""
    own = _file(path.parents[2], record.problem, record.algorithm, record.run)
    if own != path:
        raise InputError(f"record {str(path)!r} belongs to {own.parent.name}/{own.name}; rename or delete it")
    return record


def _finished(study: Study) -> dict[int, RunRecord]:
    """Records that are there already."""
    if study.folder is None:
        return {}
    records: dict[int, RunRecord] = {}
    for folder in {record_file(study.folder, task).parent for task in study.tasks}:
        remove_leftovers(writable_folder(folder))
    for index, task in enumerate(study.tasks):
        path = record_file(study.folder, task)
        if path.exists():
            records[index] = _matching(path, task)
    return records


def _matching(path: Path, task: Task) -> RunRecord:
    """Record of an earlier call, if it is of the same task."""
    record = read_record(path)
    definition = task.definition()
    if record.definition != definition:
        differs = ", ".join(
            key for key in {**record.definition, **definition} if record.definition.get(key) != definition.get(key)
        )
        raise InputError(
            f"{str(path.parents[2])!r} holds another study: {path.parent.name}/{path.name} differs in {differs}; choose "
            "another folder with --out, or delete it"
        )
    return record
