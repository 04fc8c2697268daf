"""A study: solvers x problems x runs, one record for each finished run, in this process, in workers, or on a Dask cluster."""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

from compare.study.cluster import Job, run_on_cluster
from compare.study.definition import describe_differences
from compare.study.evidence import check_records
from compare.study.record import RunRecord, check_readable, hash_installed_code, make_frame
from compare.study.record_files import find_record, locate_record, write_record
from compare.study.run_task import PLANNED_RUNS, Run, run_task, try_task
from compare.study.task import Task, check_task
from nlp_gait.errors import GaitError, InputError, NoWorkersError, OutputError, WorkerError
from nlp_gait.files import convert_errors, make_writable_folder, remove_leftovers
from nlp_gait.interrupts import Interrupted, delay_interrupts, remember_interrupts
from nlp_gait.notebook import format_html_table
from nlp_gait.processes import run_in_processes
from nlp_gait.progress import Progress

# A study continues in new processes if one dies, unless they die so often without finishing any run.
DEATHS_WITHOUT_PROGRESS = 3


def run_jobs(
    jobs: Sequence[Job], workers: int = 1, scheduler: str | None = None, run: Run = run_task
) -> Iterator[tuple[int, RunRecord]]:
    """Run jobs in their order, and yield the position and the record of each as it finishes.

    One worker is this process; the address of a Dask scheduler stands for its workers instead.

    Raises:
        WorkerError: worker processes keep dying, or the cluster is lost.
        InputError: no Dask scheduler answers at the address, or Dask is not installed.
    """
    alone = scheduler is None and (workers == 1 or len(jobs) <= 1)
    # A GaitProblem has symbols and functions, which cannot leave this process.
    here = {position for position, (task, _) in enumerate(jobs) if alone or not isinstance(task.problem.name, str)}
    for position in sorted(here):
        with remember_interrupts() as check:
            record = try_task(*jobs[position], run)
            check()
        yield position, record
    if len(here) == len(jobs):
        return
    waiting = {position: job for position, job in enumerate(jobs) if position not in here}
    if scheduler is not None:
        yield from run_on_cluster(waiting, scheduler, run)
        return
    deaths = 0
    while waiting:
        try:
            calls = {position: partial(try_task, *job, run) for position, job in waiting.items()}
            for position, record in run_in_processes(calls, min(workers, len(calls))):
                del waiting[position]
                deaths = 0
                yield position, record
        except WorkerError as error:
            if isinstance(error, NoWorkersError):
                raise
            deaths += 1
            if deaths == DEATHS_WITHOUT_PROGRESS:
                raise WorkerError(
                    f"a worker process died {deaths} times in a row, perhaps out of memory; finished runs are stored: "
                    "rerun with fewer --jobs to continue"
                ) from error


@dataclass(frozen=True, kw_only=True, repr=False)
class Study:
    """What to run."""

    tasks: tuple[Task, ...]  #: all runs, in any order; a run may polish the result of another
    folder: Path | None = None  #: where records are written (see ``compare.study.record_files``); None writes none
    jobs: int = 1  #: worker processes; 1 runs in this process
    scheduler: str | None = None  #: address of a Dask scheduler to use instead of local processes
    run: Run = run_task  #: function that performs one run; it may store more than the record

    def __post_init__(self) -> None:
        """Validate the study."""
        if self.jobs < 1:
            raise InputError(f"jobs must be at least 1, got {self.jobs}")
        if not self.tasks:
            raise InputError("a study needs at least one problem, one solver and one run")
        files = Counter(locate_record(Path(), task) for task in self.tasks)
        duplicate = next((file for file, count in files.items() if count > 1), None)
        if duplicate is not None:
            raise InputError(
                f"two solvers of the study are called {duplicate.stem!r} on {duplicate.parent.name!r}; give them different labels"
            )

    @property
    def _groups(self) -> Counter[tuple[str, str]]:
        return Counter((task.problem.title, task.title) for task in self.tasks)

    def __repr__(self) -> str:
        problems, solvers = (", ".join(dict.fromkeys(group[i] for group in self._groups)) for i in (0, 1))
        place = "without a folder" if self.folder is None else f"in {str(self.folder)!r}"
        return f"<Study of {problems} by {solvers}: {len(self.tasks)} runs, {place}>"

    def _repr_html_(self) -> str:
        rows = [(problem, solver, str(runs)) for (problem, solver), runs in self._groups.items()]
        return format_html_table(repr(self)[1:-1], ("problem", "solver", "runs"), rows)

    def to_frame(self) -> Any:
        """Return the finished runs as a pandas frame, see ``make_frame``; raises InputError for a study without a folder."""
        if self.folder is None:
            raise InputError(
                "this study has no folder; set one, or call make_frame(records) on the result of run_study"
            )
        records, _ = _load_records(self)
        return make_frame([records[index] for index in sorted(records)])


