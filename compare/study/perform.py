"""One run of a solver on a problem, from its inputs to its record.

User code runs in a process of its own, which reports its best point while it searches: a run that is ended from outside keeps it.
The judge evaluates the point in a process that user code cannot reach.
"""

import math
import os
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any

import numpy as np

from compare.judge import evaluate
from compare.study.record import (
    History,
    RunRecord,
    Times,
    check_readable,
    describe_evaluation,
    format_now,
    list_versions,
)
from compare.study.run import IPOPT, Inputs, Run, describe_settings
from metaheuristics.interface import FEASIBILITY
from metaheuristics.minimize import minimize
from metaheuristics.registry import make_handling
from nlp_gait.backends.exact import identify_problem
from nlp_gait.backends.kernel.compiled import compile_objective
from nlp_gait.backends.solve import make_solution
from nlp_gait.errors import GaitError, InputError
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.solution import Best
from nlp_gait.processes import Job

Send = Callable[[Any], None]
Entry = tuple[int, float, float, float]
"""Evaluations, violation and objective of the best point, which is minimised, and seconds."""

MOST_REASON = 500  # characters of an error in a record
# A run that respects its budget and its time limit ends within them; its process is killed this long after either.
GRACE_S = 5.0
REPORTED_EVERY_S = 0.2
# Number of runs of one solver for which compiling is weighed. The same number in every study: compiled and interpreted functions
# differ in the last bits, and no run may depend on how many others there are.
PLANNED_RUNS = 20


class ChangedFileError(InputError):
    """A file of the user has changed while the study runs."""


@dataclass(kw_only=True)
class SearchEnd:
    """What a search has found when it ends, or so far."""

    x: Array  #: (n,) best point; empty before the first evaluation
    entries: list[Entry] = field(default_factory=list)  #: history, the last one is the end
    failed: int = 0  #: number of failed evaluations
    generations: int = 0
    status: str = ""
    settings: dict[str, Any] = field(default_factory=dict)
    time_s: Times = Times()


class Reporter:
    """Callback of ``minimize`` that sends the best point so far."""

    def __init__(self, send: Send, budget: int) -> None:
        self._send, self._budget, self._started, self._sent = send, budget, time.perf_counter(), 0.0
        self._count, self._failed, self._best = 0, 0, (math.inf, math.inf)

    def __call__(self, X: Array, f: Array, violation: Array) -> None:
        """Count a generation, and report a better point, or the count now and then."""
        self._count += len(X)
        self._failed += int(np.count_nonzero(np.isinf(f)))
        leader = FEASIBILITY.best(f, violation)
        best, seconds = (float(violation[leader]), float(f[leader])), time.perf_counter() - self._started
        is_better = best < self._best or not self._sent
        self._best = min(best, self._best)
        if is_better or seconds > self._sent + REPORTED_EVERY_S or self._count >= self._budget:
            self._sent = max(seconds, 1e-9)
            self._send(((self._count, *self._best, seconds), self._failed, X[leader].copy() if is_better else None))


@dataclass(kw_only=True)
class IsolatedRun:
    """A run of user code in its own process, as seen from outside."""

    run: Run
    inputs: Inputs
    latest: SearchEnd = field(default_factory=lambda: SearchEnd(x=np.empty(0)))
    deadline: float | None = None  #: of time.monotonic; None before the process begins

    def make_job(self) -> Job:
        """Return the job that runs the search in a process of its own."""
        call = partial(_search_reported, self.run, self.inputs)
        return Job(call=call, receive=self.receive, is_late=self.is_late, alone=True)

    def receive(self, message: Any) -> None:
        """Keep the best point so far; a run that has used its budget has to end soon."""
        entry, failed, x = message
        entries, self.latest.failed = self.latest.entries, failed
        if not entries:  # the clock starts with the search
            self.deadline = time.monotonic() - entry[3] + self._allowed_s
        entries.append(entry)
        if x is not None:
            self.latest.x = x
        if entry[0] >= self.run.evaluations:
            self.deadline = min(self.deadline or math.inf, time.monotonic() + GRACE_S)

    @property
    def _allowed_s(self) -> float:
        limit = self.run.time_limit_s
        return math.inf if limit is None else limit + GRACE_S

    def is_late(self) -> bool:
        """Return whether the process has to be ended."""
        if self.deadline is None:
            self.deadline = time.monotonic() + self._allowed_s
        return time.monotonic() > self.deadline

    def conclude(self, result: Any) -> RunRecord:
        """Return the record of what the process returned, or of its error."""
        latest, limit_s = self.latest, self.run.time_limit_s
        if isinstance(result, TimeoutError) and latest.entries:
            count, _, _, seconds = latest.entries[-1]
            why = "evaluation budget used" if count >= self.run.evaluations else "time limit reached"
            latest.status = f"{why}; the search did not return and was ended"
            result = replace(
                latest, settings={"kind": "user code"}, time_s=Times(build=0.0, compile=0.0, solve=seconds)
            )
        elif isinstance(result, TimeoutError):
            result = f"it evaluated nothing within its time limit of {limit_s} s"
        elif isinstance(result, BaseException):
            result = describe_error(result)
        if isinstance(result, str):
            return make_failed(self.run, self.inputs, result, latest.entries)
        return catch_errors(self.run, self.inputs, lambda: judge_search(self.run, self.inputs, result))


