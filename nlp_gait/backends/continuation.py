"""Solve a path of neighbouring problems, each from the end of the last one; nothing is rebuilt between them."""

from __future__ import annotations

import numpy as np

from nlp_gait.backends.ipopt import End, Guess, IpoptSettings, ipopt_for
from nlp_gait.backends.solution import Solution
from nlp_gait.backends.solve import outcome_of, solution_of
from nlp_gait.problems.gait_problem import Array, GaitProblem


class Continuation:
    """Follows an optimum over changing parameter values.

    The first problem is solved from random starts. Each later one is tried warm, from the neighbour's primal and dual
    solution with a low barrier; if that fails, cold from the neighbour's x; if that fails too, from random starts.

    Args:
        starts: number of random starts where there is no neighbour, or where it does not help.
        seed: of the random starts.
        settings: of IPOPT.
    """

    def __init__(self, *, starts: int = 5, seed: int = 0, settings: IpoptSettings | None = None) -> None:
        self._starts = starts
        self._seed = seed
        self._settings = settings or IpoptSettings()
        self._neighbour: tuple[Array, Guess] | None = None

    def solve(self, problem: GaitProblem) -> Solution:
        """Solution of the next problem on the path: a copy of the first one with other parameter values."""
        ipopt = ipopt_for(problem, self._settings)
        ends: list[End] = []
        points: list[Array] = []
        if self._neighbour is not None:
            x, guess = self._neighbour
            points.append(np.clip(x, problem.lower, problem.upper))
            ends.append(ipopt.run_from(problem, guess))
            if not ends[-1].success:
                points.append(points[-1])
                ends.append(ipopt.run(problem, points[-1]))
        if not (ends and ends[-1].success):
            rng = np.random.default_rng(self._seed)
            for _ in range(self._starts):
                points.append(problem.start_point(rng))
                ends.append(ipopt.run(problem, points[-1]))
        best = min((end for end in ends if end.success), key=lambda end: end.cost, default=None)
        if best is not None:
            self._neighbour = best.x, best.guess
        outcomes = [outcome_of(i, problem, x0, end) for i, (x0, end) in enumerate(zip(points, ends, strict=True))]
        return solution_of(problem, ipopt, ends, outcomes, self._seed)
