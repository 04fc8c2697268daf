"""A study: solvers x problems x runs, one record for each finished run, in a folder.

``records/<problem>/<solver>-<run>-<key>.json`` is the record of a run; the key is the hash of its inputs, so runs with different
settings never overwrite each other, and a run with the same inputs is read instead of repeated. ``study.json`` lists the runs of
the study; other records stay and are not read.
"""

import logging
import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import suppress
from dataclasses import asdict, dataclass, replace
from functools import partial
from pathlib import Path
from typing import Literal

from compare.study.perform import (
    MOST_REASON,
    PLANNED_RUNS,
    ChangedFileError,
    IsolatedRun,
    describe_error,
    make_failed,
    perform,
)
from compare.study.record import RunRecord, format_now, read_record
from compare.study.run import Inputs, ProblemSpec, Run, check_repeatable, check_run, make_inputs
from nlp_gait.backends.kernel.compiled import compile_objective
from nlp_gait.decoding import decode
from nlp_gait.errors import GaitError, InputError, OutputError, WorkerError
from nlp_gait.files import convert_errors, lock_folder, make_writable_folder, read_json, write_json
from nlp_gait.interrupts import Interrupted, delay_interrupts
from nlp_gait.processes import Job, has_fork, run_jobs

FILE, RECORDS = "study.json", "records"
CONNECT_TIMEOUT = "10s"  # to a Dask scheduler
REMEDY = "delete it; the records stay valid"
Item = tuple[Run, Inputs]


@dataclass(frozen=True, kw_only=True)
class StudyFile:
    """Content of ``study.json``."""

    schema: Literal[4] = 4
    command: str = ""  #: that ran last
    date: str = ""  #: of it, UTC
    runs: tuple[str, ...] = ()  #: that belong to the study: names of their records without suffix


def read_study_file(folder: Path) -> StudyFile:
    """Return the content of ``study.json``, empty without one; raises InputError if it is damaged or of another schema."""
    path = folder / FILE
    if not os.path.lexists(path):
        return StudyFile()
    raw = read_json(path, "study", remedy=REMEDY)
    with convert_errors(f"study {str(path)!r} is damaged", InputError, REMEDY):
        return decode(StudyFile, raw)


def add_runs(folder: Path, names: Sequence[str], command: str = "") -> None:
    """Make runs part of a study; they replace the runs of their problems and solvers, whose records stay as files.

    A command is written, too. Raises InputError if ``study.json`` is damaged, and OutputError.
    """
    with lock_folder(folder):
        file = read_study_file(folder)
        solvers = {_name_solver(name) for name in names}
        kept = [name for name in file.runs if _name_solver(name) not in solvers]
        if command or set(file.runs) != {*kept, *names}:
            file = replace(file, runs=(*kept, *dict.fromkeys(names)))
            file = replace(file, command=command, date=format_now()) if command else file
            write_json(folder / FILE, asdict(file))


def _name_solver(name: str) -> str:
    return name.rsplit("-", 2)[0]  # without run and key


def name_run(problem: str, solver: str, number: int, inputs: Inputs) -> str:
    """Return ``<problem>/<solver>-<run>-<key>``; a colon in a label becomes a full stop."""
    return f"{name_group(problem, solver)}-{number:04d}-{inputs.key}"


def name_group(problem: str, solver: str) -> str:
    """Return ``<problem>/<solver>``, with which the names of all runs of a solver on a problem begin."""
    return f"{problem}/{solver}".replace(":", ".")


def name_record(record: RunRecord) -> str:
    """Return the name of a record's file without suffix."""
    return name_run(record.problem, record.solver, record.run, record.inputs)


def write_record(record: RunRecord, folder: Path) -> Path:
    """Write a record to a study's folder and return its file; raises OutputError."""
    path = folder / RECORDS / f"{name_record(record)}.json"
    make_writable_folder(path.parent)
    write_json(path, record.to_json())
    return path


def write_records(records: Sequence[RunRecord], folder: Path) -> list[Path]:
    """Write records to a study's folder, make them part of the study, and return their files; raises as ``add_runs``."""
    paths = [write_record(record, make_writable_folder(folder)) for record in records]
    add_runs(folder, [name_record(record) for record in records])
    return paths


