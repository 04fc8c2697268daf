"""Runs in this process, in worker processes, or on a Dask cluster; the results are the same."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import AbstractContextManager, ExitStack
from functools import partial

from compare.study.record import RunRecord
from compare.study.run_task import Run, run_task, try_task
from compare.study.task import Task
from nlp_gait.errors import InputError, NoWorkersError, WorkerError
from nlp_gait.files import convert_errors
from nlp_gait.interrupts import remember_interrupts
from nlp_gait.processes import run_in_processes

# A study continues in new processes if one dies, unless they die so often without finishing any run.
DEATHS_WITHOUT_PROGRESS = 3
CONNECT_TIMEOUT = "10s"

Job = tuple[Task, RunRecord | None]
"""A task, and the run that it polishes, if it does."""


def run_jobs(
    jobs: Sequence[Job], workers: int = 1, scheduler: str | None = None, run: Run = run_task
) -> Iterator[tuple[int, RunRecord]]:
    """Run jobs in their order, and yield the position and the record of each as it finishes.

    One worker is this process; the address of a Dask scheduler stands for its workers instead.

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
                for position, record in run_in_processes(calls, -1 if scheduler else min(workers, len(calls))):
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


def _connect(address: str) -> AbstractContextManager[object]:
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
