"""Finished results on disk: each is computed once for equal inputs, so that an interrupted command can be rerun to continue."""

import io
import json
import math
import tempfile
import weakref
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, fields
from pathlib import Path
from types import ModuleType
from typing import Any, ClassVar, NamedTuple, get_type_hints

import numpy as np

from compare.study.definition import describe_input_differences
from nlp_gait.backends.identity import PROBES, describe_difference, fingerprint, hash_json, split_probes
from nlp_gait.backends.kernel.compiled import available_cores
from nlp_gait.backends.solvers import ipopt
from nlp_gait.backends.solvers.ipopt import IpoptSettings
from nlp_gait.backends.solvers.solver import Solver
from nlp_gait.errors import InputError, OutputError
from nlp_gait.files import make_writable_folder, read_bytes, read_json, remove_leftovers, replace_file, write_json
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.solution import Best, Evaluations, Guess, Outcome
from nlp_gait.interrupts import never
from nlp_gait.processes import run_in_processes
from nlp_gait.progress import Progress, ignore_progress
from nlp_gait.user_code import remove_comments

FOLDER = "store"  # in the folder of the work
KEY = "{key}"  # in a name
KEY_DIGITS = 20
IDENTITY = "identity"  # array with the inputs and the names of all others, as JSON
CODE = "code_sha256"  # input: hash of the modules that compute a result
STORED, COMPUTED = b"s", b"c"


@dataclass(frozen=True, kw_only=True)
class Computation:
    """A named result: everything that it depends on, and the function that computes it (picklable for worker processes)."""

    name: str
    inputs: Mapping[str, Any]
    function: Callable[[], Any]


class StoredResult(NamedTuple):
    """A stored result: its value, which may be None, and the inputs from which it was computed."""

    value: Any
    inputs: Mapping[str, Any]


