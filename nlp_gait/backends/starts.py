"""Runs of a solver from several start points, in forked processes where that pays; the outcomes are the same, in order.

A fork has the problem, its derivatives and the solver as they are, and begins within milliseconds; nothing needs to be pickled
but the outcomes. Threads would not do: CasADi and MUMPS work for one caller at a time (see ``problem/locking.py``).
"""

from __future__ import annotations

import mmap
import multiprocessing
import os
import sys
import threading
import time
import warnings
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from multiprocessing.connection import Connection, wait
from multiprocessing.process import BaseProcess

from nlp_gait.backends.exact import exact_model
from nlp_gait.backends.interrupts import children_ignore_interrupts, never
from nlp_gait.backends.kernel.compiled import available_cores
from nlp_gait.backends.solvers.solver import Solver
from nlp_gait.errors import WorkerError
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.solution import Outcome

# How often the parent looks whether Ctrl-C was pressed [s].
LOOK_EVERY_S = 0.05
END_WITHIN_S = 5.0
COUNTER_BYTES = 8
# Forking two processes and ending them costs 10 to 20 ms: it is done where what they divide takes ten times that.
FORK_PAYS_FROM_S = 0.2


def available_workers() -> int:
    """Processes that several starts are spread over unless told otherwise: one for each processor that this one may use.

    One, that is none beside this process, where a fork is not at hand or not safe: outside Linux, in another thread than the
    main one, and in a process that is somebody's worker already.
    """
    alone = (
        not sys.platform.startswith("linux")
        or threading.current_thread() is not threading.main_thread()
        or multiprocessing.parent_process() is not None
    )
    return 1 if alone else available_cores()


def run_starts(
    solver: Solver,
    problem: GaitProblem,
    points: Sequence[Array],
    stop: Callable[[], bool] = never,
    workers: int | None = None,
) -> Iterator[Outcome]:
    """Outcome of the run from each point, in their order; fewer once ``stop`` says to end.

    Args:
        solver: made ready for the problem.
        problem: with its current parameter values.
        points: (n,) each.
        stop: asked between iterations whether to end at once.
        workers: forked processes at most; 1 makes all runs in this one. None makes the first run here, and divides the others
            among ``available_workers`` if they take long enough.

    Raises:
        WorkerError: a process died, out of memory perhaps.
    """
    if workers is None and points:  # the first run says whether a fork pays for the others
        started = time.perf_counter()
        yield solver.run(problem, points[0], stop)
        points = points[1:]
        fork_pays = (time.perf_counter() - started) * len(points) >= FORK_PAYS_FROM_S
        workers = available_workers() if fork_pays else 1
        if stop():
            return
    count = min(workers or 1, len(points))
    if count <= 1:
        for point in points:
            yield solver.run(problem, point, stop)
            if stop():
                return
        return
    exact_model(problem)  # what every run needs is built before the fork
    with _Crew.at_work(solver, problem, points, count) as crew:
        yield from crew.outcomes(stop)


@dataclass(frozen=True, kw_only=True, eq=False)
class _Crew:
    """Forked processes, each of which takes the next start that nobody has taken.

    Attributes:
        count: of the starts.
        workers: each with what it sends its outcomes through.
        ending: one shared byte, not zero once all are to end.
    """

    count: int
    workers: tuple[tuple[BaseProcess, Connection], ...]
    ending: mmap.mmap

    @classmethod
    @contextmanager
    def at_work(cls, solver: Solver, problem: GaitProblem, points: Sequence[Array], count: int) -> Iterator[_Crew]:
        """Workers, which are gone in the end."""
        context = multiprocessing.get_context("fork")
        # Anonymous memory: a Value would be a temporary file, for which there may be no room.
        lock, taken, ending = context.Lock(), mmap.mmap(-1, COUNTER_BYTES), mmap.mmap(-1, 1)
        parent, workers = os.getpid(), []

        def asked_to_end() -> bool:
            return ending[0] != 0 or os.getppid() != parent

        def work(results: Connection) -> None:
            while not asked_to_end():
                with lock:
                    number = int.from_bytes(taken[:], sys.byteorder)
                    taken[:] = (number + 1).to_bytes(COUNTER_BYTES, sys.byteorder)
                if number >= len(points):
                    break
                try:
                    results.send((number, solver.run(problem, points[number], asked_to_end)))
                except Exception as error:
                    results.send((number, error))
            results.close()

        try:
            with children_ignore_interrupts(), warnings.catch_warnings():
                # Python warns of forks beside threads. The locks that a run takes are free in the child.
                warnings.simplefilter("ignore", DeprecationWarning)
                for _ in range(count):
                    here, there = context.Pipe(duplex=False)
                    worker = context.Process(target=work, args=(there,), daemon=True)
                    worker.start()
                    there.close()
                    workers.append((worker, here))
            yield cls(count=len(points), workers=tuple(workers), ending=ending)
        finally:
            ending[0] = 1
            for worker, here in workers:
                here.close()
                worker.join(END_WITHIN_S)
                if worker.is_alive():
                    worker.kill()
                    worker.join()

    def outcomes(self, stop: Callable[[], bool]) -> Iterator[Outcome]:
        """All outcomes in the order of the starts; those that were begun, after ``stop`` says to end."""
        early: dict[int, Outcome | Exception] = {}
        following = 0
        open_ends = {here: worker for worker, here in self.workers}
        while open_ends:
            for here in wait(list(open_ends), timeout=LOOK_EVERY_S):
                assert isinstance(here, Connection)
                try:
                    number, outcome = here.recv()
                    early[number] = outcome
                except EOFError:
                    worker = open_ends.pop(here)
                    worker.join()
                    if worker.exitcode:
                        raise WorkerError(
                            f"a process that ran a start died with exit code {worker.exitcode}, out of memory perhaps; "
                            "continue with fewer workers"
                        ) from None
            if stop():
                self.ending[0] = 1
            while following in early:
                yield _checked(early.pop(following))
                following += 1
        for number in sorted(early):  # interrupted: an earlier start was never finished
            yield _checked(early[number])


def _checked(outcome: Outcome | Exception) -> Outcome:
    if isinstance(outcome, Exception):
        raise outcome
    return outcome
