"""Finished results on disk, as JSON by key: each is computed once for equal inputs, so a command that is rerun continues."""

import json
import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, fields
from pathlib import Path
from types import ModuleType
from typing import Any, ClassVar, get_type_hints

import numpy as np

from nlp_gait.backends.identity import PROBES, describe_difference, fingerprint, hash_json, split_probes
from nlp_gait.backends.kernel.compiled import available_cores
from nlp_gait.backends.solvers import ipopt
from nlp_gait.backends.solvers.ipopt import IpoptSettings
from nlp_gait.backends.solvers.solver import Solver
from nlp_gait.errors import InputError, OutputError
from nlp_gait.files import make_writable_folder, read_json, remove_leftovers, write_json
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.solution import Best, Evaluations, Guess, Outcome
from nlp_gait.interrupts import never
from nlp_gait.processes import run_in_processes
from nlp_gait.progress import Progress, ignore_progress
from nlp_gait.user_code import remove_comments

FOLDER = "store"  # in the folder of the work
KEY_DIGITS = 20
CODE = "code_sha256"  # input: hash of the modules that compute a result
MISSING: Any = object()  # a result may be None


@dataclass(frozen=True, kw_only=True)
class Computation:
    """A named result: everything that it depends on, and the function that computes it (picklable for worker processes)."""

    name: str
    inputs: Mapping[str, Any]
    function: Callable[[], Any]


class Store:
    """Results in ``<folder>/store/<name>-<key>.json``, each with its inputs; the key is their hash, without probes of problems.

    A name may contain ``/`` for subfolders. Damaged files, and results of a problem that evaluates to other values now, are
    recomputed. Files are written in one step and flushed to the disk. ``folder`` is None if nothing is stored.

    Args:
        out: folder of the work; None stores nothing.
        report: receives a message if results can no longer be stored; without it, that raises OutputError.

    Raises:
        OutputError: the folder is not writable.
    """

    def __init__(self, out: Path | None = None, report: Progress | None = None) -> None:
        self.folder = None if out is None else make_writable_folder(out / FOLDER)
        self._report = report
        if self.folder is not None:
            for folder in (self.folder, *(path for path in self.folder.rglob("*") if path.is_dir())):
                remove_leftovers(folder)

    def compute(
        self,
        name: str,
        inputs: Mapping[str, Any],
        function: Callable[[], Any],
        *,
        code: Sequence[ModuleType] = (),
        progress: Progress = ignore_progress,
    ) -> Any:
        """Return a stored result, or compute and store it; arguments and errors as ``compute_all``."""
        computation = Computation(name=name, inputs=inputs, function=function)
        return self.compute_all([computation], jobs=1, code=code, progress=progress)[name]

    def compute_all(
        self,
        computations: Sequence[Computation],
        *,
        jobs: int | None = None,
        code: Sequence[ModuleType] = (),
        progress: Progress = ignore_progress,
    ) -> dict[str, Any]:
        """Return several results by name, as JSON gives them back; compute those that are not stored, and store each at once.

        Args:
            computations: with different names.
            jobs: worker processes; None for one on each processor, 1 for this process.
            code: modules that compute the results; the hash of their text is one of the inputs.
            progress: receives the name of each result when it is loaded, or before it is computed (in worker processes: after).

        Raises:
            OutputError: a result cannot be stored, and the store has no ``report``.
            ValueError: a result is no plain data, or not finite.
        """
        source = {CODE: _hash_code(code)} if code else {}
        inputs = {computation.name: {**computation.inputs, **source} for computation in computations}
        values = {name: self.load(name, inputs[name]) for name in inputs}
        waiting = {c.name: c.function for c in computations if values[c.name] is MISSING}
        for name in (name for name in inputs if name not in waiting):
            progress(f"{name}: stored by an earlier run")
        workers = min(jobs or available_cores(), len(waiting))
        if workers > 1:
            for name, value in run_in_processes(waiting, workers):
                progress(name)
                values[name] = self.save(name, inputs[name], value)
        else:
            for name, function in waiting.items():
                progress(name)
                values[name] = self.save(name, inputs[name], function())
        return values

    def load(self, name: str, inputs: Mapping[str, Any]) -> Any:
        """Return the stored result; ``MISSING`` if it is missing, damaged or of another problem."""
        path = self._locate(name, inputs)
        if path is None or not path.exists():
            return MISSING
        try:
            content = read_json(path, "result")
        except InputError:
            return MISSING
        if not isinstance(content, dict) or content.keys() != {"inputs", "result", "sha256"}:
            return MISSING
        is_intact = content["sha256"] == hash_json([content["result"], content["inputs"]])
        if not is_intact or not _have_same_probes(content["inputs"], inputs):
            return MISSING
        return content["result"]

    def save(self, name: str, inputs: Mapping[str, Any], value: Any) -> Any:
        """Store a result, and return it as ``load`` does; raises as ``compute_all``."""
        value, inputs = pass_through_json(value), pass_through_json(inputs)
        path = self._locate(name, inputs)
        if path is not None:
            try:
                make_writable_folder(path.parent)
                write_json(path, {"inputs": inputs, "result": value, "sha256": hash_json([value, inputs])})
            except OutputError as error:
                if self._report is None:
                    raise
                self.folder = None
                self._report(f"{error}; continuing without storing results")
        return value

    def _locate(self, name: str, inputs: Mapping[str, Any]) -> Path | None:
        key = hash_json(split_probes(inputs)[0])[:KEY_DIGITS]
        return None if self.folder is None else self.folder / f"{name}-{key}.json"


