"""Solve a problem from several starts, in forked processes where that pays, and judge every end point by the exact functions.

``Continuation`` solves neighbouring problems, each from the last solution; nothing is rebuilt between them.
Threads are no alternative: CasADi and MUMPS work for one caller at a time (see ``formulation/locking.py``).
"""

import multiprocessing
import sys
import threading
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from nlp_gait.backends.exact import ExactValues, build_exact_model
from nlp_gait.backends.kernel.compiled import available_cores
from nlp_gait.backends.solvers.ipopt import IpoptSettings
from nlp_gait.backends.solvers.solver import Solver
from nlp_gait.errors import InputError, check_count, format_value
from nlp_gait.formulation import Array, GaitProblem, load
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE, ActiveConstraint, Guess, Outcome, Solution
from nlp_gait.interrupts import Interrupted, Stop, defer_interrupts, never
from nlp_gait.processes import has_fork, run_in_forks

# A price below this, times the bound's scale, is numerical noise and not reported.
PRICE_TOLERANCE = 1e-6
MOST_STARTS = 100_000
MOST_WORKERS = 4096
# Forking two processes and ending them costs 10 to 20 ms; it pays where the work that they share takes ten times as long.
FORK_PAYS_FROM_S = 0.2


def solve(
    problem: GaitProblem | str,
    *,
    starts: int = 1,
    seed: int = 0,
    x0: Sequence[float] | Array | Mapping[str, float] | None = None,
    solver: Solver | None = None,
    progress: Callable[[Outcome], None] | None = None,
    workers: int | None = None,
) -> Solution:
    """Find the best local optimum from several starts.

    Args:
        problem: with its current parameter values; a name is loaded with its defaults.
        starts: number of start points, from ``problem.start_point``.
        seed: of the start points.
        x0: first start point (n,) within the bounds, in order or by name; a fixed variable takes its fixed value. The remaining
            ``starts - 1`` are random.
        solver: with its settings; None for IPOPT with its defaults.
        progress: called with the outcome of each start, in their order.
        workers: number of processes that share the starts; None for all processors where a process can be forked (Linux, in the
            main thread), 1 for this process alone. The solution does not depend on it, except for its times.

    Returns:
        The best start that converged and is feasible for the exact functions; otherwise the best feasible end point, or the least
        infeasible one with its violated rows.

    Raises InputError for a value that is not allowed or a solver that does not run here, and Interrupted for Ctrl-C, with the
    solution of the starts so far, and of the interrupted one where it stopped.
    """
    starts = check_count("starts", starts, at_most=MOST_STARTS)
    workers = None if workers is None else check_count("workers", workers, at_most=MOST_WORKERS)
    seed = check_count("seed", seed, at_least=0)
    problem = load(problem) if isinstance(problem, str) else problem
    _check_types(problem, solver, progress)
    rng = np.random.default_rng(seed)
    points = [problem.start_point(rng) for _ in range(starts)]
    if x0 is not None:
        points[0] = problem.check_within(x0)
    ready = (solver or IpoptSettings()).prepare(problem, starts)
    outcomes: list[Outcome] = []
    with defer_interrupts() as interrupted:
        for outcome in run_starts(ready, problem, points, interrupted, workers):
            outcomes.append(outcome)
            if progress is not None:
                progress(outcome)
    solution = make_solution(problem, outcomes, seed)
    if interrupted():
        sentence = f"interrupted in start {len(outcomes)} of {starts}"
        raise Interrupted(sentence, replace(solution, status=f"{sentence}; {solution.status}"))
    return solution


def _check_types(problem: object, solver: object, progress: object) -> None:
    if not isinstance(problem, GaitProblem):
        raise InputError(f"problem must be a problem from load, or the name of one, got {format_value(problem)}")
    is_solver = all(callable(getattr(solver, method, None)) for method in ("run", "prepare"))
    if solver is not None and (isinstance(solver, type) or not is_solver):
        raise InputError(
            f"solver must be made by nlp_gait.make_solver('ipopt'), IpoptSettings() or the like, got {format_value(solver)}"
        )
    if progress is not None and not callable(progress):
        raise InputError(f"progress must be a function of one start's outcome, got {format_value(progress)}")


def count_workers() -> int:
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
    stop: Stop = never,
    workers: int | None = None,
) -> Iterator[Outcome]:
    """Yield the outcome of the run from each point (n,), in their order; fewer after ``stop`` returns True.

    Without ``workers``, the first run is made in this process, and the others are divided among ``count_workers`` if they
    take long enough. Raises WorkerError if a process died, perhaps out of memory.
    """
    if workers is None and points:  # the first run says whether a fork pays for the others
        started = time.perf_counter()
        yield solver.run(problem, points[0], stop)
        points = points[1:]
        fork_pays = (time.perf_counter() - started) * len(points) >= FORK_PAYS_FROM_S
        workers = count_workers() if fork_pays else 1
        if stop():
            return
    count = min(workers or 1, len(points)) if has_fork() else 1
    if count > 1:
        build_exact_model(problem)  # every run needs it: built before the fork
        yield from run_in_forks(lambda k, is_over: solver.run(problem, points[k], is_over), len(points), count, stop)
        return
    for point in points:
        yield solver.run(problem, point, stop)
        if stop():
            return


