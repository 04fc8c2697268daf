"""Runs on the workers of a Dask scheduler, to which the files of user code are sent."""

import logging
from collections.abc import Iterable, Iterator, Mapping, Sequence

from compare.study.record import RunRecord
from compare.study.run_task import MOST_REASON, try_task
from compare.study.task import Task
from nlp_gait.errors import InputError, WorkerError
from nlp_gait.files import convert_errors
from nlp_gait.user_code import Kind, PackedCode, is_user_code, pack_code, unpack_code

CONNECT_TIMEOUT = "10s"


def run_on_cluster(
    tasks: Mapping[int, tuple[Task, RunRecord | None]], scheduler: str
) -> Iterator[tuple[int, RunRecord]]:
    """Run tasks as ``run_tasks`` on the workers of a scheduler, and yield the key and the record of each as it finishes.

    The scheduler repeats the runs of a worker that dies.

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
    code = _pack_code(task for task, _ in tasks.values())
    with client:
        try:
            futures = {client.submit(_try_task, code, *call, pure=False): key for key, call in tasks.items()}
            for future in as_completed(futures):
                yield futures[future], future.result()
        except Exception as error:  # of Dask, or of the worker's own Python, which may lack a package
            reason = " ".join(str(error).split())[:MOST_REASON]
            raise WorkerError(
                f"the Dask cluster at {scheduler!r} failed: {reason}; finished runs are stored: rerun the same command to "
                "continue. Its workers need the same nlp-gait and extras as this machine"
            ) from error


def _try_task(code: Sequence[PackedCode], task: Task, search: RunRecord | None) -> RunRecord:
    for packed in code:
        unpack_code(packed)
    return try_task(task, search)


def _pack_code(tasks: Iterable[Task]) -> tuple[PackedCode, ...]:
    """Return the files of all user code that tasks name."""
    packed: dict[tuple[str, Kind], PackedCode | None] = {}
    for task in tasks:
        names: list[tuple[object, Kind]] = [(task.problem.name, "problem")]
        names += [(task.solver, "algorithm")] if task.is_user_code else []
        for name, kind in names:
            if isinstance(name, str) and is_user_code(name, kind) and (name, kind) not in packed:
                packed[name, kind] = pack_code(name, kind)
    return tuple(each for each in packed.values() if each is not None)
