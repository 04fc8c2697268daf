"""Child processes: a pool of jobs, each with a time limit, and forks that share work. None of them outlives its parent.

A fork has everything that its parent has and starts within milliseconds; only results are pickled. Where there is no fork
(Windows), jobs are pickled, too.
"""

import ctypes
import mmap
import multiprocessing
import os
import signal
import sys
import warnings
from collections import deque
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from multiprocessing import resource_tracker
from multiprocessing.connection import Connection, wait
from typing import Any, TypeVar

from nlp_gait.errors import NoWorkersError, WorkerError, describe_shortage
from nlp_gait.interrupts import block_interrupts_in_children, never

T = TypeVar("T")

CHECKED_EVERY_S = 0.05
PARENT_CHECKED_EVERY_S = 0.5
END_WITHIN_S = 5.0  # a child that is to end is killed after this time
PR_SET_PDEATHSIG = 1


def has_fork() -> bool:
    """Return whether this process may fork: not on Windows, and not in workers of multiprocessing.Pool and Dask."""
    return "fork" in multiprocessing.get_all_start_methods() and not multiprocessing.current_process().daemon


@dataclass(frozen=True, kw_only=True)
class Job:
    """A call in another process; where there are no forks it is pickled."""

    #: Receives a function that sends a picklable message to this process, and returns something picklable
    call: Callable[[Callable[[Any], None]], Any]
    receive: Callable[[Any], None] = lambda message: None  #: receives the messages
    is_late: Callable[[], bool] = never  #: whether to kill its process now, asked from its start
    #: In a process and session of its own, without input and output, that is killed at the end with all that it has started
    alone: bool = False


@dataclass(kw_only=True)
class _Worker:
    """A child process and its job."""

    process: Any
    pipe: Connection
    job: Job
    number: int = 0

    def end(self) -> None:
        """Kill the process, and of a job that runs alone all that it has started."""
        if self.job.alone:
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(self.process.pid, signal.SIGKILL)
        self.process.kill()
        self.process.join()
        self.pipe.close()

    def listen(self) -> tuple[bool, Any]:
        """Return whether the job has ended, and what it returned, or its error."""
        try:
            while self.pipe.poll():
                is_result, value = self.pipe.recv()
                if is_result:
                    return True, value
                self.job.receive(value)
            if not self.process.is_alive() and not self.pipe.poll():  # what it has started may hold its pipe
                raise EOFError
        except (EOFError, OSError):
            self.process.join(END_WITHIN_S)
            code = self.process.exitcode or 0
            ending = f"signal {signal.Signals(-code).name}" if code < 0 else f"status {code}"
            return True, WorkerError(f"its process ended without a result, by {ending}")
        except Exception as error:
            return True, WorkerError(f"its process sent something that cannot be read: {error}")
        is_late = self.job.is_late()
        return is_late, TimeoutError() if is_late else None


def run_jobs(
    jobs: Sequence[Job], workers: int = 1, stop: Callable[[], bool] = never, method: str | None = None
) -> Iterator[tuple[int, Any]]:
    """Run jobs in so many processes; yield the number of each and what it returned, or its exception, as it ends.

    A job that ends its process yields a WorkerError, and one that is late a TimeoutError; the others continue.
    Once ``stop`` returns True, no more jobs are started. ``method`` is that of multiprocessing, by default fork where there is
    one. Raises NoWorkersError if processes cannot begin.
    """
    context = multiprocessing.get_context(method or ("fork" if has_fork() else "spawn"))
    waiting, active, idle = deque(range(len(jobs))), list[_Worker](), list[_Worker]()
    stopped = False
    try:
        while active or (waiting and not stopped):
            stopped = stopped or stop()
            while waiting and len(active) < workers and not stopped:
                job = jobs[waiting[0]]
                worker = idle.pop() if idle and not job.alone else _start_worker(context, jobs, job)
                worker.job, worker.number = job, waiting.popleft()
                active.append(worker)
                with suppress(OSError):  # it has died, which is found below
                    worker.pipe.send(worker.number)
            wait([worker.pipe for worker in active], CHECKED_EVERY_S)
            for worker in [*active]:
                is_over, result = worker.listen()
                if is_over:
                    active.remove(worker)
                    if worker.job.alone or not worker.process.is_alive() or isinstance(result, TimeoutError):
                        worker.end()
                    else:
                        idle.append(worker)
                    yield worker.number, result
    finally:
        for worker in (*active, *idle):
            worker.end()


