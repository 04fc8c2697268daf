"""Results of long computations in a folder, so that a command that is rerun continues."""

import json
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from pathlib import Path
from typing import Any

from nlp_gait import __version__
from nlp_gait.backends.exact import hash_json
from nlp_gait.errors import InputError
from nlp_gait.files import make_writable_folder, read_json, write_json
from nlp_gait.interrupts import Progress, ignore_progress
from nlp_gait.processes import Job, run_jobs

Computation = tuple[Mapping[str, Any], Callable[[], Any]]
"""Everything that a result depends on, and the function that computes it, picklable for worker processes."""

FOLDER = "store"  # in the folder of the work
KEY_DIGITS = 20


class Memo:
    """Plain data in ``<folder>/store/<name>-<hash of inputs and version>.json``; a damaged file is computed again.

    Args:
        out: folder of the work; None stores nothing.

    Raises:
        OutputError: the folder is not writable, or a result cannot be stored.
    """

    def __init__(self, out: Path | None = None) -> None:
        self.folder = None if out is None else make_writable_folder(out / FOLDER)

    def compute(self, name: str, inputs: Mapping[str, Any], function: Callable[[], Any]) -> Any:
        """Return a stored result, or compute and store it, as JSON gives it back."""
        return self.compute_all({name: (inputs, function)})[name]

    def compute_all(
        self,
        computations: Mapping[str, Computation],
        jobs: int = 1,
        progress: Progress = ignore_progress,
    ) -> dict[str, Any]:
        """Return results by name from their inputs and functions; the missing ones are computed by ``jobs`` processes."""
        paths = {name: self._locate(name, inputs) for name, (inputs, _) in computations.items()}
        stored = {name: _read(path) for name, path in paths.items()}
        values = {name: content["result"] for name, content in stored.items() if "result" in content}
        for name in values:
            progress(f"{name}: stored by an earlier run")
        missing = [name for name in computations if name not in values]
        calls = [partial(_call, computations[name][1]) for name in missing]
        if jobs == 1 or len(missing) < 2:
            results: Iterable[tuple[int, Any]] = ((number, call()) for number, call in enumerate(calls))
        else:
            results = run_jobs([Job(call=call) for call in calls], jobs)
        for number, result in results:
            if isinstance(result, BaseException):
                raise result
            values[missing[number]] = _store(paths[missing[number]], result)
            progress(missing[number])
        return values

    def _locate(self, name: str, inputs: Mapping[str, Any]) -> Path | None:
        key = hash_json({"version": __version__, **inputs})[:KEY_DIGITS]
        return None if self.folder is None else self.folder / f"{name}-{key}.json"


def _call(function: Callable[[], Any], _: object = None) -> Any:
    return function()


def _read(path: Path | None) -> Mapping[str, Any]:
    """Return what a file contains; nothing if it does not exist or cannot be read."""
    if path is None or not path.exists():
        return {}
    try:
        content = read_json(path, "result")
    except InputError:
        return {}
    return content if isinstance(content, dict) else {}


def _store(path: Path | None, value: Any) -> Any:
    """Store a value, and return it as JSON gives it back; raises OutputError, and ValueError if it is no plain data."""
    plain = json.loads(json.dumps(value, allow_nan=False))
    if path is not None:
        make_writable_folder(path.parent)
        write_json(path, {"result": plain})
    return plain
