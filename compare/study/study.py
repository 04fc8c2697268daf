"""A study: solvers x problems x runs, one file for each finished run."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass
from itertools import groupby
from pathlib import Path
from typing import Any

from compare.study.definition import differences, key_of
from compare.study.record import RunRecord, read_record, run_file
from compare.study.rows import frame_of
from compare.study.runner import Run, run_task
from compare.study.runs.gradient_run import PLANNED_RUNS
from compare.study.task import Task, check_task
from compare.study.workers import run_jobs
from nlp_gait.disk import rename
from nlp_gait.errors import GaitError, InputError, OutputError
from nlp_gait.files import convert_errors, make_writable_folder, remove_leftovers, write_json
from nlp_gait.interrupts import Interrupted
from nlp_gait.notebook import format_html_table

__all__ = ["Study", "check_study", "read_records", "record_file", "run_study"]

RECORDS = "records"
KEY_DIGITS = 8
SAME_VALUE = 1e-9  # relative: another processor rounds otherwise


@dataclass(frozen=True, kw_only=True, repr=False)
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

    @property
    def _groups(self) -> Counter[tuple[str, str]]:
        """Runs by problem and solver."""
        return Counter((task.problem.title, task.title) for task in self.tasks)

    def __repr__(self) -> str:
        """One line: what by what, and where it is kept."""
        problems, solvers = (", ".join(dict.fromkeys(group[i] for group in self._groups)) for i in (0, 1))
        kept = "not kept" if self.folder is None else f"kept in {str(self.folder)!r}"
        return f"<Study of {problems} by {solvers}: {len(self.tasks)} runs, {kept}>"

    def _repr_html_(self) -> str:
        rows = [(problem, solver, str(runs)) for (problem, solver), runs in self._groups.items()]
        return format_html_table(repr(self)[1:-1], ("problem", "solver", "runs"), rows)

    def to_frame(self) -> Any:
        """The finished runs as a pandas data frame, a row each; see ``compare.study.rows.frame_of``.

        Raises:
            InputError: the study keeps nothing; ``frame_of(records)`` takes what ``run_study`` returned.
            MissingExtraError: pandas is not installed.
        """
        if self.folder is None:
            raise InputError(
                "a study without a folder keeps no runs; give it one, or hand its records to compare.study.rows.frame_of"
            )
        records, _ = _finished(self)
        return frame_of([records[index] for index in sorted(records)])


def run_study(
    study: Study,
    progress: Callable[[Task, RunRecord], None] | None = None,
    kept: Callable[[int], None] | None = None,
    anew: Callable[[str], None] | None = None,
) -> list[RunRecord]:
    """Run what has no record yet, and return the records of all tasks in their order.

    Each record is written as soon as its run has ended, so whatever stops the study loses only the runs in progress. A record is
    of a task if it has its definition; others stay in the folder under the key of theirs.

    Args:
        study: what to run.
        progress: called after each run.
        kept: called once with the number of runs that had a record already.
        anew: called with a sentence for each solver whose runs have records of another definition, and so are made again.

    Raises:
        UnknownNameError: a problem, option, parameter, algorithm or setting does not exist.
        InputError: a record is damaged.
        OutputError: the folder cannot be written to; found out before the first run.
        Interrupted: Ctrl-C; carries the records of the finished runs.
    """
    check_study(study)
    records, others = _finished(study)
    if anew is not None:
        for sentence in _sentences(study, others):
            anew(sentence)
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
    if study.scheduler is None and study.run is run_task:
        _build_solvers([task for index, task in enumerate(study.tasks) if index not in records])
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
                _keep(record, study.folder, len(records))
            records[index] = record
            if progress is not None:
                progress(study.tasks[index], record)


def _build_solvers(tasks: Sequence[Task]) -> None:
    """Make each NLP solver ready for its runs of a problem, so that what pays for many is compiled once, here.

    The runs find it in the cache folder, in whatever process they are.
    """
    named = [t for t in tasks if not t.is_search and not t.is_user_code and isinstance(t.problem.name, str)]
    for _, group in groupby(sorted(named, key=_solver_of), key=_solver_of):
        runs = list(group)
        with suppress(GaitError):  # each run says it, in its record
            runs[0].make_solver().prepare(runs[0].problem.load(), PLANNED_RUNS)


def _solver_of(task: Task) -> tuple[str, str]:
    return task.problem.title, task.title


def keep_record(record: RunRecord, folder: Path) -> Path:
    """Write a record under its plain name, and put one of another definition that has it under its key; returns its path.

    Raises:
        OutputError: the file cannot be written.
    """
    path = run_file(folder / RECORDS, record.problem, record.solver, record.run)
    if not path.parent.is_dir():
        make_writable_folder(path.parent)
    if path.exists():
        with suppress(InputError):  # a damaged one is written over
            earlier = read_record(path)
            if key_of(earlier.definition) != key_of(record.definition):
                with convert_errors(f"cannot write to {str(path.parent)!r}", OutputError):
                    rename(path, _keyed(path, earlier.definition))
    write_json(path, record.to_json())
    return path


def _keep(record: RunRecord, folder: Path, before: int) -> None:
    try:
        keep_record(record, folder)
    except OutputError as error:
        raise OutputError(
            f"{error}; the {before} runs before it are kept: mend that, and the same call continues"
        ) from error


def check_study(study: Study) -> None:
    """Raise now what would fail in every run of a solver; see ``check_task``."""
    for task in {(t.problem.title, t.title): t for t in study.tasks}.values():
        check_task(task)


def record_file(folder: Path, task: Task) -> Path:
    """``<folder>/records/<problem>/<solver>-<run>.json``, where a task's record is written; a colon becomes a full stop.

    One of another definition that was there goes to ``<solver>-<run>.<key>.json``.
    """
    return run_file(folder / RECORDS, task.problem.title, task.title, task.run)


def _keyed(path: Path, definition: Mapping[str, Any]) -> Path:
    """Where a record of this definition is put when another one has its plain name."""
    return path.with_name(f"{path.stem}.{key_of(definition)[:KEY_DIGITS]}.json")


def read_records(folder: Path) -> list[RunRecord]:
    """All records below a folder, in the order of their names; those of earlier definitions come last.

    Raises:
        InputError: there are none, or one is damaged.
    """
    with convert_errors(f"folder {str(folder)!r} cannot be read", InputError):
        paths = sorted((folder / RECORDS).glob("*/*.json"))
    if not paths:
        raise InputError(f"{str(folder)!r} holds no records ({RECORDS}/<problem>/<solver>-<run>.json)")
    records = [(path, _named_alike(path, read_record(path))) for path in paths]
    records.sort(key=lambda item: item[0] != run_file(folder / RECORDS, item[1].problem, item[1].solver, item[1].run))
    return [record for _, record in records]


def _named_alike(path: Path, record: RunRecord) -> RunRecord:
    """The record, if it lies where a study puts it: a copy under another name would count twice."""
    own = run_file(path.parents[1], record.problem, record.solver, record.run)
    if path not in (own, _keyed(own, record.definition)):
        raise InputError(f"record {str(path)!r} belongs to {own.parent.name}/{own.name}; rename or delete it")
    if path != own and own.exists() and key_of(read_record(own).definition) == key_of(record.definition):
        raise InputError(f"record {str(path)!r} is also {own.parent.name}/{own.name}; delete one of them")
    return record


def _finished(study: Study) -> tuple[dict[int, RunRecord], dict[int, RunRecord]]:
    """By index of the task, records that are there already, and records under its name that are of another definition."""
    records: dict[int, RunRecord] = {}
    others: dict[int, RunRecord] = {}
    if study.folder is None:
        return records, others
    for folder in {record_file(study.folder, task).parent for task in study.tasks}:
        remove_leftovers(make_writable_folder(folder))
    for index, task in enumerate(study.tasks):
        path = record_file(study.folder, task)
        if not path.exists():
            continue
        definition = task.definition()
        for candidate in (path, _keyed(path, definition)):
            if candidate.exists():
                record = _named_alike(candidate, read_record(candidate))
                if key_of(record.definition) == key_of(definition):
                    records[index] = record
                    break
                others.setdefault(index, record)
    return records, {index: record for index, record in others.items() if index not in records}


def _sentences(study: Study, others: Mapping[int, RunRecord]) -> list[str]:
    """Which runs are made again and why, one sentence for each solver and reason."""
    found: Counter[tuple[str, str, str]] = Counter()
    for index, record in others.items():
        task = study.tasks[index]
        reason = differences(record.definition, task.definition())
        found[task.problem.title, task.title, reason] += 1
    return [
        f"{solver} on {problem}: {count} run{'s' * (count > 1)} made again: {reason}"
        for (problem, solver, reason), count in found.items()
    ]
