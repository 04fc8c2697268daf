"""Solutions of a path of neighbouring problems, each from the last solution; nothing is rebuilt between them."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from nlp_gait.backends.solve import MOST_STARTS, make_solution, run_starts
from nlp_gait.backends.solvers.ipopt import IpoptSettings
from nlp_gait.backends.solvers.solver import Solver
from nlp_gait.errors import check_count
from nlp_gait.formulation import GaitProblem
from nlp_gait.formulation.solution import Outcome, Solution
from nlp_gait.interrupts import Interrupted, defer_interrupts, never


class Continuation:
    """Follows an optimum over changing parameter values, in one direction.

    The first problem is solved from random starts. Each later one is tried warm, from the neighbour's primal and dual
    solution, if the solver has one; if that fails, cold from the neighbour's x; if that fails too, from random starts.
    ``solves``, the planned number of solves, decides whether compilation pays if the solver's settings do not.
    """

    def __init__(self, *, starts: int = 5, seed: int = 0, solver: Solver | None = None, solves: int = 1) -> None:
        self._starts = check_count("starts", starts, at_least=0, at_most=MOST_STARTS)
        self._seed = seed
        self._solver = solver or IpoptSettings()
        self._solves = solves
        self._neighbour: Outcome | None = None

    def solve(self, problem: GaitProblem) -> Solution:
        """Return the solution of the next problem on the path, a copy of the first one with other parameter values."""
        return make_solution(problem, self.run(problem), self._seed)

    def run(
        self, problem: GaitProblem, earlier: Sequence[Outcome] = (), stop: Callable[[], bool] = never
    ) -> list[Outcome]:
        """Return runs of the next problem; the best of these and the earlier runs is the neighbour of the next problem.

        ``earlier`` are runs of the same problem on another path; random starts without success are not repeated. ``stop`` is
        called after each iteration, and returns whether to end at once.
        """
        solver, near = self._solver.prepare(problem, self._solves), self._neighbour
        outcomes: list[Outcome] = []
        if near is not None:
            warm = solver.run_from(problem, near, stop)
            outcomes += [] if warm is None else [warm]
            if find_cheapest_feasible(outcomes) is None and not stop():
                outcomes.append(solver.run(problem, np.clip(near.x, problem.lower, problem.upper), stop))
        in_vain = bool(earlier) and find_cheapest_feasible(earlier) is None
        if find_cheapest_feasible(outcomes) is None and not in_vain and (near is None or not earlier):
            rng = np.random.default_rng(self._seed)
            points = [problem.start_point(rng) for _ in range(self._starts)]
            outcomes += run_starts(solver, problem, points, stop)
        self._neighbour = find_cheapest_feasible([*earlier, *outcomes]) or near
        return outcomes


def find_cheapest_feasible(outcomes: Sequence[Outcome]) -> Outcome | None:
    """Cheapest outcome that succeeded, if there is one."""
    return min((outcome for outcome in outcomes if outcome.converged), key=lambda found: found.cost, default=None)


def solve_both_ways(
    problems: Sequence[GaitProblem],
    *,
    starts: int = 5,
    seed: int = 0,
    solver: Solver | None = None,
    progress: Callable[[], None] | None = None,
) -> list[Solution]:
    """Solve a path of neighbouring problems forwards and backwards, and return the better solution of each.

    Where a local optimum ceases to be the best one, a path in one direction stays on it for a while; in the other direction it
    arrives on the other optimum. The arguments are those of ``Continuation``, and progress is called twice for each problem.

    Raises:
        Interrupted: Ctrl-C; carries the solutions so far, None for problems without a run.
    """
    order = range(len(problems))
    outcomes: list[list[Outcome]] = [[] for _ in problems]
    with defer_interrupts() as interrupted:
        for path_seed, direction in ((seed, order), (seed + 1, order[::-1])):
            path = Continuation(starts=starts, seed=path_seed, solver=solver, solves=2 * len(problems))
            for k in direction:
                if interrupted():
                    break
                outcomes[k] += path.run(problems[k], outcomes[k], interrupted)
                if progress is not None:
                    progress()
    tried = [make_solution(p, found, seed + 1) if found else None for p, found in zip(problems, outcomes, strict=True)]
    solutions = [solution for solution in tried if solution is not None]
    if interrupted():
        raise Interrupted(f"interrupted after {len(solutions)} of {len(problems)} points", tried)
    return solutions
