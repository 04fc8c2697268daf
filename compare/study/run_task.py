"""One run of a solver on a problem: from a task to its record."""

import json
import math
import multiprocessing
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from compare.judge import evaluate
from compare.study.record import History, RunRecord, Times, Verdict, check_readable, parse_record
from compare.study.task import IPOPT, Task, describe_settings
from metaheuristics.minimize import minimize
from metaheuristics.registry import make_handling
from nlp_gait.backends.kernel.compiled import compile_objective
from nlp_gait.backends.solve import make_solution
from nlp_gait.errors import InputError, WorkerError
from nlp_gait.files import LARGEST_FILE, check_plain
from nlp_gait.formulation.solution import Best
from nlp_gait.processes import keep_working_folder, run_in_isolation

Run = Callable[[Task], RunRecord]
"""Performs one run of a task."""

MOST_REASON = 500  # characters of an error in a record
MOST_HISTORY = 10_000  # entries of a history in a record, some 60 bytes each
# A run that respects its time limit ends within it and is then judged; its process is killed this long after the limit.
GRACE_S = 5.0
# Number of runs of one solver for which compiling is weighed. The same number in every study: compiled and interpreted functions
# differ in the last bits, and no run may depend on how many others there are.
PLANNED_RUNS = 20


def run_task(task: Task, callback: Callable[..., None] | None = None) -> RunRecord:
    """Perform one run and judge its result; raises InputError if a search to polish has no point.

    ``callback`` receives X, f, violation of every generation of a search.
    """
    if not task.is_search:
        return _solve(task)
    search = _search(task, callback)
    return _solve(task, search) if task.polish else search


def try_task(task: Task, run: Run = run_task) -> RunRecord:
    """Perform one run; whatever fails in it becomes its record instead of ending the study.

    User code runs in its own process, which is killed if it does not return; IPOPT polishes its result in this one.
    """
    if not task.is_user_code:
        return _run_caught(task, run)
    search = _run_isolated(replace(task, polish=False), run)
    return _run_caught(task, partial(_solve, search=search)) if task.polish else search


def _run_caught(task: Task, run: Run) -> RunRecord:
    try:
        record = run(task)
    except KeyboardInterrupt:
        raise
    except BaseException as error:  # user code may raise anything
        return RunRecord.make_failed(task, _describe(error))
    try:
        check_readable(record)
    except (TypeError, ValueError, RecursionError) as error:
        return RunRecord.make_failed(task, f"its record could not be read again: {_describe(error)}")
    return record


def _describe(error: BaseException) -> str:
    """Return the class and the text of an error in one line of valid UTF-8."""
    try:
        text = " ".join(str(error).split())[:MOST_REASON]
    except Exception:
        text = "its text cannot be read"
    name = type(error).__name__
    return (f"{name}: {text}" if text else name).encode("utf-8", "backslashreplace").decode()


def _run_isolated(task: Task, run: Run) -> RunRecord:
    """Run in a forked process, in this one where it may not fork (Windows, Dask's workers).

    Everything but the run is built before the fork, so that the time limit is for the run alone. What it prints is dropped.
    """
    if "fork" not in multiprocessing.get_all_start_methods() or multiprocessing.current_process().daemon:
        return _run_caught(task, run)
    problem = task.problem.load()
    compile_objective(problem, threads=1)
    evaluate(problem, 0.5 * (problem.lower + problem.upper))

    def call() -> bytes:
        return json.dumps(_run_caught(task, run).to_json(), allow_nan=False).encode()

    limit = task.stop.time_limit_s
    try:
        data = json.loads(run_in_isolation(call, None if limit is None else limit + GRACE_S, LARGEST_FILE))
        check_plain(data)
        record = parse_record(data)
    except TimeoutError:
        return RunRecord.make_failed(
            task, f"it did not return within {GRACE_S:g} s after the time limit of {limit:g} s"
        )
    except WorkerError as error:
        return RunRecord.make_failed(task, str(error))
    except (ValueError, RecursionError) as error:
        return RunRecord.make_failed(task, f"its process sent no record: {error}")
    if (record.problem, record.solver, record.run, record.inputs.key) != (
        *(task.problem.title, task.title, task.run),
        task.inputs().key,
    ):
        return RunRecord.make_failed(task, "its process sent the record of another run")
    return record


