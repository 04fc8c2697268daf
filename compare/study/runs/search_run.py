"""A run of a search algorithm on the compiled exact functions."""

from __future__ import annotations

import math
import time
from collections.abc import Callable

from compare.judge import evaluate
from compare.study.record import History, RunRecord, Times, Verdict
from compare.study.task import Task, plain_settings
from metaheuristics.minimize import minimize
from metaheuristics.registry import handling
from nlp_gait.backends.kernel.compiled import compile_objective


def search_run(task: Task, callback: Callable[..., None] | None = None) -> RunRecord:
    """Do the run and judge its best point.

    Args:
        task: what to run.
        callback: called with X, f, violation of every generation.
    """
    started = time.perf_counter()
    problem = task.problem.load()
    built = time.perf_counter()
    objective = compile_objective(problem, threads=1)  # processes run side by side already
    compiled = time.perf_counter()
    sign, stop = problem.objective.sign, task.stop
    result = minimize(
        objective,
        task.make_search(),
        evaluations=stop.evaluations,
        seed=task.run_seed,
        handling=handling(task.handling.name, **task.handling.settings),
        target=None if stop.target is None else sign * stop.target,
        stagnation=stop.stagnation,
        time_limit_s=stop.time_limit_s,
        callback=callback,
    )
    history = result.history
    best = [
        sign * float(f) if v == 0.0 and math.isfinite(f) else None
        for f, v in zip(history.objective, history.violation, strict=True)
    ]
    return RunRecord.of(
        task,
        settings={**plain_settings(result.algorithm), "handling": plain_settings(result.handling)},
        status="; ".join(result.reasons),
        claimed=result.feasible,
        x=problem.by_name(result.x),
        claimed_objective=sign * result.objective if math.isfinite(result.objective) else None,
        claimed_violation=result.violation if math.isfinite(result.violation) else None,
        verdict=Verdict.of(evaluate(problem, result.x)),
        evaluations={"f": result.evaluations},
        failed_evaluations=result.failed_evaluations,
        iterations=result.generations,
        active_constraints=(),
        history=History(evaluations=tuple(int(e) for e in history.evaluations), objective=tuple(best)),
        time_s=Times(
            build=built - started,
            compile=compiled - built,
            solve=result.time_s,
            objective=result.objective_time_s,
            history=tuple(float(t) for t in history.elapsed_s),
        ),
    )
