"""Several starts in forked processes: the same outcomes in the same order, and no process outlives them."""

import multiprocessing
import os
import signal
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
import pytest

import nlp_gait
from nlp_gait.backends.solve import count_workers
from nlp_gait.backends.solvers.solver import Solver, judge_point
from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.solution import Evaluations, Outcome
from nlp_gait.interrupts import Interrupted, never
from tests.backends.toys import corner, toy

pytestmark = pytest.mark.skipif(not sys.platform.startswith("linux"), reason="starts are forked on Linux only")
WAIT_S = 30.0


@dataclass(frozen=True, kw_only=True)
class Scripted(Solver):
    """A solver that does one thing at the first start point and another at all others."""

    name: ClassVar[str] = "scripted"

    first: Array
    at_first: Callable[[], None] = lambda: None
    at_others: Callable[[Callable[[], bool]], None] = lambda stop: None

    def run(self, problem: GaitProblem, x0: Array, stop: Callable[[], bool] = never) -> Outcome:
        if np.array_equal(x0, self.first):
            self.at_first()
        else:
            self.at_others(stop)
        status = "was interrupted" if stop() else f"in process {os.getpid()}"
        nothing = Evaluations()
        return judge_point(
            self.name, problem, x0, x0, claimed=False, status=status, iterations=0, evaluations=nothing, time_s=0.0
        )


def _until(done: Callable[[], bool]) -> None:
    deadline = time.monotonic() + WAIT_S
    while not done() and time.monotonic() < deadline:
        time.sleep(0.005)


def test_processes_find_what_one_finds_and_report_in_order() -> None:
    problem = toy(corner)
    seen: list[Array] = []
    alone = nlp_gait.solve(problem, starts=5, seed=3, workers=1)
    divided = nlp_gait.solve(problem, starts=5, seed=3, workers=2, progress=lambda outcome: seen.append(outcome.x0))
    assert len(divided.starts) == 5
    for mine, theirs, x0 in zip(alone.starts, divided.starts, seen, strict=True):
        assert np.array_equal(mine.x0, theirs.x0) and np.array_equal(mine.x0, x0)
        assert np.array_equal(mine.x, theirs.x) and np.array_equal(mine.guess.rows, theirs.guess.rows)
        assert (mine.status, mine.iterations, mine.evaluations) == (
            theirs.status,
            theirs.iterations,
            theirs.evaluations,
        )
    assert alone.active_constraints == divided.active_constraints
    assert not multiprocessing.active_children()


def test_a_slow_first_start_keeps_its_place() -> None:
    """The others are done long before it, in another process, and wait."""
    problem = toy(corner)
    first = problem.start_point(np.random.default_rng(0))
    seen: list[str] = []
    done = multiprocessing.get_context("fork").Value("i", 0)

    def finish(stop: Callable[[], bool]) -> None:
        with done:
            done.value += 1

    solver = Scripted(first=first, at_first=lambda: _until(lambda: done.value == 3), at_others=finish)
    solution = nlp_gait.solve(problem, starts=4, solver=solver, workers=2, progress=lambda o: seen.append(o.status))
    assert np.array_equal(solution.starts[0].x0, first)
    assert len(set(seen)) == 2 and seen[1] == seen[2] == seen[3] != seen[0]


def test_short_runs_are_not_worth_a_fork_and_long_ones_are(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("os.sched_getaffinity", lambda process: {0, 1})
    problem = toy(corner)
    first = problem.start_point(np.random.default_rng(0))
    here = f"in process {os.getpid()}"
    nlp_gait.solve(problem, starts=1, solver=Scripted(first=first))  # builds what is built once
    short = nlp_gait.solve(problem, starts=3, solver=Scripted(first=first))
    assert [start.status for start in short.starts] == [here] * 3
    long = nlp_gait.solve(problem, starts=3, solver=Scripted(first=first, at_first=lambda: time.sleep(0.11)))
    assert long.starts[0].status == here and here not in {start.status for start in long.starts[1:]}


def test_an_interrupt_ends_all_processes_and_keeps_what_they_have() -> None:
    problem = toy(corner)
    first = problem.start_point(np.random.default_rng(0))
    solver = Scripted(first=first, at_others=_until)

    def press_once(outcome: Outcome) -> None:
        if outcome.status != "was interrupted":
            signal.raise_signal(signal.SIGINT)

    with pytest.raises(Interrupted, match="of 50") as caught:
        nlp_gait.solve(problem, starts=50, solver=solver, workers=2, progress=press_once)
    kept = caught.value.partial
    assert isinstance(kept, nlp_gait.Solution)
    assert np.array_equal(kept.starts[0].x0, first)
    assert 2 <= len(kept.starts) <= 3 and all(start.status == "was interrupted" for start in kept.starts[1:])
    assert not multiprocessing.active_children()


def solve_with_workers() -> int:
    return len(nlp_gait.solve(nlp_gait.load("walk12"), starts=2, workers=2).starts)


def test_a_worker_forks_no_workers_and_their_number_is_checked() -> None:
    with multiprocessing.get_context("fork").Pool(1) as pool:
        assert pool.apply(count_workers) == 1
        assert pool.apply(solve_with_workers) == 2
    with pytest.raises(InputError, match="workers must be a whole number >= 1"):
        nlp_gait.solve(toy(corner), workers=0)