def read_each(folder: Path) -> list[tuple[Path, RunRecord | InputError]]:
    """Return files and records, damaged ones as their error; InputError if there are none.

    Those that ``study.json`` lists are read, in its order; all by their names, if it lists none.
    """
    listed = {folder / RECORDS / f"{name}.json": place for place, name in enumerate(read_study_file(folder).runs)}
    with convert_errors(f"folder {str(folder)!r} cannot be read", InputError):
        paths = [path for path in sorted((folder / RECORDS).glob("*/*.json")) if path in listed or not listed]
        paths.sort(key=lambda path: listed.get(path, 0))
    if not paths:
        raise InputError(f"{str(folder)!r} contains no records ({RECORDS}/<problem>/<solver>-<run>-<key>.json)")
    records: list[tuple[Path, RunRecord | InputError]] = []
    for path in paths:
        try:
            records.append((path, _read_named(path)))
        except InputError as error:
            records.append((path, error))
    return records


def read_records(folder: Path) -> tuple[list[RunRecord], list[str]]:
    """Return the records of a study in the order of ``read_each``, and a sentence for each damaged one; raises as that."""
    each = [record for _, record in read_each(folder)]
    return [r for r in each if isinstance(r, RunRecord)], [str(r) for r in each if isinstance(r, InputError)]


def _read_named(path: Path) -> RunRecord:
    """Return the record; one under another name than that of its inputs is refused, because it could count twice."""
    record = read_record(path)
    name = name_record(record)
    if path != path.parents[1] / f"{name}.json":
        raise InputError(f"record {str(path)!r} belongs to {name}.json; rename or delete it")
    return record


@dataclass(frozen=True, kw_only=True, repr=False)
class Study:
    """What to run."""

    runs: tuple[Run, ...]  #: in any order
    folder: Path | None = None  #: where records are written; None writes none
    jobs: int = 1  #: worker processes; 1 runs all but user code by name in this process
    scheduler: str | None = None  #: address of a Dask scheduler to use instead of local processes
    command: str = ""  #: that is written to the folder, for its report

    def __post_init__(self) -> None:
        """Validate the study."""
        if self.jobs < 1:
            raise InputError(f"jobs must be at least 1, got {self.jobs}")
        if not self.runs:
            raise InputError("a study needs at least one problem, one solver and one run")
        specs, names = dict[str, ProblemSpec](), set[tuple[str, str, int]]()
        for run in self.runs:
            problem, solver = run.problem.title, run.title
            remedy = "give them different labels"
            if specs.setdefault(problem, run.problem) != run.problem:
                raise InputError(f"two problems of the study are called {problem!r}; {remedy}")
            if (problem, solver, run.number) in names:
                raise InputError(f"two solvers of the study are called {solver!r} on {problem!r}; {remedy}")
            names.add((problem, solver, run.number))

    def __repr__(self) -> str:
        problems, solvers = dict.fromkeys(r.problem.title for r in self.runs), dict.fromkeys(r.title for r in self.runs)
        place = "without a folder" if self.folder is None else f"in {str(self.folder)!r}"
        return f"<Study of {', '.join(problems)} by {', '.join(solvers)}: {len(self.runs)} runs, {place}>"

    def check(self) -> None:
        """Raise now what would fail in every run of a solver, see ``check_run``."""
        by_number = sorted(self.runs, key=lambda run: run.number)  # the last one has the largest seed
        for run in {(r.problem.title, r.title): r for r in by_number}.values():
            check_run(run)
        for problem in {run.problem.title: run.problem for run in self.runs}.values():
            check_repeatable(problem)


def run_study(
    study: Study,
    progress: Callable[[RunRecord], None] = lambda record: None,
    on_stored: Callable[[int], None] = lambda count: None,
) -> list[RunRecord]:
    """Run all runs without a record and return the records of all runs, in their order.

    A record belongs to a run if their inputs are equal. Each record is written as soon as its run has ended, so an interruption
    loses only the runs in progress. The study in the folder then consists of these runs, and of those of other solvers.

    Args:
        study: what to run.
        progress: called with the record of each run that has ended.
        on_stored: called once with the number of runs that have a record.

    Raises:
        UnknownNameError, InputError: see ``check_run``; InputError also for a damaged record, or if a file changes meanwhile.
        OutputError: the folder is not writable (checked before the first run).
        WorkerError: no process can begin, or the cluster is lost.
        Interrupted: Ctrl-C; contains the records of the finished runs.
    """
    study.check()
    inputs = make_inputs(study.runs)
    records = _read_finished(study, inputs)
    on_stored(len(records))
    remedy = "rerun the same command to continue"
    try:
        for index, record in _run_missing(study, inputs, records):
            with delay_interrupts():
                if study.folder is not None:
                    write_record(record, study.folder)
                records[index] = record
            progress(record)
    except KeyboardInterrupt:
        finished = [records[index] for index in sorted(records)]
        raise Interrupted(f"interrupted after {len(finished)} of {len(study.runs)} runs", finished) from None
    except OutputError as error:
        raise OutputError(f"{error}; the {len(records)} runs before it are stored: fix this and {remedy}") from error
    except ChangedFileError as error:
        raise InputError(f"{error}; the {len(records)} runs before it are stored: {remedy}") from error
    return [records[index] for index in range(len(study.runs))]


