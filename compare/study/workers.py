"""Runs in this process, in worker processes, or on a Dask cluster; the results are the same."""

from __future__ import annotations

import os
import threading
import time
import warnings
from collections.abc import Callable, Generator, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, ExitStack, contextmanager
from functools import partial
from typing import TypeVar

from compare.study.record import RunRecord
from compare.study.run_task import Run, run_task, try_task
from compare.study.task import Task
from nlp_gait.errors import InputError, WorkerError
from nlp_gait.files import convert_errors
from nlp_gait.interrupts import block_interrupts_in_children, remember_interrupts

K = TypeVar("K")
T = TypeVar("T")

# A study continues in new processes if one dies, unless they die so often without finishing any run.
DEATHS_WITHOUT_PROGRESS = 3
CONNECT_TIMEOUT = "10s"
PARENT_CHECKED_EVERY_S = 0.5

Job = tuple[Task, RunRecord | None]
"""A task, and the run that it polishes, if it does."""


def run_jobs(
    jobs: Sequence[Job], workers: int = 1, scheduler: str | None = None, run: Run = run_task
) -> Iterator[tuple[int, RunRecord]]:
    """Run jobs, and yield the position and the record of each as it finishes.

    Args:
        jobs: in the order in which they start.
        workers: processes; 1 runs in this process.
        scheduler: address of a Dask scheduler to use instead.
        run: performs one run.

    Raises:
        WorkerError: worker processes keep dying.
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
    deaths = 0
    with ExitStack() as stack:
        if scheduler is not None:
            stack.enter_context(_connect(scheduler))
        while waiting:
            try:
                calls = {position: partial(try_task, *job, run) for position, job in waiting.items()}
                for position, record in run_in_processes(calls, -1 if scheduler else workers):
                    del waiting[position]
                    deaths = 0
                    yield position, record
            except WorkerError as error:
                deaths += 1
                if deaths == DEATHS_WITHOUT_PROGRESS:
                    raise WorkerError(
                        f"a worker process died {deaths} times in a row, perhaps out of memory; finished runs are stored: "
                        "rerun with fewer --jobs to continue"
                    ) from error


def run_in_processes(calls: Mapping[K, Callable[[], T]], workers: int) -> Iterator[tuple[K, T]]:
    """Call picklable functions in worker processes; yield the key and the result of each as it finishes.

    Args:
        calls: functions by key.
        workers: number of processes; -1 takes all of joblib's backend.

    Raises:
        WorkerError: a worker process died, or none starts.
    """
    from joblib import Parallel, delayed  # costs 0.1 s to import
    from joblib.externals.loky.process_executor import TerminatedWorkerError

    # Dask's workers belong to its scheduler.
    begin = {} if workers < 0 else {"initializer": exit_with_parent, "initargs": (os.getpid(),)}
    parallel = Parallel(n_jobs=workers, return_as="generator_unordered", batch_size=1, **begin)
    results: Generator[tuple[K, T], None, None] | None = None
    try:
        with block_interrupts_in_children():
            folder = os.getcwd() if workers > 0 else None  # another machine has other folders
            results = parallel(delayed(_call)(key, call, folder) for key, call in calls.items())
        for result in results:  # noqa: UP028  `yield from` would close them before the lines below
            yield result
    except (TerminatedWorkerError, BrokenPipeError) as error:  # the pipe is joblib's own, to its processes
        raise WorkerError(
            "a worker process died, perhaps out of memory; finished results are stored: rerun to continue"
        ) from error
    finally:
        with warnings.catch_warnings(), _silence_manager():
            warnings.simplefilter("ignore")  # joblib reports calls that were cancelled
            if results is not None:
                results.close()


@contextmanager
def _silence_manager() -> Iterator[None]:
    """Hide the traceback of joblib's manager thread when calls are cancelled just as it hands one of them out."""
    before = threading.excepthook

    def hook(raised: threading.ExceptHookArgs) -> None:
        if not (raised.exc_type is KeyError and raised.thread and "ExecutorManager" in raised.thread.name):
            before(raised)

    threading.excepthook = hook
    try:
        yield
    finally:
        threading.excepthook = before


def exit_with_parent(parent: int) -> None:
    """Let this worker process end within a second of its parent, however that ends."""

    def watch() -> None:
        while os.getppid() == parent:
            time.sleep(PARENT_CHECKED_EVERY_S)
        os._exit(1)

    threading.Thread(target=watch, name="nlp-gait-parent", daemon=True).start()


def _call(key: K, call: Callable[[], T], folder: str | None) -> tuple[K, T]:
    """Call in the folder of the caller: a worker keeps that in which it was started, and paths may be relative."""
    if folder is not None and os.getcwd() != folder:
        os.chdir(folder)
    return key, call()


def _connect(address: str) -> AbstractContextManager[object]:
    """Connect to a Dask scheduler, and make it joblib's backend."""
    try:
        from distributed import Client
    except ImportError as error:
        raise InputError("--scheduler needs Dask: pip install 'nlp-gait[cluster]'") from error
    from joblib import parallel_config

    stack = ExitStack()
    with convert_errors(f"no Dask scheduler answers at {address!r}", InputError, "start one with `dask scheduler`"):
        stack.enter_context(Client(address, timeout=CONNECT_TIMEOUT, set_as_default=True))
    stack.enter_context(parallel_config(backend="dask"))
    return stack
