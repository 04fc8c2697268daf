"""What a question has finished in its answer's folder, so that the same command goes on after a kill or Ctrl-C.

Every finished run of an NLP solver is a step of its own (``compare.study.steps``), under the hash of all that it depends on: the
problem's mathematics and values, the solver's settings, and the point where it began. Runs are deterministic, so a question that
is asked again takes the same way past them, and its answer is that of an undisturbed one.
"""

from __future__ import annotations

import math
import os
import weakref
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager, suppress
from dataclasses import fields
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from compare.study.steps import Steps, as_json
from nlp_gait.backends.identity import fingerprint, sha256_of
from nlp_gait.backends.solvers import ipopt, stages
from nlp_gait.backends.solvers.ipopt import IpoptSettings
from nlp_gait.backends.solvers.solver import Solver
from nlp_gait.errors import OutputError
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.solution import Best, Evaluations, Guess, Outcome
from nlp_gait.interrupts import never
from nlp_gait.progress import Progress, ignore_progress

KEPT, MADE = b"k", b"m"
NAME_DIGITS = 20  # of a hash, in the name of a run's file
FLOATS = tuple(field.name for field in fields(Outcome) if field.type == "float")


class Finished:
    """Steps of a question in its folder; without a folder nothing is kept.

    Attributes:
        anew: told what has changed if the question was asked otherwise before.

    Args:
        out: folder of the answer, or None.
        anew: see above.
    """

    def __init__(self, out: Path | None = None, anew: Progress = ignore_progress) -> None:
        self.anew = anew
        self._steps = None if out is None else Steps(out, ignore_progress, code=[ipopt, stages], anew=anew)
        self._counts = None if out is None else _Counts()

    def asked(self, question: str, problem: GaitProblem, **inputs: Any) -> None:
        """Say what has changed since this question was asked of a problem of this name, and remember how it is asked now."""
        if self._steps is not None:
            with self._room():
                self._steps(f"{question}-{problem.name}", {**fingerprint(problem), **inputs}, lambda: None)

    def step(self, name: str, inputs: Mapping[str, Any], compute: Callable[[], Any]) -> Any:
        """Result of a step as plain data, see ``Steps``; its file is called after the hash of its inputs too.

        Where it cannot be kept, ``anew`` is told so once, and nothing is kept from there on: the answer itself may be printed.
        """
        if self._steps is None:
            return as_json(compute())
        name = f"{name}-{sha256_of(inputs)[:NAME_DIGITS]}"
        if (found := self._steps.kept(name, inputs)) is not None:
            self._count(KEPT)
            return found.result
        self._count(MADE)
        computed = compute()
        with self._room():
            return self._steps.keep(name, inputs, computed)
        return as_json(computed)

    @contextmanager
    def _room(self) -> Iterator[None]:
        """Goes on without keeping anything where a file cannot be written."""
        try:
            yield
        except OutputError as error:
            self._steps = None
            self.anew(f"{error}; goes on without keeping what is finished")

    def solver(self, solver: Solver | None = None) -> Solver:
        """A solver whose finished runs are kept; None for IPOPT with its defaults."""
        chosen = solver or IpoptSettings()
        return chosen if self._steps is None else _KeptSolver(chosen, self)

    @property
    def sentence(self) -> str:
        """How much an earlier call had finished; empty if nothing."""
        counted = Counter() if self._counts is None else self._counts.so_far()
        return f"{counted[KEPT]} of {counted.total()} steps were finished by an earlier call" if counted[KEPT] else ""

    def _count(self, step: bytes) -> None:
        if self._counts is not None:
            self._counts.add(step)


class _Counts:
    """Steps that this process and its forks, which make starts side by side, have taken from files or made."""

    def __init__(self) -> None:
        self._counted: Counter[bytes] = Counter()
        self._ends, self._owner = os.pipe(), os.getpid()
        for end in self._ends:
            os.set_blocking(end, False)
            weakref.finalize(self, os.close, end)

    def add(self, step: bytes) -> None:
        """Count a step, in whichever process: a single byte is written at once or not at all."""
        if os.getpid() == self._owner:
            self._counted[step] += 1
        else:
            with suppress(BlockingIOError):  # 65,536 steps that nobody asked about
                os.write(self._ends[1], step)

    def so_far(self) -> Counter[bytes]:
        """By kind."""
        with suppress(BlockingIOError):
            while True:
                self._counted.update(bytes([step]) for step in os.read(self._ends[0], 65_536))
        return self._counted


class _Interrupted(Exception):
    """A run was stopped where it was, so it is not finished."""

    def __init__(self, outcome: Outcome | None) -> None:
        self.outcome = outcome


class _KeptSolver(Solver):
    """A solver that takes runs which are finished from their files; it is made ready only for those that are not."""

    name: ClassVar[str] = "kept"

    def __init__(self, solver: Solver, finished: Finished, solves: int = 1) -> None:
        self._solver, self._finished, self._solves = solver, finished, solves

    def prepare(self, problem: GaitProblem, solves: int = 1) -> Solver:
        self._solver.check(problem)
        return _KeptSolver(self._solver, self._finished, solves)

    def choose_settings(self, problem: GaitProblem, solves: int = 1) -> Solver:
        return self._solver.choose_settings(problem, solves)

    def check(self, problem: GaitProblem) -> None:
        self._solver.check(problem)

    def to_dict(self) -> dict[str, Any]:
        return self._solver.to_dict()

    def run(self, problem: GaitProblem, x0: Array, stop: Callable[[], bool] = never) -> Outcome:
        found = self._kept(problem, {"x0": _numbers(x0)}, stop, lambda ready: ready.run(problem, x0, stop))
        assert found is not None
        return found

    def run_from(self, problem: GaitProblem, near: Outcome, stop: Callable[[], bool] = never) -> Outcome | None:
        start = {"x0": _numbers(near.x), "guess_sha256": None if near.guess is None else sha256_of(_plain(near.guess))}
        return self._kept(problem, start, stop, lambda ready: ready.run_from(problem, near, stop))

    def _kept(
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
            return None if outcome is None else _plain(outcome)

        try:
            kept = self._finished.step("solve", inputs, compute)
        except _Interrupted as interrupted:
            return interrupted.outcome
        return None if kept is None else _outcome(kept)


def _plain(value: Any) -> Any:
    """An outcome or guess as plain data that gives back every bit."""
    if isinstance(value, (Outcome, Guess, Evaluations)):
        return {field.name: _plain(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, np.ndarray):
        return _numbers(value)
    if isinstance(value, float):
        return _number(value)
    return [_plain(item) for item in value] if isinstance(value, tuple) else value


def _numbers(array: Array) -> list[float | str]:
    return [_number(value) for value in array.tolist()]


def _number(value: float) -> float | str:
    """JSON has no NaN and no infinity: these are text."""
    return value if math.isfinite(value) else repr(value)


def _outcome(raw: Mapping[str, Any]) -> Outcome:
    """The outcome that ``_plain`` was given."""
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