def _search(task: Task, callback: Callable[..., None] | None) -> RunRecord:
    started = time.perf_counter()
    problem = task.problem.load()
    built = time.perf_counter()
    objective = compile_objective(problem, threads=1)  # runs take the processors
    compiled = time.perf_counter()
    sign, stop = problem.objective.sign, task.stop
    with keep_working_folder():  # as wrappers of external programs change it
        result = minimize(
            objective,
            task.make_search(),
            evaluations=stop.evaluations,
            seed=task.run_seed,
            handling=make_handling(task.handling.name, **task.handling.settings),
            stop=stop.end_early(sign),
            callback=callback,
        )
    history = result.history
    best = [
        sign * float(f) if v == 0.0 and math.isfinite(f) else None
        for f, v in zip(history.objective, history.violation, strict=True)
    ]
    kept = _choose_entries(best)
    return RunRecord.from_task(
        task,
        settings={**describe_settings(result.algorithm), "handling": describe_settings(result.handling)},
        status="; ".join(result.reasons),
        claimed=result.feasible,
        x=problem.by_name(result.x),
        claimed_objective=sign * result.objective if math.isfinite(result.objective) else None,
        claimed_violation=result.violation if math.isfinite(result.violation) else None,
        verdict=Verdict.from_evaluation(evaluate(problem, result.x)),
        evaluations={"f": result.evaluations},
        failed_evaluations=result.failed_evaluations,
        iterations=result.generations,
        active_constraints=(),
        history=History(
            evaluations=tuple(int(history.evaluations[k]) for k in kept), objective=tuple(best[k] for k in kept)
        ),
        time_s=Times(
            build=built - started,
            compile=compiled - built,
            solve=result.time_s,
            objective=result.objective_time_s,
            history=tuple(float(history.elapsed_s[k]) for k in kept),
        ),
    )


def _choose_entries(best: Sequence[float | None]) -> list[int]:
    """Return which entries of a history to keep: all, or of a long one the changes, evenly thinned, and the last entry."""
    if len(best) <= MOST_HISTORY:
        return list(range(len(best)))
    changes = [k for k in range(len(best)) if k == 0 or best[k] != best[k - 1]]
    return sorted({*changes[:: math.ceil(len(changes) / MOST_HISTORY)], len(best) - 1})


def _solve(task: Task, search: RunRecord | None = None) -> RunRecord:
    """Run an NLP solver: from the given start, from the end of a search that it polishes, or from a random point."""
    started = time.perf_counter()
    problem, solver = task.problem.load(), task.make_solver()
    if search is not None and not search.x:
        raise InputError(f"the search has no point to polish: {search.status}")
    start = task.start if search is None else search.x
    x0 = problem.check_within(start) if start else problem.start_point(np.random.default_rng(task.run_seed))
    outcome = solver.prepare(problem, PLANNED_RUNS).run(problem, x0)
    prepared_s = time.perf_counter() - started - outcome.time_s
    compile_s = min(outcome.compile_s, prepared_s)  # less where the process had the solver already
    settings = solver.to_dict()
    if outcome.linear_solver:
        settings["linear_solver"] = outcome.linear_solver
    solution = make_solution(problem, [outcome])
    evaluations, history, calls, seconds = outcome.evaluations.by_kind(), list[Best](), 0, 0.0
    if search is not None:
        calls, seconds = search.evaluations["f"], search.time_s.solve
        evaluations["f"] += calls
        history += map(Best, search.history.evaluations, search.history.objective, search.time_s.history)
        settings = {**search.settings, IPOPT: settings}
    # A solver that keeps no history has its end.
    end = Best(outcome.evaluations.f, outcome.objective if outcome.claimed else None, outcome.time_s)
    history += (Best(calls + b.calls, b.objective, seconds + b.time_s) for b in outcome.history or (end,))
    history = [history[k] for k in _choose_entries([best.objective for best in history])]
    verdict = Verdict.from_evaluation(evaluate(problem, outcome.x))
    return RunRecord.from_task(
        task,
        settings=settings,
        status=solution.status if solver.name == IPOPT else outcome.status,  # other solvers are quoted
        claimed=outcome.claimed,
        x=problem.by_name(outcome.x),
        claimed_objective=verdict.objective if math.isfinite(verdict.objective) else None,
        claimed_violation=outcome.violation if math.isfinite(outcome.violation) else None,
        verdict=verdict,
        evaluations=evaluations,
        failed_evaluations=0 if search is None else search.failed_evaluations,
        iterations=outcome.iterations,
        active_constraints=solution.active_constraints,
        history=History(
            evaluations=tuple(best.calls for best in history), objective=tuple(best.objective for best in history)
        ),
        time_s=Times(
            build=prepared_s - compile_s,
            compile=compile_s,
            solve=seconds + outcome.time_s,
            objective=outcome.objective_s,
            history=tuple(best.time_s for best in history),
        ),
    )
