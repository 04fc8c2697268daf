"""Runs on the workers of a Dask scheduler."""

import logging
import os
from collections.abc import Iterator, Mapping

from compare.study.record import RunRecord
from compare.study.run_task import MOST_REASON, try_task
from compare.study.task import Task
from nlp_gait.errors import InputError, WorkerError
from nlp_gait.files import convert_errors

CONNECT_TIMEOUT = "10s"


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
