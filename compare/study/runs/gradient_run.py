"""A run of an NLP solver, from a random start or a search's result."""

from __future__ import annotations

import math
import time

import numpy as np

from compare.judge import evaluate
from compare.study.record import History, RunRecord, Times, Verdict
from compare.study.task import IPOPT, Task
from nlp_gait.backends.solve import make_solution
from nlp_gait.errors import InputError
from nlp_gait.formulation.solution import Best

# Runs of one solver for which compiling is weighed. The same number in every study: compiled and interpreted functions differ in
# the last bits, and no run may depend on how many others there are.
PLANNED_RUNS = 20


def gradient_run(task: Task, start: RunRecord | None = None) -> RunRecord:
    """Do the run and judge its end.

    Args:
        task: what to run.
        start: the run that this one polishes; its cost is charged too. None for a random start.

    Raises:
        InputError: the run to polish has no point.
    """
    started = time.perf_counter()
    problem, solver = task.problem.load(), task.make_solver()
    if task.start:
        x0 = problem.check_within(task.start)
    elif start is None:
        x0 = problem.start_point(np.random.default_rng(task.run_seed))
    elif not start.x:
        raise InputError(f"{start.solver}, run {start.run}, has no point to polish: {start.status}")
    else:
        x0 = problem.check_within(start.x)
    outcome = solver.prepare(problem, PLANNED_RUNS).run(problem, x0)
    prepared_s = time.perf_counter() - started - outcome.time_s
    compile_s = min(outcome.compile_s, prepared_s)  # less where the process had the solver already
    settings = solver.to_dict()
    if outcome.linear_solver:
        settings["linear_solver"] = outcome.linear_solver
    solution = make_solution(problem, [outcome])
    evaluations, earlier = outcome.evaluations.by_kind(), list[Best]()
    before, before_s = (0, 0.0) if start is None else (start.evaluations["f"], start.time_s.solve)
    if start is not None:
        evaluations["f"] += before
        earlier = list(map(Best, start.history.evaluations, start.history.objective, start.time_s.history))
    # A solver that keeps no history has its end.
    own = outcome.history or (
        Best(outcome.evaluations.f, outcome.objective if outcome.claimed else None, outcome.time_s),
    )
    history = [*earlier, *(Best(before + best.calls, best.objective, before_s + best.time_s) for best in own)]
    verdict = Verdict.of(evaluate(problem, outcome.x))
    return RunRecord.of(
        task,
        settings=settings,
        status=solution.status if task.solver == IPOPT else outcome.status,  # other solvers are quoted
        claimed=outcome.claimed,
        x=problem.by_name(outcome.x),
        claimed_objective=verdict.objective if math.isfinite(verdict.objective) else None,
        claimed_violation=outcome.violation if math.isfinite(outcome.violation) else None,
        verdict=verdict,
        evaluations=evaluations,
        failed_evaluations=0,
        iterations=outcome.iterations,
        active_constraints=solution.active_constraints,
        history=History(
            evaluations=tuple(best.calls for best in history), objective=tuple(best.objective for best in history)
        ),
        time_s=Times(
            build=prepared_s - compile_s,
            compile=compile_s,
            solve=before_s + outcome.time_s,
            objective=outcome.objective_s,
            history=tuple(best.time_s for best in history),
        ),
    )
