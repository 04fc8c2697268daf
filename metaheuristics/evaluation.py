"""Calls of the objective: checked, timed and counted, with the best so far."""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter

import numpy as np

from metaheuristics.array import Array, real_array
from metaheuristics.constraint_handling import FEASIBILITY, mark_failed
from metaheuristics.errors import SearchError
from metaheuristics.interface import BatchObjective
from metaheuristics.result import History

Callback = Callable[[Array, Array, Array], object]
"""Receives X (P, n), f (P,) and violation (P,) of a generation; f and violation are infinite where failed."""


class Evaluator:
    """Evaluates generations of one run and keeps its record.

    Attributes:
        evaluations: Evaluations so far, failed ones included.
        failed: Failed evaluations so far.
        objective_time_s: Time spent in the objective so far [s].
        best_x: (n,) best point so far by the feasibility rules.
        best: Its violation and objective, which compare as the rules do.
        stagnation: Generations since the best last improved.
        generations: So far.
    """

    def __init__(self, objective: BatchObjective, callback: Callback | None, thinned: bool = False) -> None:
        """Start the clock; a thinned history has one entry for each better point, and the last one."""
        self._objective = objective
        self._callback = callback
        self._thinned = thinned
        self._started = perf_counter()
        self._history: list[tuple[int, float, float, float]] = []
        self.evaluations = 0
        self.failed = 0
        self.objective_time_s = 0.0
        self.best_x: Array = np.empty(0)
        self.best = (np.inf, np.inf)
        self.stagnation = 0
        self.generations = 0

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

        self.evaluations += len(X)
        self.failed += int(np.count_nonzero(failed))
        leader = FEASIBILITY.best(f, violation)
        found = (float(violation[leader]), float(f[leader]))
        self.stagnation += 1
        if found < self.best or not self._history:
            self.best, self.best_x, self.stagnation = found, X[leader].copy(), 0
        self.generations += 1
        if self._thinned and self.stagnation > 1:
            self._history.pop()
        self._history.append((self.evaluations, self.best[1], self.best[0], self.elapsed_s))
        if self._callback is not None:
            self._callback(shown, f, violation)
        return f, violation

    def history(self) -> History:
        """Return the history so far as arrays."""
        columns = [np.array(column) for column in zip(*self._history, strict=True)]
        for column in columns:
            column.setflags(write=False)
        evaluations, objective, violation, elapsed_s = columns
        return History(evaluations=evaluations, objective=objective, violation=violation, elapsed_s=elapsed_s)


def _read_answer(answer: object, count: int) -> tuple[Array, Array]:
    """Turn what the objective returned into f and violation, or say what is wrong with it."""
    wanted = f"the objective must return (f, violation), two arrays of shape ({count},) for {count} points"
    if not isinstance(answer, tuple) or len(answer) != 2:
        raise SearchError(f"{wanted}; it returned {type(answer).__name__}: return a tuple of two arrays")
    try:
        f, violation = real_array(answer[0]), real_array(answer[1])
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