def _start_worker(context: Any, jobs: Sequence[Job], job: Job) -> _Worker:
    is_fork = context.get_start_method() == "fork"
    if not is_fork and os.name == "posix":
        resource_tracker.ensure_running()  # started with the first worker, it would unblock Ctrl-C
    calls = [item.call for item in jobs] if is_fork or not job.alone else {jobs.index(job): job.call}
    try:
        pipe, other = context.Pipe()
        arguments = (other, calls, job.alone, os.getpid())
        process = context.Process(target=_serve, args=arguments, daemon=True)
        with warnings.catch_warnings(), block_interrupts_in_children():
            # Python warns of forks of a process with threads. The locks that the work takes are free in the child.
            warnings.simplefilter("ignore", DeprecationWarning)
            process.start()
    except OSError as error:
        shortage = describe_shortage(error) or error.strerror or error
        raise NoWorkersError(f"worker processes cannot begin: {shortage}; use fewer --jobs") from error
    other.close()
    return _Worker(process=process, pipe=pipe, job=job)


def _serve(pipe: Connection, calls: Any, alone: bool, parent: int) -> None:
    """Perform the calls whose numbers arrive, until the parent has ended."""
    multiprocessing.current_process().daemon = False  # it may fork, too: a solver runs alone
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    if alone:
        _isolate()
    with suppress(EOFError, OSError):
        while pipe.poll(PARENT_CHECKED_EVERY_S) or os.getppid() == parent:
            if not pipe.poll():
                continue
            call = calls[pipe.recv()]
            result: Any
            try:
                result = call(lambda message: pipe.send((False, message)))
            except BaseException as error:  # user code may raise anything
                result = error
            try:
                pipe.send((True, result))
            except Exception as error:  # it cannot be pickled
                pipe.send((True, WorkerError(f"{type(result).__name__}: {result} ({error})")))
    os._exit(0)  # without the exit handlers of the parent


def _isolate() -> None:
    """Give this process a session and null streams."""
    if hasattr(os, "setsid"):
        os.setsid()
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    nowhere = os.open(os.devnull, os.O_RDWR)
    for descriptor in (0, 1, 2):
        os.dup2(nowhere, descriptor)
    # New streams: a lock of the old ones may be held by a thread that does not exist here.
    sys.stdout = sys.stderr = open(nowhere, "w", encoding="utf-8", errors="replace", closefd=False)  # noqa: SIM115


def run_alone(
    call: Callable[[Callable[[Any], None]], T],
    is_late: Callable[[], bool] = never,
    receive: Callable[[Any], None] = lambda message: None,
) -> T:
    """Return what a call returns that runs alone, see ``Job``; raises as the call, WorkerError and TimeoutError."""
    job = Job(call=call, is_late=is_late, receive=receive, alone=True)
    ((_, result),) = run_jobs([job])
    if isinstance(result, BaseException):
        raise result
    value: T = result
    return value


def run_in_forks(
    work: Callable[[int, Callable[[], bool]], T], count: int, workers: int, stop: Callable[[], bool] = never
) -> Iterator[T]:
    """Yield work(0), ..., work(count - 1) in this order; after ``stop`` returns True, only those that were started.

    ``work`` receives its number, and a function that returns whether to end early. Raises what it raises, and WorkerError if a
    process died.
    """
    ending = mmap.mmap(-1, 1)  # anonymous memory: a Value would be a temporary file, for which there may be no space

    def check() -> bool:
        ending[0] = ending[0] or stop()
        return ending[0] != 0

    jobs = [Job(call=lambda _, k=k: work(k, lambda: ending[0] != 0)) for k in range(count)]  # type: ignore[misc]
    early: dict[int, T] = {}
    following = 0
    for number, result in run_jobs(jobs, workers, check):
        if isinstance(result, BaseException):
            raise result
        early[number] = result
        while following in early:
            yield early.pop(following)
            following += 1
    yield from (early[number] for number in sorted(early))  # stopped: earlier ones are missing


def kill_children() -> None:
    """Kill workers that have begun; otherwise each would print a traceback when it finds that this process has ended."""
    for child in multiprocessing.active_children():
        child.kill()
