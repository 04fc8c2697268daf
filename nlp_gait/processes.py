"""Child processes: forks that share some work, one isolated fork, or joblib's workers. None of them outlives its parent.

A fork has everything that its parent has and starts within milliseconds; only its results are pickled. Workers start afresh:
their functions are pickled too. Python files in the working folder never run by themselves.
"""

import ctypes
import math
import mmap
import multiprocessing
import os
import signal
import sys
import threading
import time
import warnings
from collections.abc import Callable, Generator, Iterator, Mapping
from contextlib import ExitStack, contextmanager, suppress
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess
from typing import Any, TypeVar

from nlp_gait.errors import NoWorkersError, WorkerError, describe_shortage
from nlp_gait.interrupts import block_interrupts_in_children, never

K = TypeVar("K")
T = TypeVar("T")

PARENT_CHECKED_EVERY_S = 0.5
STOP_CHECKED_EVERY_S = 0.05
END_WITHIN_S = 5.0  # a child that is to end is killed after this time
COUNTER_BYTES = 8
# Warnings of joblib's resource tracker, which removes what killed workers leave behind, about what is gone already.
HIDDEN_WARNINGS = "ignore:resource_tracker"
SPARE_DESCRIPTORS = 12  # that joblib needs beside one for each worker
PR_SET_PDEATHSIG = 1
QUESTION = b"?"  # first byte of a message of an isolated process that is no result
VARIABLE = "PYTHONSAFEPATH"  # any text: Python searches no module in the working folder
OWN_VALUE = "nlp-gait"


def hide_working_folder() -> None:
    """Let all child processes search no module in the working folder: ``python -c`` and ``-m`` would search there first."""
    if not os.environ.get(VARIABLE):
        os.environ[VARIABLE] = OWN_VALUE


def show_working_folder() -> None:
    """Undo ``hide_working_folder`` for programs that user code starts, which may be Python files with modules next to them."""
    if os.environ.get(VARIABLE) == OWN_VALUE:
        del os.environ[VARIABLE]


@contextmanager
def keep_working_folder() -> Iterator[None]:
    """Return to the working folder at the end, for code that may leave it."""
    folder = os.open(".", os.O_RDONLY) if os.name == "posix" else os.getcwd()
    try:
        yield
    finally:
        os.chdir(folder)
        if isinstance(folder, int):
            os.close(folder)


def has_fork() -> bool:
    """Return whether this process may fork: not on Windows, and not in workers of multiprocessing.Pool and Dask."""
    return "fork" in multiprocessing.get_all_start_methods() and not multiprocessing.current_process().daemon


def _fork(work: Callable[[Connection], None]) -> tuple[Connection, BaseProcess]:
    context = multiprocessing.get_context("fork")
    results, sender = context.Pipe()

    def begin() -> None:
        multiprocessing.current_process().daemon = False  # it may fork, too: a robot file is read in a child
        work(sender)

    process = context.Process(target=begin, daemon=True)
    with warnings.catch_warnings():
        # Python warns of forks of a process with threads. The locks that the work takes are free in the child.
        warnings.simplefilter("ignore", DeprecationWarning)
        process.start()
    sender.close()
    return results, process


