"""One run of a solver on a problem: from a task to its record."""

import json
import math
import time
from collections.abc import Callable, Collection, Sequence
from dataclasses import replace
from functools import partial

import numpy as np

from compare.judge import evaluate
from compare.study.origin import format_now
from compare.study.record import History, RunRecord, Times, Verdict, check_readable, parse_record
from compare.study.task import IPOPT, Task, describe_settings
from metaheuristics.external_program import ExternalProgram
from metaheuristics.interface import BatchObjective
from metaheuristics.interface import History as SearchHistory
from metaheuristics.minimize import Evaluator, minimize
from metaheuristics.registry import make_handling
from metaheuristics.user_algorithm import PlainFunction
from nlp_gait.backends.kernel.compiled import compile_objective
from nlp_gait.backends.solve import make_solution
from nlp_gait.errors import InputError, WorkerError
from nlp_gait.files import LARGEST_FILE, check_plain
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.solution import Best
from nlp_gait.processes import has_fork, keep_working_folder, run_in_isolation

Run = Callable[[Task], RunRecord]
"""Performs one run of a task."""

MOST_REASON = 500  # characters of an error in a record
MOST_HISTORY = 10_000  # entries of a history in a record, some 60 bytes each
_ask: Callable[[bytes], bytes] | None = None  # in an isolated process: asks its parent for values
# A run that respects its time limit ends within it and is then judged; its process is killed this long after the limit.
GRACE_S = 5.0
# Number of runs of one solver for which compiling is weighed. The same number in every study: compiled and interpreted functions
# differ in the last bits, and no run may depend on how many others there are.
PLANNED_RUNS = 20


def run_task(task: Task) -> RunRecord:
    """Perform one run and judge its result; raises InputError if a search to polish has no point."""
    if not task.is_search:
        return _solve(task)
    search = _search(task)
    return _solve(task, search) if task.polish else search


def try_task(task: Task, search: RunRecord | None = None, run: Run = run_task) -> RunRecord:
    """Perform one run; whatever fails in it becomes its record instead of ending the study.

    User code runs in its own process, which is killed if it does not return; this one evaluates what it proposes, counts and
    judges. IPOPT polishes its result in this one, or that of ``search``, the record of the same run without polishing.
    """
    if search is None and not task.is_user_code:
        return _run_caught(task, run)
    search = search or _run_isolated(replace(task, polish=False), run)
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
    if not has_fork():
        return _run_caught(task, run)
    problem = task.problem.load()
    counter = _Counter(problem, task.stop.evaluations)

    def call(ask: Callable[[bytes], bytes]) -> bytes:
        global _ask
        _ask = ask
        return json.dumps(_run_caught(task, run).to_json(), allow_nan=False).encode()

    limit = task.stop.time_limit_s
    try:
        data = json.loads(
            run_in_isolation(call, None if limit is None else limit + GRACE_S, LARGEST_FILE, answer=counter)
        )
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
    return record if not record.x else counter.judge(task, record)


class _Counter:
    """Evaluates, counts and judges what an isolated process proposes, by functions that its code cannot reach."""

    def __init__(self, problem: GaitProblem, budget: int) -> None:
        self._problem, self._budget = problem, budget
        self._objective = compile_objective(problem, threads=1)
        self._record: Evaluator | None = None  # its clock starts with the first point

    def __call__(self, question: bytes) -> bytes:
        """Return objectives and violations of points (P, n) as bytes; raises WorkerError for anything else, or too many."""
        lower, upper = self._problem.lower, self._problem.upper
        thinned, data = question[:1] == b"1", question[1:]
        if not data or len(data) % lower.nbytes:
            raise WorkerError("its process sent something other than points")
        X = np.frombuffer(data).reshape(-1, len(lower))
        if not ((lower <= X) & (upper >= X)).all():  # NaN fails too
            raise WorkerError("its process sent points outside of the bounds")
        record = self._record = self._record or Evaluator(self._objective, None, thinned)
        if record.evaluations + len(X) > self._budget:
            raise WorkerError(f"its process asked for more than its budget of {self._budget} evaluations")
        return b"".join(values.tobytes() for values in record(X))

    def judge(self, task: Task, claim: RunRecord) -> RunRecord:
        """Return the record of a run, with the point, counts and history that were evaluated here, whatever it claims."""
        record = self._record
        if record is None:
            return RunRecord.make_failed(task, "its process sent a result, but no point to evaluate")
        history, counts = record.history(), (record.evaluations, record.failed, record.generations)
        times = replace(claim.time_s, solve=record.elapsed_s, objective=record.objective_time_s)
        claimed = RunRecord.from_task(task, settings=claim.settings, status=claim.status, time_s=times)
        listed = {*claim.history.evaluations, record.evaluations}
        return _judge_search(claimed, self._problem, record.best_x, record.best, counts, history, listed)