def _have_same_probes(stored: Any, inputs: Any) -> bool:
    """Return whether the problems in stored inputs evaluate to the same values as those in others with the same key."""
    before, after = split_probes(stored)[1], split_probes(pass_through_json(inputs))[1]
    pairs = zip(before, after, strict=False)
    return len(before) == len(after) and not any(describe_difference({PROBES: a}, {PROBES: b}) for a, b in pairs)


def _hash_code(modules: Sequence[ModuleType]) -> str:
    """Return the hash of the text of modules, without comments and docstrings."""
    return hash_json([remove_comments(Path(str(module.__file__)).read_bytes()).decode() for module in modules])


def pass_through_json(data: Any) -> Any:
    """Return plain data as JSON gives it back."""
    return json.loads(json.dumps(data, allow_nan=False))


FLOATS = tuple(name for name, hint in get_type_hints(Outcome).items() if hint is float)


def store_runs(store: Store, solver: Solver | None = None) -> Solver:
    """Return a solver that stores its finished runs and loads repeated ones: IPOPT with its defaults if None.

    A run is identified by the problem's mathematics and values, the solver's settings and the start point.
    """
    chosen = solver or IpoptSettings()
    return chosen if store.folder is None else _StoredSolver(chosen, store)


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
        outcome = self._load_or_run(
            problem, {"x0": _encode_array(x0)}, stop, lambda ready: ready.run(problem, x0, stop)
        )
        assert outcome is not None
        return outcome

    def run_from(self, problem: GaitProblem, near: Outcome, stop: Callable[[], bool] = never) -> Outcome | None:
        start = {
            "x0": _encode_array(near.x),
            "guess_sha256": None if near.guess is None else hash_json(encode_outcome(near.guess)),
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
        inputs[CODE] = _hash_code([ipopt])
        stored = self._store.load("solve", inputs)
        if stored is MISSING:
            outcome = run(self._solver.prepare(problem, self._solves))
            if stop():
                return outcome
            stored = self._store.save("solve", inputs, None if outcome is None else encode_outcome(outcome))
        return None if stored is None else parse_outcome(stored)


def encode_outcome(value: Any) -> Any:
    """Return an outcome or guess as plain data that preserves every bit."""
    if isinstance(value, (Outcome, Guess, Evaluations)):
        return {field.name: encode_outcome(getattr(value, field.name)) for field in fields(value)}
    if isinstance(value, np.ndarray):
        return _encode_array(value)
    if isinstance(value, float):
        return _number(value)
    return [encode_outcome(item) for item in value] if isinstance(value, tuple) else value


def _encode_array(array: Array) -> list[float | str]:
    return [_number(value) for value in array.tolist()]


def _number(value: float) -> float | str:
    return value if math.isfinite(value) else repr(value)  # JSON has no NaN and no infinity


def parse_outcome(raw: Mapping[str, Any]) -> Outcome:
    """Return the outcome of which ``encode_outcome`` made plain data."""
    guess = raw["guess"]
    outcome: dict[str, Any] = {name: float(value) if name in FLOATS else value for name, value in raw.items()}
    outcome |= {name: _decode_array(raw[name]) for name in ("x0", "x")}
    outcome["evaluations"] = Evaluations(**raw["evaluations"])
    outcome["history"] = tuple(Best(calls, None if f is None else float(f), float(t)) for calls, f, t in raw["history"])
    if guess is not None:
        multipliers = {name: _decode_array(guess[name]) for name in ("primal", "bounds", "rows")}
        outcome["guess"] = Guess(**multipliers, width=float(guess["width"]))
    return Outcome(**outcome)


def _decode_array(numbers: list[float | str]) -> Array:
    return np.array([float(number) for number in numbers])