def perform(run: Run, inputs: Inputs, _: Send | None = None) -> RunRecord:
    """Perform a run of a solver of this package; whatever fails in it becomes its record."""
    if not run.is_search:
        return catch_errors(run, inputs, lambda: run_solver(run, inputs))
    return catch_errors(run, inputs, lambda: judge_search(run, inputs, run_search(run, inputs)))


def catch_errors(run: Run, inputs: Inputs, call: Callable[[], RunRecord]) -> RunRecord:
    """Return the record that a call makes, or that of a failed run."""
    try:
        record = call()
        check_readable(record)
        return record
    except (KeyboardInterrupt, ChangedFileError):
        raise
    except BaseException as error:  # user code may raise anything
        return make_failed(run, inputs, describe_error(error))


def describe_error(error: BaseException) -> str:
    """Return the class and the text of an error in one line of valid UTF-8."""
    try:
        text = " ".join(str(error).split())[:MOST_REASON]
    except Exception:
        text = "its text cannot be read"
    name = type(error).__name__
    return (f"{name}: {text}" if text else name).encode("utf-8", "backslashreplace").decode()


def make_record(run: Run, inputs: Inputs, time_s: Times, **results: Any) -> RunRecord:
    """Return the record of a run that ends now: ``results`` are the fields from ``status`` on."""
    return RunRecord(
        problem=run.problem.title,
        solver=run.title,
        run=run.number,
        inputs=inputs,
        time_s=replace(time_s, finished=format_now()),
        versions=list_versions(),
        **results,
    )


def make_failed(run: Run, inputs: Inputs, reason: str, entries: Sequence[Entry] = ()) -> RunRecord:
    """Return the record of a run without a result, which has cost what it reported last."""
    count, _, _, seconds = entries[-1] if entries else (0, 0.0, 0.0, 0.0)
    times = Times(build=0.0, compile=0.0, solve=seconds, objective=0.0)
    return make_record(run, inputs, times, status=f"failed: {reason}", counts={"f": count})


def _search_reported(run: Run, inputs: Inputs, send: Send) -> SearchEnd | str:
    """Return the end of a search, or its error as text: the class of a user's error exists in this process only."""
    try:
        return run_search(run, inputs, Reporter(send, run.evaluations))
    except ChangedFileError:
        raise
    except BaseException as error:
        return describe_error(error)


@contextmanager
def report_changes() -> Iterator[None]:
    """Raise ChangedFileError for what was there and right when the study began."""
    try:
        yield
    except GaitError as error:
        raise ChangedFileError(f"a file has changed since the study began: {error}") from error


def load_unchanged(run: Run, inputs: Inputs) -> GaitProblem:
    """Return the problem of a run; raises ChangedFileError if it is not that of the inputs."""
    with report_changes():
        problem = run.problem.load()
        if identify_problem(problem) != inputs.problem:
            raise InputError("the problem is another one now")
        return problem


