"""The only loop: ask, evaluate, record, tell; and the record of a run."""

import math
import sys
from collections.abc import Callable
from contextlib import AbstractContextManager, suppress
from dataclasses import dataclass, field
from functools import cache
from threading import Lock
from time import perf_counter

import numpy as np
from numpy.typing import ArrayLike, NDArray
from threadpoolctl import ThreadpoolController

from metaheuristics import interface, preparation
from metaheuristics.errors import SearchError, abbreviate, is_number
from metaheuristics.interface import (
    Algorithm,
    Array,
    BatchObjective,
    CallingSearch,
    ConstraintHandling,
    Deb,
    Ended,
    Rule,
    Search,
)

# Packages whose searches and objectives use NumPy's BLAS and LAPACK alone.
WITHOUT_SCIPY = ("metaheuristics.algorithms", "nlp_gait", "compare")


def limit_blas_threads(*users: object) -> AbstractContextManager[object]:
    """Return a context in which the BLAS and LAPACK that objects may use have one thread, so that equal seeds give equal bits."""
    if not all(type(user).__module__.startswith(WITHOUT_SCIPY) for user in users):
        import scipy.linalg  # noqa: F401  its LAPACK is not NumPy's, and only loaded libraries are found
    libraries = _find_libraries("scipy.linalg" in sys.modules)
    limits: AbstractContextManager[object] = libraries.limit(limits=1, user_api="blas")
    return limits


@cache
def _find_libraries(with_scipy: bool) -> ThreadpoolController:
    return ThreadpoolController()


Callback = Callable[[Array, Array, Array], object]
"""Receives X (P, n), f (P,) and violation (P,) of a generation; f and violation are infinite where failed."""