def make_solution(problem: GaitProblem, outcomes: Sequence[Outcome], seed: int = 0) -> Solution:
    """Make the solution from all starts: the cheapest that converged, else the cheapest feasible, else the least infeasible."""
    best = min(outcomes, key=lambda outcome: outcome.rank)
    exact = build_exact_model(problem)
    values = exact.at(best.x, problem.p)
    violations = exact.find_violated(values)
    status = best.status
    if not best.converged:
        names = ", ".join(
            f"{row.name} (by {row.violation:.3g}{'' if row.unit == '1' else f' {row.unit}'})" for row in violations[:3]
        )
        status = f"no start converged; ending of the best feasible one: {best.status}"
        if not best.feasible:
            status = f"no start converged to a feasible point; ending of the least infeasible one: {best.status}"
        status += f"; violated: {names}; relax these limits or widen the bounds" if names else ""
        if any(row.lower == row.upper for row in violations[:3]):
            status += f"; equations are satisfied to {FEASIBILITY_TOLERANCE:g} of their scale: bounds on both sides allow more"
        status += "" if np.isfinite(best.cost) else f"; {problem.objective.name} is {best.cost} there"
    prices = _find_active(problem, values, best.guess) if best.converged and best.guess is not None else ()
    return Solution(
        problem=problem,
        starts=tuple(outcomes),
        seed=seed,
        status=status,
        worst_violations=violations[:10],
        active_constraints=tuple(prices),
    )


def _find_active(problem: GaitProblem, values: ExactValues, guess: Guess) -> Iterator[ActiveConstraint]:
    """Yield the bounds with a price: minus the multiplier is the change of the cost per unit of the bound.

    Equations of the problem are left out; a fixed variable has a price.
    """
    exact, unit = build_exact_model(problem), problem.objective.unit
    per = "" if unit == "1" else f"{unit} "
    rows = len(exact.row_names) - len(problem.names)  # the variables' bounds come last
    slopes = -np.concatenate([guess.rows[:rows], guess.bounds[: len(problem.names)] / problem.scale])
    weights = np.abs(slopes) * np.concatenate([np.ones(rows), problem.scale])
    for i in np.argsort(-weights, kind="stable"):
        if weights[i] < PRICE_TOLERANCE:
            break
        if i < rows and values.lower[i] == values.upper[i]:
            continue
        # A higher upper bound lowers the cost, a higher lower bound raises it.
        side = "upper" if slopes[i] < 0 else "lower"
        yield ActiveConstraint(
            name=exact.row_names[i],
            side=side,
            bound=float(getattr(values, side)[i]),
            unit=exact.row_units[i],
            price=float(problem.objective.sign * slopes[i]),
            price_unit=f"{per}per {'unit' if exact.row_units[i] == '1' else exact.row_units[i]}",
        )


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

    def run(self, problem: GaitProblem, earlier: Sequence[Outcome] = (), stop: Stop = never) -> list[Outcome]:
        """Return runs of the next problem; the best of these and the earlier runs is the neighbour of the next problem.

        ``earlier`` are runs of the same problem on another path; random starts without success are not repeated. ``stop`` is
        called after each iteration, and returns whether to end at once.
        """
        solver = self._solver.prepare(problem, self._solves)
        near = self._neighbour
        outcomes: list[Outcome] = []
        if near is not None:
            warm = solver.run_from(problem, near, stop)
            outcomes += [] if warm is None else [warm]
            if find_cheapest_feasible(outcomes) is None and not stop():
                outcomes.append(solver.run(problem, np.clip(near.x, problem.lower, problem.upper), stop))
        already_failed = bool(earlier) and find_cheapest_feasible(earlier) is None
        if find_cheapest_feasible(outcomes) is None and not already_failed and (near is None or not earlier):
            rng = np.random.default_rng(self._seed)
            points = [problem.start_point(rng) for _ in range(self._starts)]
            outcomes += run_starts(solver, problem, points, stop)
        self._neighbour = find_cheapest_feasible([*earlier, *outcomes]) or near
        return outcomes


def find_cheapest_feasible(outcomes: Sequence[Outcome]) -> Outcome | None:
    """Cheapest outcome that succeeded, if there is one."""
    return min((outcome for outcome in outcomes if outcome.converged), key=lambda outcome: outcome.cost, default=None)


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
    Ctrl-C raises Interrupted with the solutions so far, None for problems without a run.
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
    tried = [make_solution(p, runs, seed + 1) if runs else None for p, runs in zip(problems, outcomes, strict=True)]
    solutions = [solution for solution in tried if solution is not None]
    if interrupted():
        raise Interrupted(f"interrupted after {len(solutions)} of {len(problems)} points", tried)
    return solutions
