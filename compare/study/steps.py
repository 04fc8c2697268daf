"""Steps of a long reproduction, each kept as a file, so that an interrupted one continues where it stopped."""

from __future__ import annotations

import hashlib
import inspect
import json
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from types import ModuleType
from typing import Any

from nlp_gait.backends.exact import exact_model
from nlp_gait.errors import InputError
from nlp_gait.files import read_json, writable_folder, write_json
from nlp_gait.problem import GaitProblem


class Steps:
    """Runs steps, or takes their results from ``<out>/steps/<name>.json`` if they were made from equal inputs.

    Args:
        out: folder of the reproduction.
        progress: told the name of each step before it runs, and of each that need not run again.
        code: modules that compute the results; steps run again when their text has changed.
    """

    def __init__(self, out: Path, progress: Callable[[str], None], code: Sequence[ModuleType] = ()) -> None:
        self._folder = writable_folder(out / "steps")
        self._progress = progress
        self._code = "".join(inspect.getsource(module) for module in code)

    def __call__(self, name: str, inputs: Mapping[str, Any], compute: Callable[[], Any]) -> Any:
        """Result of a step, as JSON gives it back: numbers, text, lists and objects only.

        Args:
            name: of the step and its file.
            inputs: everything that the result depends on, as plain data; see ``fingerprint`` for a problem.
            compute: does the work.

        Raises:
            OutputError: the result cannot be kept.
        """
        path = self._folder / f"{name}.json"
        digest = hashlib.sha256((json.dumps(inputs, sort_keys=True) + self._code).encode()).hexdigest()
        if (kept := _kept(path, digest)) is not None:
            self._progress(f"{name}: kept from an earlier run")
            return kept["result"]
        self._progress(name)
        # As JSON gives it back, now and whenever it is read again.
        result = json.loads(json.dumps(compute(), allow_nan=False))
        write_json(path, {"inputs": inputs, "sha256": digest, "result": result, "result_sha256": _digest(result)})
        return result


def fingerprint(problem: GaitProblem) -> dict[str, Any]:
    """What identifies a problem's mathematics and its parameter values, for ``inputs``."""
    mathematics = exact_model(problem).function.serialize()
    return {
        "problem": problem.name,
        "options": dict(problem.options),
        "parameters": problem.p.tolist(),
        "mathematics_sha256": hashlib.sha256(mathematics.encode()).hexdigest(),
    }


def _kept(path: Path, digest: str) -> dict[str, Any] | None:
    """Content of a step's file if it is whole and from these inputs."""
    if not path.exists():
        return None
    try:
        content = read_json(path, "step")
    except InputError:
        return None  # damaged: made again
    if not isinstance(content, dict) or content.get("sha256") != digest or "result" not in content:
        return None
    return content if content.get("result_sha256") == _digest(content["result"]) else None


def _digest(result: Any) -> str:
    """Checksum of a result: a file that was changed by hand or by a broken disk is made again."""
    return hashlib.sha256(json.dumps(result, sort_keys=True).encode()).hexdigest()
