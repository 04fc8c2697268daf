"""A solver whose finished runs are stored, so that an interrupted question can be rerun to continue."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import fields
from typing import Any, ClassVar

import numpy as np

from compare.study.store import Store
from nlp_gait.backends.identity import fingerprint, hash_json
from nlp_gait.backends.solvers import ipopt
from nlp_gait.backends.solvers.ipopt import IpoptSettings
from nlp_gait.backends.solvers.solver import Solver
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.solution import Best, Evaluations, Guess, Outcome
from nlp_gait.interrupts import never

FLOATS = tuple(field.name for field in fields(Outcome) if field.type == "float")


def store_runs(store: Store, solver: Solver | None = None) -> Solver:
    """Return a solver that stores its finished runs and loads repeated ones: IPOPT with its defaults if None.

    A run is identified by the problem's mathematics and values, the solver's settings and the start point.
    """
    chosen = solver or IpoptSettings()
    return chosen if store.folder is None else _StoredSolver(chosen, store)


class _Interrupted(Exception):
    def __init__(self, outcome: Outcome | None) -> None:
        self.outcome = outcome


class _StoredSolver(Solver):
    """A solver that loads stored runs, and is prepared only for those that are not stored."""

    name: ClassVar[str] = "stored"

    def __init__(self, solver: Solver, store: Store, solves: int = 1) -> None:
        self._solver, self._store, self._solves = solver, store, solves

    def prepare(self, problem: GaitProblem, solves: int = 1) -> Solver:
        self._solver.check(problem)
        return _StoredSolver(self._solver, self._store, solves)

    def choose_settings(self, problem: GaitProblem, solves: int = 1) -> Solver:
        return self._solver.choose_settings(problem, solves)

    def check(self, problem: GaitProblem) -> None:
        self._solver.check(problem)

    def to_dict(self) -> dict[str, Any]:
        return self._solver.to_dict()

    def run(self, problem: GaitProblem, x0: Array, stop: Callable[[], bool] = never) -> Outcome:
        found = self._load_or_run(problem, {"x0": _numbers(x0)}, stop, lambda ready: ready.run(problem, x0, stop))
        assert found is not None
        return found

    def run_from(self, problem: GaitProblem, near: Outcome, stop: Callable[[], bool] = never) -> Outcome | None:
        start = {
            "x0": _numbers(near.x),
            "guess_sha256": None if near.guess is None else hash_json(plain_outcome(near.guess)),
        }
        return self._load_or_run(problem, start, stop, lambda ready: ready.run_from(problem, near, stop))

    def _load_or_run(
        self,
        problem: GaitProblem,
        start: Mapping[str, Any],
        stop: Callable[[], bool],
        run: Callable[[Solver], Outcome | None],
    ) -> Outcome | None:
        settings = self._solver.choose_settings(problem, self._solves)
        inputs = {**fingerprint(problem), "solver": settings.name, "settings": settings.to_dict(), **start}

        def compute() -> Any:
            outcome = run(self._solver.prepare(problem, self._solves))
            if stop():
                raise _Interrupted(outcome)
            return None if outcome is None else plain_outcome(outcome)

        try:
            stored = self._store.compute("solve-{key}", inputs, compute, code=[ipopt])
        except _Interrupted as interrupted:
            return interrupted.outcome
        return None if stored is None else parse_outcome(stored)


def plain_outcome(value: Any) -> Any:
    """Return an outcome or guess as plain data that preserves every bit."""
    if isinstance(value, (Outcome, Guess, Evaluations)):
        return {field.name: plain_outcome(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, np.ndarray):
        return _numbers(value)
    if isinstance(value, float):
        return _number(value)
    return [plain_outcome(item) for item in value] if isinstance(value, tuple) else value


def _numbers(array: Array) -> list[float | str]:
    return [_number(value) for value in array.tolist()]


def _number(value: float) -> float | str:
    return value if math.isfinite(value) else repr(value)  # JSON has no NaN and no infinity


def parse_outcome(raw: Mapping[str, Any]) -> Outcome:
    """Return the outcome of which ``plain_outcome`` made plain data."""
    guess = raw["guess"]
    found: dict[str, Any] = {name: float(value) if name in FLOATS else value for name, value in raw.items()}
    found |= {name: _array(raw[name]) for name in ("x0", "x")}
    found["evaluations"] = Evaluations(**raw["evaluations"])
    found["history"] = tuple(Best(calls, None if f is None else float(f), float(t)) for calls, f, t in raw["history"])
    if guess is not None:
        multipliers = {name: _array(guess[name]) for name in ("primal", "bounds", "rows")}
        found["guess"] = Guess(**multipliers, width=float(guess["width"]))
    return Outcome(**found)


def _array(numbers: list[float | str]) -> Array:
    return np.array([float(number) for number in numbers])
