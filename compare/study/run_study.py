"""A study: solvers x problems x runs, one record for each finished run, in this process, in workers, or on a Dask cluster."""

import logging
import os
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from compare.study.evidence import check_records
from compare.study.origin import hash_installed_code
from compare.study.record import RunRecord, check_readable
from compare.study.record_files import find_record, locate_record, name_run, write_record
from compare.study.run_task import MOST_REASON, PLANNED_RUNS, try_task
from compare.study.settings import list_runs
from compare.study.task import Task, check_task
from nlp_gait.errors import GaitError, InputError, NoWorkersError, OutputError, WorkerError
from nlp_gait.files import convert_errors, make_writable_folder, remove_leftovers
from nlp_gait.interrupts import Interrupted, count_interrupts, delay_interrupts
from nlp_gait.processes import run_in_processes
from nlp_gait.progress import Progress

# A study continues in new processes if one dies, unless they die so often without finishing any run.
DEATHS_WITHOUT_PROGRESS = 3
CONNECT_TIMEOUT = "10s"  # to a Dask scheduler


def run_tasks(
    tasks: Sequence[tuple[Task, RunRecord | None]], workers: int = 1, scheduler: str | None = None
) -> Iterator[tuple[int, RunRecord]]:
    """Run tasks in their order, each with the record of the search that it polishes, if there is one.

    Yields the position and the record of each as it finishes. One worker is this process; the address of a Dask scheduler stands
    for its workers instead.

    Raises:
        WorkerError: worker processes keep dying, or the cluster is lost.
        InputError: no Dask scheduler answers at the address, or Dask is not installed.
    """
    is_alone = scheduler is None and (workers == 1 or len(tasks) <= 1)
    waiting = dict(enumerate(tasks))
    for position, (task, _) in enumerate(tasks):
        # A GaitProblem has symbols and functions, which cannot leave this process.
        if is_alone or not isinstance(task.problem.name, str):
            with count_interrupts() as presses:
                record = try_task(*waiting.pop(position))
                if presses:  # user code has swallowed it
                    raise KeyboardInterrupt
            yield position, record
    if waiting and scheduler is not None:
        yield from run_on_cluster(waiting, scheduler)
        return
    deaths = 0
    while waiting:
        try:
            calls = {position: partial(try_task, *call) for position, call in waiting.items()}
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


def run_on_cluster(
    tasks: Mapping[int, tuple[Task, RunRecord | None]], scheduler: str
) -> Iterator[tuple[int, RunRecord]]:
    """Run tasks as ``run_tasks`` on the workers of a scheduler, and yield the key and the record of each as it finishes.

    The scheduler repeats the runs of a worker that dies. Files of user code and robots must have the same paths for the workers;
    relative ones start in the working folder of this process.

    Raises:
        InputError: no scheduler answers at the address, or Dask is not installed.
        WorkerError: the scheduler is lost, or its workers cannot perform the runs.
    """
    try:
        from distributed import Client, as_completed
    except ImportError as error:
        raise InputError("--scheduler needs Dask: pip install 'nlp-gait[cluster]'") from error

    for name in ("distributed", "distributed.client"):
        logging.getLogger(name).setLevel(logging.CRITICAL)  # errors are reported in one sentence
    with convert_errors(f"no Dask scheduler answers at {scheduler!r}", InputError, "start one with `dask scheduler`"):
        client = Client(scheduler, timeout=CONNECT_TIMEOUT)
    with client:
        try:
            futures = {client.submit(_try_task, os.getcwd(), *call, pure=False): key for key, call in tasks.items()}
            for future in as_completed(futures):
                yield futures[future], future.result()
        except Exception as error:  # of Dask, or of the worker's own Python, which may lack a package
            reason = " ".join(str(error).split())[:MOST_REASON]
            raise WorkerError(
                f"the Dask cluster at {scheduler!r} failed: {reason}; finished runs are stored: rerun the same command to "
                "continue. Its workers need the same nlp-gait and extras as this machine"
            ) from error


def _try_task(folder: str, task: Task, search: RunRecord | None) -> RunRecord:
    if os.path.isdir(folder):
        os.chdir(folder)
    return try_task(task, search)


