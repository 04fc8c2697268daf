"""Solves in threads and in forked processes against the same solves one after the other: not a bit may differ.

    python -m benchmarks.faults.together [--problem nao-ssp] [--threads 8] [--processes 4] [--solves 50]

Each thread and each process does all solves, each from another start point; the threads share one problem, and the forked
processes have it from their parent, which has compiled and solved before. IPOPT's functions are compiled ones too.
"""

from __future__ import annotations

import argparse
import multiprocessing
import sys
import time
from collections.abc import Callable
from concurrent.futures import Executor, ProcessPoolExecutor, ThreadPoolExecutor
from functools import partial
from typing import NamedTuple

import numpy as np

import nlp_gait
from nlp_gait.backends.solvers.ipopt import IpoptSettings
from nlp_gait.formulation import GaitProblem


class Found(NamedTuple):
    """Of one solve: verdict and point, with the compiled objective and the time histories there, as they were computed."""

    converged: bool
    status: str
    objective: float
    x: tuple[float, ...]
    compiled: tuple[float, float]
    signals: bytes


def solved(problem: GaitProblem, objective: nlp_gait.CompiledObjective, start: int) -> Found:
    """Solve from the start point with this number."""
    x0 = problem.start_point(np.random.default_rng(start))
    solution = nlp_gait.solve(problem, x0=x0, solver=IpoptSettings(compiled=True))
    f, violation = objective(solution.x)
    history = problem.signals(solution.x)
    return Found(
        solution.converged,
        solution.status,
        solution.objective,
        tuple(solution.x.values()),
        (float(f[0]), float(violation[0])),
        b"".join(array.tobytes() for array in history.arrays.values()),
    )


def all_solved(task: Callable[[int], Found], solves: int, first: int) -> list[Found]:
    """Return all solves, computed in cyclic order from a given number."""
    order = [(first + k) % solves for k in range(solves)]
    found = {start: task(start) for start in order}
    return [found[start] for start in range(solves)]


def different(pool: Executor, count: int, task: Callable[[int], Found], serial: list[Found]) -> int:
    """Return how many solves of all workers differ from the serial ones."""
    solves = len(serial)
    jobs = [pool.submit(all_solved, task, solves, worker * solves // count) for worker in range(count)]
    return sum(found != alone for job in jobs for found, alone in zip(job.result(), serial, strict=True))


def main(arguments: list[str] | None = None) -> int:
    """Print how many differ; return 1 if any does."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--problem", default="nao-ssp")
    parser.add_argument("--threads", type=int, default=8)
    parser.add_argument("--processes", type=int, default=4)
    parser.add_argument("--solves", type=int, default=50)
    chosen = parser.parse_args(arguments)
    problem = nlp_gait.load(chosen.problem)
    objective = nlp_gait.compile_objective(problem, threads=2)
    objective(np.random.default_rng(0).uniform(problem.lower, problem.upper, (5_000, len(problem.names))))
    task = partial(solved, problem, objective)
    began = time.perf_counter()
    serial = all_solved(task, chosen.solves, 0)
    print(f"{chosen.solves} solves of {chosen.problem}, one after the other: {time.perf_counter() - began:.1f} s")
    total = 0
    forked = multiprocessing.get_context("fork")
    pools: dict[str, tuple[int, Executor]] = {
        "threads": (chosen.threads, ThreadPoolExecutor(chosen.threads)),
        "forked processes": (chosen.processes, ProcessPoolExecutor(chosen.processes, mp_context=forked)),
    }
    for kind, (count, pool) in pools.items():
        began = time.perf_counter()
        with pool:
            wrong = different(pool, count, task, serial)
        print(f"{count} {kind} x {chosen.solves}: {wrong} differ; {time.perf_counter() - began:.1f} s", flush=True)
        total += wrong
    return 1 if total else 0


if __name__ == "__main__":
    sys.exit(main())