class Store:
    """Results in ``<folder>/store/<name>.json`` or ``.npz``, each with its inputs and their hash.

    A name may contain ``/`` for subfolders, and ``{key}`` for the hash of the inputs: results of different inputs then lie next
    to each other; otherwise a new result replaces the old one. Damaged files are recomputed. Files are written in one step and
    flushed to the disk. ``folder`` is None if nothing is stored.

    Args:
        out: folder of the work; None stores nothing.
        report: receives a message for each result that is recomputed because its inputs have changed, and one if results can no
            longer be stored. Without it, the progress of the computation receives the former and the latter raises OutputError.

    Raises:
        OutputError: the folder is not writable.
    """

    def __init__(self, out: Path | None = None, report: Progress | None = None) -> None:
        self.folder = None if out is None else make_writable_folder(out / FOLDER)
        self._report = report
        self._counted: set[Path | None] = set()  # one run may need a result several times
        self._counts = tempfile.TemporaryFile("w+b", buffering=0)  # noqa: SIM115  one byte for each result, shared with forks
        weakref.finalize(self, self._counts.close)
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
            code: modules that compute the results; these are recomputed when the text of one has changed.
            progress: receives the name of each result when it is loaded, or before it is computed (in worker processes: after).

        Raises:
            OutputError: a result cannot be stored, and the store has no ``report``.
            ValueError: a result is no plain data, or not finite.
        """
        source = {CODE: _hash_code(code)} if code else {}
        inputs = {computation.name: {**computation.inputs, **source} for computation in computations}
        values: dict[str, Any] = dict.fromkeys(inputs)
        waiting: dict[str, Callable[[], Any]] = {}
        notes: dict[str, str] = {}
        for computation in computations:
            name = computation.name
            result, notes[name] = self._find(name, inputs[name])
            self._count(COMPUTED if result is None else STORED, self._path(name, inputs[name], ".json"))
            if result is None:
                waiting[name] = computation.function
            else:
                progress(f"{name}: stored by an earlier run")
                values[name] = result.value
        workers = min(jobs or available_cores(), len(waiting))
        if workers > 1:
            for name, value in run_in_processes(waiting, workers):
                progress(notes[name])
                values[name] = self.save(name, inputs[name], value)
        else:
            for name, function in waiting.items():
                progress(notes[name])
                values[name] = self.save(name, inputs[name], function())
        return values

    def load(self, name: str, inputs: Mapping[str, Any] | None = None) -> StoredResult | None:
        """Return the stored result; None if it is missing, damaged or of other inputs (inputs None accepts any)."""
        path = self._path(name, inputs, ".json")
        if path is None or not path.exists():
            return None
        try:
            content = read_json(path, "result")
        except InputError:
            return None
        if not isinstance(content, dict) or not content.keys() >= {"inputs", "result", "sha256", "result_sha256"}:
            return None
        intact = content["result_sha256"] == hash_json([content["result"], content["inputs"]])
        fits = inputs is None or (
            content["sha256"] == _hash_inputs(inputs) and _has_same_probes(content["inputs"], inputs)
        )
        return StoredResult(content["result"], content["inputs"]) if intact and fits else None

    def save(self, name: str, inputs: Mapping[str, Any], value: Any) -> Any:
        """Store a result, and return it as ``load`` does; raises as ``compute_all``."""
        value, inputs = pass_through_json(value), pass_through_json(inputs)
        hashes = {"sha256": _hash_inputs(inputs), "result_sha256": hash_json([value, inputs])}
        with self._writing(name, inputs, ".json") as path:
            if path is not None:
                write_json(path, {"inputs": inputs, "result": value, **hashes})
        return value

    def load_arrays(self, name: str, inputs: Mapping[str, Any]) -> dict[str, Array] | None:
        """Return stored arrays by name; None as for ``load``."""
        path = self._path(name, inputs, ".npz")
        if path is None or not path.exists():
            return None
        try:
            with np.load(io.BytesIO(read_bytes(path, "result")), allow_pickle=False) as archive:
                arrays = {key: np.asarray(archive[key]) for key in archive}
        except Exception:  # NumPy and zipfile raise a dozen kinds of errors on damaged archives
            return None
        identity = str(arrays.pop(IDENTITY, ""))
        try:
            stored = json.loads(identity)
        except ValueError:
            return None
        wanted = pass_through_json(_identify_arrays(inputs, arrays))
        same = split_probes(stored)[0] == split_probes(wanted)[0] and _has_same_probes(stored, wanted)
        return arrays if same else None

    def save_arrays(self, name: str, inputs: Mapping[str, Any], arrays: Mapping[str, Array]) -> None:
        """Store arrays by name as an npz file; raises OutputError as ``compute_all``."""
        with self._writing(name, inputs, ".npz") as path:
            if path is not None:
                with replace_file(path) as temporary, open(temporary, "wb") as file:
                    identity = np.array(json.dumps(_identify_arrays(inputs, arrays), sort_keys=True))
                    np.savez_compressed(file, allow_pickle=False, **arrays, **{IDENTITY: identity})

    def report_changes(self, question: str, problem: GaitProblem, **inputs: Any) -> None:
        """Report what has changed since a question about a problem was last answered in this folder, and store its inputs."""
        name, inputs = f"{question}-{problem.name}", {**fingerprint(problem), **inputs}
        if self._find(name, inputs)[0] is None:
            self.save(name, inputs, None)

    @property
    def summary(self) -> str:
        """How many results were stored by an earlier run, as a sentence; empty if none."""
        self._counts.seek(0)
        counts = Counter(self._counts.read())
        stored = counts[STORED[0]]
        return f"{stored} of {counts.total()} results were stored by an earlier run" if stored else ""

    def _find(self, name: str, inputs: Mapping[str, Any]) -> tuple[StoredResult | None, str]:
        """Result, and what to say when it is computed."""
        result = self.load(name, inputs)
        outdated = self.load(name) if result is None and KEY not in name else None
        if outdated is None:
            return result, name
        message = f"{name}: recomputed: {describe_input_differences(outdated.inputs, pass_through_json(inputs))}"
        if self._report is None:
            return None, message
        self._report(message)
        return None, name

    def _path(self, name: str, inputs: Mapping[str, Any] | None, suffix: str) -> Path | None:
        if self.folder is None:
            return None
        return self.folder / f"{name.replace(KEY, _hash_inputs(inputs)[:KEY_DIGITS])}{suffix}"

    @contextmanager
    def _writing(self, name: str, inputs: Mapping[str, Any], suffix: str) -> Iterator[Path | None]:
        """Path to write to; after a failure nothing more is stored if there is someone to report it to."""
        path = self._path(name, inputs, suffix)
        try:
            if path is not None and not path.parent.is_dir():
                make_writable_folder(path.parent)
            yield path
        except OutputError as error:
            if self._report is None:
                raise
            self.folder = None
            self._report(f"{error}; continuing without storing results")

    def _count(self, kind: bytes, path: Path | None) -> None:
        if path is None or path not in self._counted:
            self._counted.add(path)
            with suppress(OSError):
                self._counts.write(kind)


def _identify_arrays(inputs: Mapping[str, Any], arrays: Mapping[str, Array]) -> dict[str, Any]:
    return {"inputs": inputs, "arrays": sorted(arrays)}


def _hash_inputs(inputs: Mapping[str, Any] | None) -> str:
    return hash_json(split_probes(inputs)[0])


def _has_same_probes(stored: Any, inputs: Any) -> bool:
    """Return whether the problems in stored inputs evaluate to the same values as those in others with the same key."""
    before, after = split_probes(stored)[1], split_probes(pass_through_json(inputs))[1]
    pairs = zip(before, after, strict=True)
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
        found = self._load_or_run(problem, {"x0": _encode_array(x0)}, stop, lambda ready: ready.run(problem, x0, stop))
        assert found is not None
        return found

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

        def compute() -> Any:
            outcome = run(self._solver.prepare(problem, self._solves))
            if stop():
                raise _Interrupted(outcome)
            return None if outcome is None else encode_outcome(outcome)

        try:
            stored = self._store.compute("solve-{key}", inputs, compute, code=[ipopt])
        except _Interrupted as interrupted:
            return interrupted.outcome
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
    found: dict[str, Any] = {name: float(value) if name in FLOATS else value for name, value in raw.items()}
    found |= {name: _decode_array(raw[name]) for name in ("x0", "x")}
    found["evaluations"] = Evaluations(**raw["evaluations"])
    found["history"] = tuple(Best(calls, None if f is None else float(f), float(t)) for calls, f, t in raw["history"])
    if guess is not None:
        multipliers = {name: _decode_array(guess[name]) for name in ("primal", "bounds", "rows")}
        found["guess"] = Guess(**multipliers, width=float(guess["width"]))
    return Outcome(**found)


def _decode_array(numbers: list[float | str]) -> Array:
    return np.array([float(number) for number in numbers])
