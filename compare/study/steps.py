"""Steps of a long reproduction, each kept as a file, so that an interrupted one continues where it stopped."""

from __future__ import annotations

import inspect
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

from compare.study.definition import sha256_of
from compare.study.progress import Progress
from compare.study.workers import default_jobs, side_by_side
from nlp_gait.errors import InputError
from nlp_gait.files import read_json, writable_folder, write_json


@dataclass(frozen=True, kw_only=True)
class Step:
    """One of several steps that may run side by side: what ``Steps`` takes; ``compute`` must be picklable."""

    name: str
    inputs: Mapping[str, Any]
    compute: Callable[[], Any]


class Steps:
    """Runs steps, or takes their results from ``<out>/steps/<name>.json`` if they were made from equal inputs.

    Args:
        out: folder of the reproduction.
        progress: told the name of each step before it runs, and of each that need not run again.
        code: modules that compute the results; steps run again when their text has changed.
    """

    def __init__(self, out: Path, progress: Progress, code: Sequence[ModuleType] = ()) -> None:
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
        (result,) = self.side_by_side([Step(name=name, inputs=inputs, compute=compute)], jobs=1)
        return result

    def side_by_side(self, steps: Sequence[Step], jobs: int | None = None) -> list[Any]:
        """Results of several steps, in their order; each is kept as soon as it is there.

        Args:
            steps: with different names.
            jobs: worker processes; None for one on each processor, 1 for this process.

        Raises:
            OutputError: a result cannot be kept.
        """
        results: dict[int, Any] = {}
        for k, step in enumerate(steps):
            if (kept := _kept(self._path(step), sha256_of(step.inputs, self._code))) is not None:
                self._progress(f"{step.name}: kept from an earlier run")
                results[k] = kept["result"]
        waiting = {k: step for k, step in enumerate(steps) if k not in results}
        for k, computed in _computed(waiting, min(jobs or default_jobs(), len(waiting)), self._progress):
            # As JSON gives it back, now and whenever it is read again.
            step, result = steps[k], json.loads(json.dumps(computed, allow_nan=False))
            digests = {"sha256": sha256_of(step.inputs, self._code), "result_sha256": sha256_of(result)}
            write_json(self._path(step), {"inputs": step.inputs, "result": result, **digests})
            results[k] = result
        return [results[k] for k in range(len(steps))]

    def _path(self, step: Step) -> Path:
        return self._folder / f"{step.name}.json"


def _computed(steps: Mapping[int, Step], workers: int, progress: Progress) -> Iterator[tuple[int, Any]]:
    """Number and result of each step, as it finishes."""
    if workers <= 1:
        for number, step in steps.items():
            progress(step.name)
            yield number, step.compute()
        return
    for number, result in side_by_side({number: step.compute for number, step in steps.items()}, workers):
        progress(steps[number].name)
        yield number, result


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
    return content if content.get("result_sha256") == sha256_of(content["result"]) else None
