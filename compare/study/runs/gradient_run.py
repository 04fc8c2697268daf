"""A run of a gradient method: IPOPT or another NLP solver on the lifted problem, from a random start or a search's result."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

import nlp_gait
from compare.judge import evaluate
from compare.study.record import History, RunRecord, Times, Verdict
from compare.study.task import IPOPT, Task, plain_settings
from nlp_gait.backends.nlp import nlp_model
from nlp_gait.backends.solvers.ipopt import ipopt_for
from nlp_gait.backends.solvers.nlpsol import claimed, solve_with
from nlp_gait.errors import InputError
from nlp_gait.problem import Array, GaitProblem
from nlp_gait.problem.solution import ActiveConstraint


@dataclass(frozen=True, kw_only=True)
class Outcome:
    """What a gradient method hands back; the history has at least its end, ``cost`` in the problem's sense."""

    x: Array
    success: bool
    status: str
    violation: float
    evaluations: Mapping[str, int]
    iterations: int
    settings: Mapping[str, Any]
    active_constraints: tuple[ActiveConstraint, ...]
    history: History
    time_s: Times


def gradient_run(task: Task, start: RunRecord | None = None) -> RunRecord:
    """Do the run and judge its end.

    Args:
        task: what to run.
        start: the run that this one polishes; its cost is charged too. None for a random start.

    Raises:
        InputError: the run to polish has no point.
    """
    started = time.perf_counter()
    problem = task.problem.load()
    nlp_model(problem)
    build = time.perf_counter() - started
    if task.start:
        x0 = np.clip(problem.check_x(task.start), problem.lower, problem.upper)
    elif start is None:
        x0 = problem.start_point(np.random.default_rng(task.run_seed))
    elif not start.x:
        raise InputError(f"{start.algorithm}, run {start.run}, has no point to polish: {start.status}")
    else:
        x0 = np.array(list(start.x.values()))
    outcome = _ipopt(task, problem, x0, build) if task.algorithm == IPOPT else _other(task, problem, x0, build)
    return record_of(task, problem, outcome, start)


def record_of(task: Task, problem: GaitProblem, outcome: Outcome, start: RunRecord | None = None) -> RunRecord:
    """Record of an outcome, with the cost and history of the run that it polishes before its own."""
    evaluations, history, times = dict(outcome.evaluations), outcome.history, outcome.time_s
    if start is not None:
        before_s, before = start.time_s.solve, start.evaluations["f"]
        evaluations["f"] += before
        history = History(
            evaluations=(*start.history.evaluations, *(before + count for count in history.evaluations)),
            objective=(*start.history.objective, *history.objective),
        )
        times = Times(
            build=times.build,
            compile=times.compile,
            solve=before_s + times.solve,
            objective=math.nan,
            history=(*start.time_s.history, *(before_s + t for t in times.history)),
        )
    verdict = Verdict.of(evaluate(problem, outcome.x))
    return RunRecord(
        problem=task.problem.title,
        algorithm=task.title,
        run=task.run,
        seed=task.run_seed,
        definition=task.definition(),
        settings=outcome.settings,
        status=outcome.status,
        success=outcome.success,
        x=problem.by_name(outcome.x),
        objective=verdict.objective if math.isfinite(verdict.objective) else None,
        violation=outcome.violation if math.isfinite(outcome.violation) else None,
        verdict=verdict,
        evaluations=evaluations,
        failed_evaluations=0,
        iterations=outcome.iterations,
        active_constraints=outcome.active_constraints,
        history=history,
        time_s=times,
    )


def _ipopt(task: Task, problem: GaitProblem, x0: Array, build: float) -> Outcome:
    limit = {} if task.stop.time_limit_s is None else {"time_limit_s": task.stop.time_limit_s}
    settings = nlp_gait.IpoptSettings(**{**limit, **task.settings})
    started = time.perf_counter()
    ipopt_for(problem, settings)
    compile_s = time.perf_counter() - started
    solution = nlp_gait.solve(problem, x0=x0, settings=settings)
    counts = asdict(solution.evaluations)
    return Outcome(
        x=np.array(list(solution.x.values())),
        success=solution.success,
        status=solution.status,
        violation=solution.violation,
        evaluations=counts,
        iterations=solution.iterations,
        settings={**plain_settings(settings), "linear_solver": solution.linear_solver},
        active_constraints=solution.active_constraints,
        history=_end(counts["f"], solution.objective if solution.success else None),
        time_s=_times(build, compile_s, solution.time_s.solve),
    )


def _other(task: Task, problem: GaitProblem, x0: Array, build: float) -> Outcome:
    end = solve_with(str(task.algorithm), problem, x0, task.stop.time_limit_s)
    cost, violation = claimed(problem, end.x)
    counts = asdict(end.evaluations)
    return Outcome(
        x=end.x,
        success=end.success,
        status=end.status,
        violation=violation,
        evaluations=counts,
        iterations=end.iterations,
        settings={"kind": str(task.algorithm)},
        active_constraints=(),
        history=_end(counts["f"], problem.objective.sign * cost if end.success else None),
        time_s=_times(build, end.build_s, end.time_s),
    )


def _end(calls: int, objective: float | None) -> History:
    return History(evaluations=(calls,), objective=(objective,))


def _times(build: float, compile_s: float, solve: float) -> Times:
    return Times(build=build, compile=compile_s, solve=solve, objective=math.nan, history=(solve,))
