"""Runs of a solver from several start points, in forked processes where that pays; the outcomes are the same, in order.

Threads are no alternative: CasADi and MUMPS work for one caller at a time (see ``formulation/locking.py``).
"""

from __future__ import annotations

import multiprocessing
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence

from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.kernel.compiled import available_cores
from nlp_gait.backends.solvers.solver import Solver
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.solution import Outcome
from nlp_gait.interrupts import never
from nlp_gait.processes import run_in_forks

# Forking two processes and ending them costs 10 to 20 ms; it pays where the work that they share takes ten times as long.
FORK_PAYS_FROM_S = 0.2


def available_workers() -> int:
    """Return the default number of processes for several starts: one for each processor that this process may use.

    1 where a fork is not available or not safe: outside Linux, in another thread than the main one, and in worker processes.
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
    """Yield the outcome of the run from each point (n,), in their order; fewer after ``stop`` returns True.

    Without ``workers``, the first run is made in this process, and the others are divided among ``available_workers`` if they
    take long enough. Raises WorkerError if a process died, perhaps out of memory.
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
    if count > 1:
        build_exact_model(problem)  # every run needs it: built before the fork
        yield from run_in_forks(
            lambda k, is_ending: solver.run(problem, points[k], is_ending), len(points), count, stop
        )
        return
    for point in points:
        yield solver.run(problem, point, stop)
        if stop():
            return