@dataclass(frozen=True, kw_only=True, repr=False)
class Study:
    """What to run."""

    tasks: tuple[Task, ...]  #: all runs, in any order
    folder: Path | None = None  #: where records are written (see ``compare.study.record_files``); None writes none
    jobs: int = 1  #: worker processes; 1 runs in this process
    scheduler: str | None = None  #: address of a Dask scheduler to use instead of local processes

    def __post_init__(self) -> None:
        """Validate the study."""
        if self.jobs < 1:
            raise InputError(f"jobs must be at least 1, got {self.jobs}")
        if not self.tasks:
            raise InputError("a study needs at least one problem, one solver and one run")
        names = Counter((task.problem.title, task.title, task.run) for task in self.tasks)
        (problem, solver, _), count = names.most_common(1)[0]
        if count > 1:
            raise InputError(
                f"two solvers of the study are called {solver!r} on {problem!r}; give them different labels"
            )

    def __repr__(self) -> str:
        problems, solvers = (
            dict.fromkeys(t.problem.title for t in self.tasks),
            dict.fromkeys(t.title for t in self.tasks),
        )
        place = "without a folder" if self.folder is None else f"in {str(self.folder)!r}"
        return f"<Study of {', '.join(problems)} by {', '.join(solvers)}: {len(self.tasks)} runs, {place}>"


def run_study(
    study: Study,
    progress: Callable[[Task, RunRecord], None] | None = None,
    on_stored: Callable[[int], None] | None = None,
    on_outdated: Progress | None = None,
) -> list[RunRecord]:
    """Run all tasks without a record and return the records of all tasks, in task order.

    A record belongs to a task if their inputs are equal. Each record is written as soon as its run has ended, so an interruption
    loses only the runs in progress. The study in the folder then consists of these runs, and of those of other solvers.

    Args:
        study: what to run.
        progress: called after each run.
        on_stored: called once with the number of runs that have a record.
        on_outdated: called with a message for each solver whose records are no evidence and will be recomputed.

    Raises:
        UnknownNameError, InputError: see ``check_task``; InputError also for a damaged record.
        OutputError: the folder is not writable (checked before the first run).
        WorkerError: see ``run_tasks``; also if a worker runs other code than this process.
        Interrupted: Ctrl-C; contains the records of the finished runs.
    """
    check_study(study)
    records, outdated = _load_records(study)
    if on_outdated is not None:
        for (problem, solver, reason), count in outdated.items():
            on_outdated(f"{solver} on {problem}: {count} run{'s' * (count > 1)} recomputed: {reason}")
    if on_stored is not None:
        on_stored(len(records))
    try:
        for index, record in _run_missing(study, records):
            is_elsewhere = study.scheduler is not None and record.inputs.key != study.tasks[index].inputs().key
            if record.inputs.code != hash_installed_code() or is_elsewhere:
                raise WorkerError(
                    "a worker has another version of nlp-gait or of your code than this machine; install the same"
                )
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
    """Return the records by index of the task, and the rejected ones by problem, solver and reason; list the runs."""
    if study.folder is None:
        return {}, Counter()
    for folder in {locate_record(study.folder, task).parent for task in study.tasks}:
        remove_leftovers(make_writable_folder(folder))
    list_runs(study.folder, [name_run(task) for task in study.tasks])
    records = {index: find_record(study.folder, task) for index, task in enumerate(study.tasks)}
    finished = {index: record for index, record in records.items() if record is not None}
    problems = {id(record): study.tasks[index].problem for index, record in finished.items()}
    evidence = check_records(
        list(finished.values()), find_problem=lambda record: problems[id(record)].load(), between_samples="none"
    )
    rejected = Counter((e.record.problem, e.record.solver, e.reasons[0]) for e in evidence.excluded if e.record)
    kept = {id(record) for record in evidence.records}
    return {index: record for index, record in finished.items() if id(record) in kept}, rejected


def _run_missing(study: Study, records: dict[int, RunRecord]) -> Iterator[tuple[int, RunRecord]]:
    """Run the tasks without a record, those that polish last; yield their indices and records as they finish."""
    waiting = [index for index in range(len(study.tasks)) if index not in records]
    if study.scheduler is None:
        _prepare_solvers([study.tasks[index] for index in waiting])
    # Long runs first, to balance the load; and runs of all problems in turn.
    waiting.sort(key=lambda index: (study.tasks[index].is_search, study.tasks[index].run))
    for polish in (False, True):
        chosen = [(index, study.tasks[index]) for index in waiting if study.tasks[index].polish == polish]
        searches = {record.inputs.key: record for record in records.values()} if polish else {}
        tasks = [(task, searches.get(replace(task.inputs(), polish=False).key)) for _, task in chosen]
        for position, record in run_tasks(tasks, study.jobs, study.scheduler):
            yield chosen[position][0], record


def _prepare_solvers(tasks: Sequence[Task]) -> None:
    """Compile once what pays for many runs; the runs find it in the cache folder, in whatever process they are."""
    named = [t for t in tasks if (t.polish or not t.is_search) and isinstance(t.problem.name, str)]
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