def _search(task: Task) -> RunRecord:
    started = time.perf_counter()
    problem = task.problem.load()
    built = time.perf_counter()
    objective: BatchObjective = compile_objective(problem, threads=1)  # runs take the processors
    compiled = time.perf_counter()
    stop = task.stop
    with keep_working_folder():  # as wrappers of external programs change it
        algorithm = task.make_search()
        if _ask is not None:
            objective = _RemoteObjective(objective, _ask, isinstance(algorithm, (PlainFunction, ExternalProgram)))
        result = minimize(
            objective,
            algorithm,
            evaluations=stop.evaluations,
            seed=task.run_seed,
            handling=make_handling(task.handling.name, **task.handling.settings),
            stop=stop.end_early(problem.objective.sign),
        )
    times = Times(
        build=built - started, compile=compiled - built, solve=result.time_s, objective=result.objective_time_s
    )
    settings = {**describe_settings(result.algorithm), "handling": describe_settings(result.handling)}
    record = RunRecord.from_task(task, settings=settings, status="; ".join(result.reasons), time_s=times)
    counts = result.evaluations, result.failed_evaluations, result.generations
    return _judge_search(record, problem, result.x, (result.violation, result.objective), counts, result.history)


def _judge_search(
    record: RunRecord,
    problem: GaitProblem,
    x: Array,
    best: tuple[float, float],
    counts: tuple[int, int, int],
    history: SearchHistory,
    listed: Collection[int] | None = None,
) -> RunRecord:
    """Return the record of a search with its best point x (n,), which is judged, and its history.

    ``best`` is violation and objective, which is minimised, at x; ``counts`` are evaluations, failed ones and generations.
    Of the history the entries at ``listed`` numbers of evaluations are kept; None chooses them.
    """
    sign, (violation, objective) = problem.objective.sign, best
    course = [
        sign * float(f) if v == 0.0 and math.isfinite(f) else None
        for f, v in zip(history.objective, history.violation, strict=True)
    ]
    kept = _choose_entries(course)
    if listed is not None:
        kept = [k for k in range(len(course)) if int(history.evaluations[k]) in listed]
    return replace(
        record,
        claimed=violation == 0.0,
        x=problem.by_name(x),
        claimed_objective=sign * objective if math.isfinite(objective) else None,
        claimed_violation=violation if math.isfinite(violation) else None,
        verdict=Verdict.from_evaluation(evaluate(problem, x)),
        evaluations={"f": counts[0]},
        failed_evaluations=counts[1],
        iterations=counts[2],
        history=History(
            evaluations=tuple(int(history.evaluations[k]) for k in kept), objective=tuple(course[k] for k in kept)
        ),
        time_s=replace(record.time_s, history=tuple(float(history.elapsed_s[k]) for k in kept), finished=format_now()),
    )


class _RemoteObjective:
    """The objective in an isolated process, which asks its parent for every value."""

    def __init__(self, bounded: BatchObjective, ask: Callable[[bytes], bytes], thinned: bool) -> None:
        self.names, self.lower, self.upper = bounded.names, bounded.lower, bounded.upper
        self._ask, self._kind = ask, b"1" if thinned else b"0"

    def __call__(self, X: Array) -> tuple[Array, Array]:
        f, violation = np.frombuffer(self._ask(self._kind + X.tobytes())).reshape(2, -1)
        return f.copy(), violation.copy()


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