def mark_failed(f: Array, violation: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Return copies of f and violation (P,) with infinity where either is NaN or infinite, and the (P,) mask of these."""
    failed = ~(np.isfinite(f) & np.isfinite(violation))
    return np.where(failed, np.inf, f), np.where(failed, np.inf, violation), failed


class Evaluator:
    """Evaluates generations of one run and keeps its record."""

    def __init__(self, objective: BatchObjective, callback: Callback | None, thinned: bool = False) -> None:
        """Start the clock; a thinned history has one entry for each better point, and the last one."""
        self._objective = objective
        self._callback = callback
        self._thinned = thinned
        self._started = perf_counter()
        self._history: list[tuple[int, float, float, float]] = []
        self.evaluations = 0  #: so far, failed ones included
        self.failed = 0  #: failed evaluations so far
        self.objective_time_s = 0.0  #: spent in the objective so far [s]
        self.best_x: Array = np.empty(0)  #: (n,) best point so far by the feasibility rules
        self.best = (np.inf, np.inf)  #: its violation and objective, which compare as the rules do
        self.stagnation = 0  #: generations since the best last improved
        self.generations = 0  #: so far

    @property
    def elapsed_s(self) -> float:
        """Time since the start [s]."""
        return perf_counter() - self._started

    def __call__(self, X: Array) -> tuple[Array, Array]:
        """Evaluate points (P, n), record them and call the callback.

        Returns:
            (P,) objectives and (P,) violations, new arrays, infinite where failed.

        Raises:
            SearchError: The objective does not return two arrays of P numbers, or a violation is negative.
        """
        shown = X.view()
        shown.flags.writeable = False
        before = perf_counter()
        answer = self._objective(shown)
        self.objective_time_s += perf_counter() - before
        f, violation, failed = mark_failed(*_read_answer(answer, len(X)))
        leader = interface.FEASIBILITY.best(f, violation)
        best = (float(violation[leader]), float(f[leader]))
        self._record(len(X), int(np.count_nonzero(failed)), X[leader], best, self.elapsed_s)
        if self._callback is not None:
            self._callback(shown, f, violation)
        return f, violation

    def evaluate_point(self, x: Array) -> tuple[float, float]:
        """Evaluate one point (n,) by the objective's function ``point``, and record it; infinite where it failed."""
        before = perf_counter()
        f, violation = self._objective.point(x)  # type: ignore[attr-defined]
        now = perf_counter()
        self.objective_time_s += now - before
        failed = not (math.isfinite(f) and math.isfinite(violation))
        if failed:
            f = violation = math.inf
        self._record(1, failed, x, (violation, f), now - self._started)
        return f, violation

    def _record(self, count: int, failed: int, x: Array, best: tuple[float, float], elapsed_s: float) -> None:
        """Record a generation by its best point, and the time since the start."""
        self.evaluations += count
        self.failed += failed
        self.generations += 1
        self.stagnation += 1
        if best < self.best or not self._history:
            self.best, self.best_x, self.stagnation = best, x.copy(), 0
        entry = (self.evaluations, self.best[1], self.best[0], elapsed_s)
        if self._thinned and self.stagnation > 1:
            self._history[-1] = entry
        else:
            self._history.append(entry)

    def history(self) -> interface.History:
        """Return the history so far as arrays."""
        columns = [np.array(column) for column in zip(*self._history, strict=True)]
        for column in columns:
            column.setflags(write=False)
        evaluations, objective, violation, elapsed_s = columns
        return interface.History(evaluations=evaluations, objective=objective, violation=violation, elapsed_s=elapsed_s)


def _read_answer(answer: object, count: int) -> tuple[Array, Array]:
    """Turn what the objective returned into f and violation, or say what is wrong with it."""
    wanted = f"the objective must return (f, violation), two arrays of shape ({count},) for {count} points"
    if not isinstance(answer, tuple) or len(answer) != 2:
        raise SearchError(f"{wanted}; it returned {type(answer).__name__}: return a tuple of two arrays")
    try:
        f, violation = interface.to_real_array(answer[0]), interface.to_real_array(answer[1])
    except (TypeError, ValueError) as error:
        raise SearchError(f"{wanted}; it returned something other than real numbers: {error}") from error
    if f.shape != (count,) or violation.shape != (count,):
        raise SearchError(f"{wanted}; got shapes {f.shape} and {violation.shape}: give one number per row of X")
    negative = violation < 0.0
    if negative.any():
        row = int(negative.argmax())
        raise SearchError(
            f"the violation must be >= 0, zero if and only if feasible; row {row} has {violation[row]}: "
            "sum max(0, g) over the constraints g <= 0"
        )
    return f, violation


@dataclass(kw_only=True)
class _Run:
    """A search under way: its record, and why it ends."""

    record: Evaluator
    algorithm: Algorithm
    evaluations: int
    handling: ConstraintHandling
    seed: int
    time_limit_s: float | None = None
    point: Callable[[Array], tuple[float, float]] | None = None  # see ``Evaluate``
    reasons: list[str] = field(default_factory=list)
    lock: AbstractContextManager[object] = field(default_factory=Lock)  # a function may call from several threads

    def __call__(self, points: Array) -> tuple[Array, Array, Rule]:
        """Evaluate the part of a generation that fits the budget; raise `Ended` once a limit is reached."""
        with self.lock:
            self._check_end()  # a function ignored the first `Ended`
            f, violation = self.record(points[: self.evaluations - self.record.evaluations])
            self._list_reasons()
            self._check_end()
            return f, violation, self.handling.rule()

    def evaluate_point(self, x: Array) -> tuple[float, float]:
        """Evaluate one point (n,), as ``__call__`` does."""
        with self.lock:
            self._check_end()
            values = self.record.evaluate_point(x)
            self._list_reasons()
            self._check_end()
            return values

    def end(self, reason: str) -> list[str]:
        """Let nothing be evaluated any more; return why the run ended."""
        with self.lock:
            self.reasons = self.reasons or [reason]
        return self.reasons

    def _list_reasons(self) -> None:
        if self.record.evaluations >= self.evaluations:
            self.reasons.append("evaluation budget used")
        if self.time_limit_s is not None and self.record.elapsed_s >= self.time_limit_s:
            self.reasons.append("time limit reached")

    def _check_end(self) -> None:
        if self.reasons:
            raise Ended

    def conclude(self, reasons: list[str]) -> interface.Result:
        """Return the result of a run that ended for these reasons."""
        record = self.record
        all_failed = record.failed == record.evaluations
        record.best_x.setflags(write=False)
        return interface.Result(
            x=record.best_x,
            objective=record.best[1],
            violation=record.best[0],
            evaluations=record.evaluations,
            failed_evaluations=record.failed,
            generations=record.generations,
            history=record.history(),
            reasons=tuple(reasons + ["every evaluation failed"] * all_failed),
            time_s=record.elapsed_s,
            objective_time_s=record.objective_time_s,
            algorithm=self.algorithm,
            handling=self.handling,
            seed=self.seed,
        )


def minimize(
    objective: BatchObjective,
    algorithm: Algorithm,
    *,
    evaluations: int = 10_000,
    seed: int = 0,
    handling: ConstraintHandling | None = None,
    time_limit_s: float | None = None,
    initial: ArrayLike | None = None,
    callback: Callback | None = None,
) -> interface.Result:
    """Minimise an objective within bounds and constraints.

    The starting points are uniform within the bounds and depend on the seed alone: runs of different algorithms with
    equal seed are paired, and with different populations the first rows agree. Equal arguments give a bit-identical
    result, unless a time limit ends the run.

    Args:
        objective: What to minimise; it must not depend on the order of calls.
        algorithm: Settings of the search.
        evaluations: Budget. It is never exceeded: of the last generation only the first rows that fit are evaluated.
        seed: A whole number >= 0.
        handling: How constraints enter the comparisons within the search, by default by Deb's rules, by which the best
            point is reported in any case.
        time_limit_s: The search ends after the first generation that ends beyond this time [s].
        initial: (R, n) points within the bounds that replace the first R starting points, R <= population.
        callback: Called after each generation with X, f and violation, which it may keep but must not change; f and
            violation are infinite where the evaluation failed.

    Returns:
        The result: there is always a best point, and the reasons for ending.

    Raises:
        SearchError: An argument is not allowed, or the objective answers with wrong shapes.
        Interrupted: Ctrl-C after at least one generation; carries the partial result.
    """
    handling = Deb() if handling is None else handling
    if time_limit_s is not None and not (is_number(time_limit_s) and time_limit_s > 0.0):
        raise SearchError(f"time_limit_s must be > 0, or None for no limit, got {abbreviate(time_limit_s)}")
    preparation.check_budget(algorithm, evaluations)
    preparation.check_helpers(handling, callback)
    start = preparation.prepare_start(objective, algorithm.population, evaluations, seed, initial, time_limit_s)
    search = algorithm.start(start)
    # A search that calls the objective evaluates point by point.
    record = Evaluator(objective, callback, thinned=isinstance(search, CallingSearch))
    run = _Run(record=record, algorithm=algorithm, evaluations=evaluations, handling=handling, seed=seed)
    run.time_limit_s = time_limit_s
    if callback is None and isinstance(handling, Deb) and callable(getattr(objective, "point", None)):
        run.point = run.evaluate_point
    try:
        with limit_blas_threads(algorithm, objective), suppress(Ended):
            return run.conclude(_search(search, run, start))
        return run.conclude(run.reasons)
    except KeyboardInterrupt as interrupt:
        if not record.generations:
            raise
        run.end("interrupted")
        raise interface.Interrupted(run.conclude(["interrupted"])) from interrupt


def _search(search: Search | CallingSearch, run: _Run, start: interface.Start) -> list[str]:
    """Run a search to its own end; return its reasons."""
    if isinstance(search, CallingSearch):
        reasons = run.end(search.run(run))
        if not run.record.generations:
            raise SearchError(f"f was never called: {reasons[0]}")
        return reasons
    while True:
        X = preparation.check_points(search.ask(), start.lower, start.upper)
        search.tell(X, *run(X))
        if ends := search.stop():
            return list(ends)