def run_study(
    study: Study,
    progress: Callable[[Task, RunRecord], None] | None = None,
    on_stored: Callable[[int], None] | None = None,
    on_outdated: Progress | None = None,
) -> list[RunRecord]:
    """Run all tasks without a record and return the records of all tasks, in task order.

    Each record is written as soon as its run has ended, so an interruption loses only the runs in progress. A record belongs to
    a task if their definitions are equal. Other records stay in the folder under their own key. All runs of a study are of one
    code: if one is to be computed, those of another code than the installed one are recomputed, too.

    Args:
        study: what to run.
        progress: called after each run.
        on_stored: called once with the number of runs that have a record.
        on_outdated: called with a message for each solver whose records are outdated and will be recomputed.

    Raises:
        UnknownNameError, InputError: see ``check_task``; InputError also for a damaged record.
        OutputError: the folder is not writable (checked before the first run).
        Interrupted: Ctrl-C; contains the records of the finished runs.
    """
    check_study(study)
    records, outdated = _load_records(study)
    if len(records) < len(study.tasks):
        for index, record in list(records.items()):
            if record.origin is not None and record.origin.code_sha256 != hash_installed_code():
                del records[index]
                outdated[record.problem, record.solver, f"it was computed by other code ({record.origin.code})"] += 1
    if on_outdated is not None:
        for (problem, solver, reason), count in outdated.items():
            on_outdated(f"{solver} on {problem}: {count} run{'s' * (count > 1)} recomputed: {reason}")
    if on_stored is not None:
        on_stored(len(records))
    try:
        for index, record in _run_missing(study, records):
            with delay_interrupts():
                if study.folder is not None:
                    _write(record, study.folder, len(records))
                records[index] = record
            if progress is not None:
                progress(study.tasks[index], record)
    except KeyboardInterrupt:
        finished = [records[index] for index in sorted(records)]
        raise Interrupted(f"interrupted after {len(finished)} of {len(study.tasks)} runs", finished) from None
    return [records[index] for index in range(len(study.tasks))]


def check_study(study: Study) -> None:
    """Raise now what would fail in every run of a solver, see ``check_task``, or make its records unreadable."""
    by_run = sorted(study.tasks, key=lambda task: task.run)  # the last one has the largest seed
    for task in {(t.problem.title, t.title): t for t in by_run}.values():
        check_task(task)
        with convert_errors(
            f"{task.title} on {task.problem.title}: its records could not be read", InputError, "change the value"
        ):
            check_readable(RunRecord.make_failed(task, "not run"))


def _load_records(study: Study) -> tuple[dict[int, RunRecord], Counter[tuple[str, str, str]]]:
    """Return the records by index of the task, and the outdated ones by problem, solver and what has changed."""
    records: dict[int, RunRecord] = {}
    outdated: Counter[tuple[str, str, str]] = Counter()
    if study.folder is None:
        return records, outdated
    for folder in {locate_record(study.folder, task).parent for task in study.tasks}:
        remove_leftovers(make_writable_folder(folder))
    for index, task in enumerate(study.tasks):
        record, other = find_record(study.folder, task)
        if record is not None:
            records[index] = record
        elif other is not None:
            outdated[task.problem.title, task.title, describe_differences(other.definition, task.definition())] += 1
    problems = {id(record): study.tasks[index].problem for index, record in records.items()}
    evidence = check_records(
        list(records.values()), find_problem=lambda record: problems[id(record)].load(), between_samples="none"
    )
    for exclusion in evidence.excluded:
        assert exclusion.record is not None  # for the type checker
        outdated[exclusion.record.problem, exclusion.record.solver, exclusion.reasons[0]] += 1
    kept = {id(record) for record in evidence.records}
    return {index: record for index, record in records.items() if id(record) in kept}, outdated


def _run_missing(study: Study, records: dict[int, RunRecord]) -> Iterator[tuple[int, RunRecord]]:
    """Run the tasks without a record; yield their indices and records as they finish."""
    if study.scheduler is None and study.run is run_task:
        _prepare_solvers([task for index, task in enumerate(study.tasks) if index not in records])
    by_title = {(task.problem.title, task.title, task.run): index for index, task in enumerate(study.tasks)}
    for polishing in (False, True):
        waiting = [i for i, t in enumerate(study.tasks) if i not in records and bool(t.polishes) == polishing]
        # Long runs first, to balance the load; and runs of all problems in turn.
        waiting.sort(key=lambda i: (study.tasks[i].is_search, study.tasks[i].run))
        tasks = [study.tasks[i] for i in waiting]
        starts = [records[by_title[t.problem.title, t.polishes, t.run]] if polishing else None for t in tasks]
        for position, record in run_jobs(list(zip(tasks, starts, strict=True)), study.jobs, study.scheduler, study.run):
            yield waiting[position], record


def _prepare_solvers(tasks: Sequence[Task]) -> None:
    """Compile once what pays for many runs; the runs find it in the cache folder, in whatever process they are."""
    named = [t for t in tasks if not t.is_search and not t.is_user_code and isinstance(t.problem.name, str)]
    for task in {(t.problem.title, t.title): t for t in reversed(named)}.values():
        with suppress(GaitError):  # the records of the runs report it
            task.make_solver().prepare(task.problem.load(), PLANNED_RUNS)


def _write(record: RunRecord, folder: Path, before: int) -> None:
    try:
        write_record(record, folder)
    except OutputError as error:
        raise OutputError(
            f"{error}; the {before} runs before it are stored: fix this and rerun the same command to continue"
        ) from error
