"""Solve a path of neighbouring problems, each from the end of the last one; nothing is rebuilt between them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np

from nlp_gait.backends.interrupts import Interrupted, deferred_interrupts, never
from nlp_gait.backends.solve import outcome_of, solution_of
from nlp_gait.backends.solvers.ipopt import IpoptSettings, ipopt_for
from nlp_gait.backends.solvers.ipopt_end import End
from nlp_gait.problem import Array, GaitProblem
from nlp_gait.problem.solution import Solution


class Attempt(NamedTuple):
    """One run of IPOPT: where it began (n,) and where it ended."""

    x0: Array
    end: End


class Continuation:
    """Follows an optimum over changing parameter values, in one direction.

    The first problem is solved from random starts. Each later one is tried warm, from the neighbour's primal and dual
    solution; if that fails, cold from the neighbour's x; if that fails too, from random starts.

    Args:
        starts: number of random starts where there is no neighbour, or where it does not help.
        seed: of the random starts.
        settings: of IPOPT.
        solves: how many are planned, which decides whether compiling pays if the settings leave it open.
    """

    def __init__(
        self, *, starts: int = 5, seed: int = 0, settings: IpoptSettings | None = None, solves: int = 1
    ) -> None:
        self._starts = starts
        self._seed = seed
        self._settings = settings or IpoptSettings()
        self._solves = solves
        self._neighbour: End | None = None

    def solve(self, problem: GaitProblem) -> Solution:
        """Solution of the next problem on the path: a copy of the first one with other parameter values."""
        return self.solution(problem, self.run(problem))

    def run(
        self, problem: GaitProblem, earlier: Sequence[Attempt] = (), stop: Callable[[], bool] = never
    ) -> list[Attempt]:
        """Attempts at the next problem; the best of these and the earlier ones is the next problem's neighbour.

        Args:
            problem: a copy of the first one with other parameter values.
            earlier: attempts at the same problem from elsewhere. Random starts are not repeated where they were in vain.
            stop: asked after each iteration whether to end at once.
        """
        ipopt = ipopt_for(problem, self._settings, self._solves)
        attempts: list[Attempt] = []
        if self._neighbour is not None:
            x0 = np.clip(self._neighbour.x, problem.lower, problem.upper)
            attempts.append(Attempt(x0, ipopt.run_from(problem, self._neighbour.guess, stop)))
            if not attempts[-1].end.success and not stop():
                attempts.append(Attempt(x0, ipopt.run(problem, x0, stop)))
        in_vain = bool(earlier) and best_end(earlier) is None
        if best_end(attempts) is None and not in_vain and (self._neighbour is None or not earlier):
            rng = np.random.default_rng(self._seed)
            points = [problem.start_point(rng) for _ in range(self._starts)]
            attempts += [Attempt(x0, ipopt.run(problem, x0, stop)) for x0 in points if not stop()]
        self._neighbour = best_end([*earlier, *attempts]) or self._neighbour
        return attempts

    def solution(self, problem: GaitProblem, attempts: Sequence[Attempt]) -> Solution:
        """Solution of a problem from all attempts at it."""
        outcomes = [outcome_of(i, problem, x0, end) for i, (x0, end) in enumerate(attempts)]
        ends = [attempt.end for attempt in attempts]
        return solution_of(problem, ipopt_for(problem, self._settings, self._solves), ends, outcomes, self._seed)


def best_end(attempts: Sequence[Attempt]) -> End | None:
    """Cheapest end that is feasible, if there is one."""
    return min((a.end for a in attempts if a.end.success), key=lambda end: end.cost, default=None)


def solve_both_ways(
    problems: Sequence[GaitProblem],
    *,
    starts: int = 5,
    seed: int = 0,
    settings: IpoptSettings | None = None,
    progress: Callable[[], None] | None = None,
) -> list[Solution]:
    """Solutions of a path of neighbouring problems, followed forwards and backwards; the better one counts.

    Where a local optimum stops being the best one, a path followed in one direction stays on it for a while; followed the
    other way it arrives on the other one.

    Args:
        problems: copies of one problem with other parameter values, neighbours side by side.
        starts: number of random starts at both ends of the path, and where no neighbour helps.
        seed: of the random starts.
        settings: of IPOPT.
        progress: called after each problem, twice as often as there are problems.

    Raises:
        Interrupted: Ctrl-C; carries the solutions from the attempts until then, None for problems without any.
    """
    order = range(len(problems))
    attempts: list[list[Attempt]] = [[] for _ in problems]
    with deferred_interrupts() as interrupted:
        for path_seed, direction in ((seed, order), (seed + 1, order[::-1])):
            path = Continuation(starts=starts, seed=path_seed, settings=settings, solves=2 * len(problems))
            for k in direction:
                if interrupted():
                    break
                attempts[k] += path.run(problems[k], attempts[k], interrupted)
                if progress is not None:
                    progress()
    if interrupted():
        tried = [path.solution(p, found) if found else None for p, found in zip(problems, attempts, strict=True)]
        count = sum(solution is not None for solution in tried)
        raise Interrupted(f"interrupted after {count} of {len(problems)} points", tried)
    return [path.solution(problem, found) for problem, found in zip(problems, attempts, strict=True)]
