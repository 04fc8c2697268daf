"""Forked child processes: several that share some work, or one that is isolated. None of them outlives its parent.

A fork has everything that its parent has and starts within milliseconds; only its results are pickled.
"""

from __future__ import annotations

import ctypes
import mmap
import multiprocessing
import os
import signal
import sys
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any, NamedTuple, TypeVar

from nlp_gait.errors import WorkerError
from nlp_gait.interrupts import block_interrupts_in_children, never

T = TypeVar("T")

STOP_CHECKED_EVERY_S = 0.05
END_WITHIN_S = 5.0  # a child that is to end is killed after this time
COUNTER_BYTES = 8
PR_SET_PDEATHSIG = 1


class _Child(NamedTuple):
    process: BaseProcess
    results: Connection


def _fork(work: Callable[[Connection], None]) -> _Child:
    context = multiprocessing.get_context("fork")
    results, sender = context.Pipe(duplex=False)
    process = context.Process(target=work, args=(sender,), daemon=True)
    with warnings.catch_warnings():
        # Python warns of forks of a process with threads. The locks that the work takes are free in the child.
        warnings.simplefilter("ignore", DeprecationWarning)
        process.start()
    sender.close()
    return _Child(process, results)


def run_in_forks(
    work: Callable[[int, Callable[[], bool]], T], count: int, workers: int, stop: Callable[[], bool] = never
) -> Iterator[T]:
    """Yield work(0), ..., work(count - 1) in this order; after ``stop`` returns True, only those that were started.

    Args:
        work: receives its number, and a function that returns whether to end early. What it returns or raises is pickled.
        count: number of calls.
        workers: number of processes; each takes the next number that has not been taken.
        stop: checked in this process.

    Raises:
        WorkerError: a process died, perhaps out of memory.
    """
    # Anonymous memory: a Value would be a temporary file, for which there may be no space.
    lock, taken, ending = multiprocessing.get_context("fork").Lock(), mmap.mmap(-1, COUNTER_BYTES), mmap.mmap(-1, 1)
    parent = os.getpid()

    def is_ending() -> bool:
        return ending[0] != 0 or os.getppid() != parent

    def run(results: Connection) -> None:
        while not is_ending():
            with lock:
                number = int.from_bytes(taken[:], sys.byteorder)
                taken[:] = (number + 1).to_bytes(COUNTER_BYTES, sys.byteorder)
            if number >= count:
                break
            try:
                results.send((number, work(number, is_ending)))
            except Exception as error:
                results.send((number, error))
        results.close()

    def check_stop() -> None:
        if stop():
            ending[0] = 1

    children: list[_Child] = []
    try:
        with block_interrupts_in_children():
            for _ in range(workers):
                children.append(_fork(run))
        yield from _collect(children, check_stop)
    finally:
        ending[0] = 1
        for process, results in children:
            results.close()
            process.join(END_WITHIN_S)
            if process.is_alive():
                process.kill()
                process.join()


def _collect(children: Sequence[_Child], check_stop: Callable[[], None]) -> Iterator[Any]:
    """Yield the results of all children by their numbers."""
    early: dict[int, Any] = {}
    following = 0
    processes = {child.results: child.process for child in children}
    while processes:
        for results in wait(list(processes), timeout=STOP_CHECKED_EVERY_S):
            assert isinstance(results, Connection)
            try:
                number, result = results.recv()
                early[number] = result
            except EOFError:
                process = processes.pop(results)
                process.join()
                if process.exitcode:
                    raise WorkerError(
                        f"a worker process died with exit code {process.exitcode}, perhaps out of memory; use fewer workers"
                    ) from None
        check_stop()
        while following in early:
            yield _raise_errors(early.pop(following))
            following += 1
    for number in sorted(early):  # stopped: earlier ones are missing
        yield _raise_errors(early[number])


def _raise_errors(result: Any) -> Any:
    if isinstance(result, Exception):
        raise result
    return result


def run_in_isolation(call: Callable[[], bytes], time_limit_s: float | None, most_bytes: int) -> bytes:
    """Return what a call returns in a forked process with its own session, without input and output.

    The process and everything that it has started are killed at the end.

    Args:
        call: may hang, crash, exit or print.
        time_limit_s: None waits forever [s].
        most_bytes: longest result.

    Raises:
        TimeoutError: the time limit has passed.
        WorkerError: the process ended without a result; the message says how.
    """
    process, results = _fork(lambda sender: _isolate(sender, call))
    try:
        if not wait([results, process.sentinel], time_limit_s):
            raise TimeoutError
        data = b""
        with suppress(EOFError, OSError):
            data = results.recv_bytes(most_bytes) if results.poll(0) else b""
        if not data:
            process.join(END_WITHIN_S)
            code = process.exitcode or 0
            ending = f"signal {signal.Signals(-code).name}" if code < 0 else f"status {code}"
            raise WorkerError(f"its process ended without a result, by {ending}")
        return data
    finally:
        if process.pid is not None:
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(process.pid, signal.SIGKILL)
        process.kill()
        process.join()
        results.close()


def _isolate(sender: Connection, call: Callable[[], bytes]) -> None:
    os.setsid()
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    nowhere = os.open(os.devnull, os.O_RDWR)
    for descriptor in (0, 1, 2):
        os.dup2(nowhere, descriptor)
    # New streams: a lock of the old ones may be held by a thread that does not exist here.
    sys.stdout = sys.stderr = open(nowhere, "w", encoding="utf-8", errors="replace", closefd=False)  # noqa: SIM115
    sender.send_bytes(call())
    sender.close()
    os._exit(0)  # without the exit handlers of the parent