def run_search(run: Run, inputs: Inputs, callback: Reporter | None = None) -> SearchEnd:
    """Run a search; raises ChangedFileError if a file is not the one whose hash is in the inputs."""
    started = time.perf_counter()
    problem = load_unchanged(run, inputs)
    with report_changes():
        files = run.read_code()
        if files is not None and files.digest != inputs.code:
            raise InputError("a file of a solver is another one now")
    built = time.perf_counter()
    objective = compile_objective(problem)
    compiled = time.perf_counter()
    folder = os.getcwd()
    try:
        result = minimize(
            objective,
            run.make_search(files),
            evaluations=run.evaluations,
            seed=run.run_seed,
            handling=make_handling(run.handling),
            time_limit_s=run.time_limit_s,
            callback=callback,
        )
    finally:
        os.chdir(folder)  # wrappers of external programs change it
    history, settings = result.history, describe_settings(result.algorithm)
    settings.pop("command", None)  # of a program: the inputs have it, and it names files
    columns = (history.evaluations, history.violation, history.objective, history.elapsed_s)
    return SearchEnd(
        x=np.array(result.x),
        entries=[(int(n), float(v), float(f), float(t)) for n, v, f, t in zip(*columns, strict=True)],
        failed=result.failed_evaluations,
        generations=result.generations,
        status="; ".join(result.reasons),
        settings={**settings, "handling": describe_settings(result.handling)},
        time_s=Times(
            build=built - started, compile=compiled - built, solve=result.time_s, objective=result.objective_time_s
        ),
    )


def judge_search(run: Run, inputs: Inputs, end: SearchEnd) -> RunRecord:
    """Return the record of a search, whose best point is judged."""
    sign, (evaluations, violation, objective, _) = inputs.objective.sign, end.entries[-1]
    course = [Best(n, sign * f if v == 0.0 and math.isfinite(f) else None, s) for n, v, f, s in end.entries]
    return judge_run(
        run,
        inputs,
        course,
        end.x,
        end.time_s,
        status=end.status,
        settings=end.settings,
        reported_feasible=violation == 0.0,
        reported_objective=sign * objective if math.isfinite(objective) else None,
        counts={"f": evaluations},
        failed_evaluations=end.failed,
        iterations=end.generations,
    )


def judge_run(run: Run, inputs: Inputs, course: Sequence[Best], x: Array, time_s: Times, **results: Any) -> RunRecord:
    """Return the record of a run that ends at x (n,): of its course the first entry, each change, and the last one."""
    problem, last = load_unchanged(run, inputs), len(course) - 1
    kept = [b for k, b in enumerate(course) if k in (0, last) or b.objective != course[k - 1].objective]
    return make_record(
        run,
        inputs,
        replace(time_s, history=tuple(best.time_s for best in kept)),
        x=problem.by_name(x),
        history=History(evaluations=tuple(b.calls for b in kept), objective=tuple(b.objective for b in kept)),
        **describe_evaluation(evaluate(problem, x, prove=False)),
        **results,
    )


def run_solver(run: Run, inputs: Inputs) -> RunRecord:
    """Run an NLP solver, from the given start or from a random point."""
    started = time.perf_counter()
    problem, solver = load_unchanged(run, inputs), run.make_solver()
    x0 = problem.check_within(run.start) if run.start else problem.start_point(np.random.default_rng(run.run_seed))
    outcome = solver.prepare(problem, PLANNED_RUNS).run(problem, x0)
    prepared_s = time.perf_counter() - started - outcome.time_s
    compile_s = min(outcome.compile_s, prepared_s)  # less where the process had the solver already
    settings = solver.to_dict()
    if outcome.linear_solver:
        settings["linear_solver"] = outcome.linear_solver
    solution = make_solution(problem, [outcome])
    # A solver that keeps no history has its end.
    end = Best(outcome.evaluations.f, outcome.objective if outcome.claimed else None, outcome.time_s)
    return judge_run(
        run,
        inputs,
        outcome.history or (end,),
        outcome.x,
        Times(build=prepared_s - compile_s, compile=compile_s, solve=outcome.time_s, objective=outcome.objective_s),
        settings=settings,
        status=solution.status if solver.name == IPOPT else outcome.status,  # other solvers are quoted
        reported_feasible=outcome.claimed,
        reported_objective=outcome.objective if math.isfinite(outcome.objective) else None,
        counts=outcome.evaluations.by_kind(),
        iterations=outcome.iterations,
        active_constraints=solution.active_constraints,
    )