def run_in_forks(
    work: Callable[[int, Callable[[], bool]], T], count: int, workers: int, stop: Callable[[], bool] = never
) -> Iterator[T]:
    """Yield work(0), ..., work(count - 1) in this order; after ``stop`` returns True, only those that were started.

    ``work`` receives its number, and a function that returns whether to end early; what it returns or raises is pickled. Each of
    the processes takes the next number. Raises WorkerError if one died, perhaps out of memory.
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

    children: list[tuple[Connection, BaseProcess]] = []
    try:
        with block_interrupts_in_children():
            for _ in range(workers):
                children.append(_fork(run))
        for result in _collect(dict(children), check_stop):
            if isinstance(result, Exception):
                raise result
            yield result
    finally:
        ending[0] = 1
        for results, process in children:
            results.close()
            process.join(END_WITHIN_S)
            if process.is_alive():
                process.kill()
                process.join()


def _collect(processes: dict[Connection, BaseProcess], check_stop: Callable[[], None]) -> Iterator[Any]:
    """Yield what all children return or raise, by their numbers."""
    early: dict[int, Any] = {}
    following = 0
    while processes:
        for results in wait(list(processes), timeout=STOP_CHECKED_EVERY_S):
            assert isinstance(results, Connection)
            try:
                early.update([results.recv()])
            except EOFError:
                process = processes.pop(results)
                process.join()
                if process.exitcode:
                    raise WorkerError(
                        f"a worker process died with exit code {process.exitcode}, perhaps out of memory; use fewer workers"
                    ) from None
        check_stop()
        while following in early:
            yield early.pop(following)
            following += 1
    yield from (early[number] for number in sorted(early))  # stopped: earlier ones are missing


def run_in_isolation(
    call: Callable[..., bytes],
    time_limit_s: float | None,
    most_bytes: int,
    memory_bytes: int | None = None,
    answer: Callable[[bytes], bytes] | None = None,
    stop: Callable[[], bool] = never,
) -> bytes:
    """Return what a call returns, at most so many bytes, in a forked process with its own session, without input and output.

    The call may hang, crash, exit or print. Its process and everything that it has started are killed at the end.
    With ``memory_bytes``, it may take so much address space beyond what this process has (Linux only). With ``answer``, the call
    receives a function by which it asks this process. Raises TimeoutError after the time limit or once ``stop`` returns True, and
    WorkerError, which says how, if the process ended without a result.
    """
    results, process = _fork(lambda sender: _isolate(sender, call, memory_bytes, answer is not None))
    latest = math.inf if time_limit_s is None else time.monotonic() + time_limit_s
    try:
        while True:
            while not wait([results, process.sentinel], STOP_CHECKED_EVERY_S):
                if time.monotonic() > latest or stop():
                    raise TimeoutError
            data = b""
            with suppress(EOFError, OSError):
                data = results.recv_bytes(most_bytes) if results.poll(0) else b""
            if answer is None or data[:1] != QUESTION:
                break
            with suppress(BrokenPipeError):
                results.send_bytes(answer(data[1:]))
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


def _isolate(sender: Connection, call: Callable[..., bytes], memory_bytes: int | None, may_ask: bool) -> None:
    def ask(question: bytes) -> bytes:
        sender.send_bytes(QUESTION + question)
        return sender.recv_bytes()

    show_working_folder()
    os.setsid()
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
        if memory_bytes is not None:
            import resource

            with open("/proc/self/statm", encoding="ascii") as file:
                most = int(file.read().split()[0]) * mmap.PAGESIZE + memory_bytes
            _, hard = resource.getrlimit(resource.RLIMIT_AS)
            resource.setrlimit(resource.RLIMIT_AS, (most if hard == resource.RLIM_INFINITY else min(most, hard), hard))
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    nowhere = os.open(os.devnull, os.O_RDWR)
    for descriptor in (0, 1, 2):
        os.dup2(nowhere, descriptor)
    # New streams: a lock of the old ones may be held by a thread that does not exist here.
    sys.stdout = sys.stderr = open(nowhere, "w", encoding="utf-8", errors="replace", closefd=False)  # noqa: SIM115
    sender.send_bytes(call(ask) if may_ask else call())
    sender.close()
    os._exit(0)  # without the exit handlers of the parent


def run_in_processes(calls: Mapping[K, Callable[[], T]], workers: int) -> Iterator[tuple[K, T]]:
    """Call picklable functions in so many processes; yield key and result as each finishes; raises WorkerError if one dies."""
    from joblib import Parallel, delayed  # costs 0.1 s to import
    from joblib.externals.loky.process_executor import TerminatedWorkerError

    if HIDDEN_WARNINGS not in sys.warnoptions:  # which joblib's processes inherit
        sys.warnoptions.append(HIDDEN_WARNINGS)
    begin = {"initializer": exit_with_parent, "initargs": (os.getpid(),)}
    parallel = Parallel(n_jobs=workers, return_as="generator_unordered", batch_size=1, **begin)
    results: Generator[tuple[K, T], None, None] | None = None
    try:
        with block_interrupts_in_children():
            try:
                folder = os.getcwd()
            except OSError as error:
                raise NoWorkersError(
                    f"worker processes cannot begin: the working folder is gone ({error.strerror}); use another"
                ) from error
            try:
                with ExitStack() as opened:  # can this process open so many more files?
                    for _ in range(workers + SPARE_DESCRIPTORS):
                        opened.callback(os.close, os.open(os.devnull, os.O_RDONLY))
                results = parallel(delayed(_call)(key, call, folder) for key, call in calls.items())
            except Exception as error:
                shortage = describe_shortage(error) or (isinstance(error, OSError) and (error.strerror or error))
                if not shortage:
                    raise
                kill_children()
                raise NoWorkersError(f"worker processes cannot begin: {shortage}; use fewer --jobs") from error
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


def kill_children() -> None:
    """Kill workers that have begun; else each would print a traceback when it finds that this process has ended."""
    for child in multiprocessing.active_children():
        if child.pid is not None:
            with suppress(ProcessLookupError):
                os.kill(child.pid, signal.SIGKILL)  # joblib's processes have no method for it


def _call(key: K, call: Callable[[], T], folder: str) -> tuple[K, T]:
    """Call in the folder of the caller: a worker keeps that in which it was started, and paths may be relative."""
    if os.getcwd() != folder:
        os.chdir(folder)
    return key, call()