def _read_finished(study: Study, inputs: Sequence[Inputs]) -> dict[int, RunRecord]:
    """Return the records by index of the run; list the runs."""
    if study.folder is None:
        return {}
    names = [name_run(r.problem.title, r.title, r.number, i) for r, i in zip(study.runs, inputs, strict=True)]
    paths = [study.folder / RECORDS / f"{name}.json" for name in names]
    for folder in {path.parent for path in paths}:
        make_writable_folder(folder)
    add_runs(study.folder, names, study.command)
    return {index: _read_named(path) for index, path in enumerate(paths) if path.exists()}


def _run_missing(
    study: Study, inputs: Sequence[Inputs], records: Mapping[int, RunRecord]
) -> Iterator[tuple[int, RunRecord]]:
    """Run what has no record; yield the indices and records as runs finish."""
    waiting = [index for index in range(len(study.runs)) if index not in records]
    # Long runs first, to balance the load; and runs of all problems in turn.
    waiting.sort(key=lambda index: (study.runs[index].is_search, study.runs[index].number))
    items = [(study.runs[index], inputs[index]) for index in waiting]
    if study.scheduler is None:
        _prepare([run for run, _ in items])
        results = _run_here(items, study.jobs)
    else:
        results = _run_on_cluster(items, study.scheduler)
    for position, record in results:
        yield waiting[position], record


def _prepare(runs: Sequence[Run]) -> None:
    """Compile once what pays for many runs: forks have it, other processes find it in the cache folder."""
    for run in {(r.problem.title, r.title): r for r in reversed(runs) if not r.is_search}.values():
        with suppress(GaitError):  # the records of the runs report it
            run.make_solver().prepare(run.problem.load(), PLANNED_RUNS)
    if any(run.is_user_code for run in runs):
        import scipy.linalg  # noqa: F401  which every process of a user's search would import

    for problem in {run.problem.title: run.problem for run in runs if run.is_search}.values():
        with suppress(GaitError):
            compile_objective(problem.load())


def _run_here(items: Sequence[Item], workers: int) -> Iterator[tuple[int, RunRecord]]:
    """Run items in any order, and yield the position and the record of each as it finishes."""
    jobs, isolated, places = list[Job](), dict[int, IsolatedRun](), list[int]()
    for position, (run, inputs) in enumerate(items):
        is_isolated = run.is_user_code and has_fork()
        movable = has_fork() or isinstance(run.problem.name, str)
        if not is_isolated and (workers == 1 or not movable):
            yield position, perform(run, inputs)
            continue
        if is_isolated:
            isolated[len(jobs)] = IsolatedRun(run=run, inputs=inputs)
        jobs.append(isolated[len(jobs)].make_job() if is_isolated else Job(call=partial(perform, run, inputs)))
        places.append(position)
    for number, result in run_jobs(jobs, workers):
        run, inputs = items[places[number]]
        if isinstance(result, ChangedFileError):
            raise result
        if number in isolated:
            result = isolated[number].conclude(result)
        elif isinstance(result, BaseException):
            result = make_failed(run, inputs, describe_error(result))
        yield places[number], result


def _run_on_cluster(items: Sequence[Item], scheduler: str) -> Iterator[tuple[int, RunRecord]]:
    """Run items on the workers of a Dask scheduler, which repeats the runs of a worker that dies.

    Files of user code and robots must have the same paths for the workers; relative ones start in the working folder of this
    process.

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
            futures = {client.submit(_perform_there, os.getcwd(), *item, pure=False): k for k, item in enumerate(items)}
            for future in as_completed(futures):
                yield futures[future], future.result()
        except Exception as error:  # of Dask, or of the worker's own Python, which may lack a package
            reason = " ".join(str(error).split())[:MOST_REASON]
            raise WorkerError(
                f"the Dask cluster at {scheduler!r} failed: {reason}; finished runs are stored: rerun the same command to "
                "continue. Its workers need the same nlp-gait and extras as this machine"
            ) from error


def _perform_there(folder: str, run: Run, inputs: Inputs) -> RunRecord:
    if os.path.isdir(folder):
        os.chdir(folder)
    (there,) = make_inputs([run])
    if there.key != inputs.key:
        raise WorkerError(
            "a worker has another version of nlp-gait or of your files than this machine; install the same"
        )
    return perform(run, inputs)
