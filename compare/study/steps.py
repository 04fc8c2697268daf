"""Steps of long work, each kept as a file, so that what was interrupted continues where it stopped."""

from __future__ import annotations

import inspect
import json
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any, NamedTuple

from compare.study.definition import input_differences
from compare.study.workers import side_by_side
from nlp_gait.backends.identity import sha256_of
from nlp_gait.backends.kernel.compiled import available_cores
from nlp_gait.errors import InputError
from nlp_gait.files import read_json, remove_leftovers, writable_folder, write_json
from nlp_gait.progress import Progress


@dataclass(frozen=True, kw_only=True)
class Step:
    """One of several steps that may run side by side: what ``Steps`` takes; ``compute`` must be picklable."""

    name: str
    inputs: Mapping[str, Any]
    compute: Callable[[], Any]


class Kept(NamedTuple):
    """Result that was kept, which may be None itself."""

    result: Any


class Steps:
    """Runs steps, or takes their results from ``<out>/steps/<name>.json`` if they were made from equal inputs.

    Args:
        out: folder of the work.
        progress: told the name of each step before it runs, and of each that need not run again.
        code: modules that compute the results; steps run again when their text has changed.
        anew: told of each step that was made from other inputs, and of what has changed; None to tell ``progress`` so in
            place of the step's name.
    """

    def __init__(
        self, out: Path, progress: Progress, code: Sequence[ModuleType] = (), anew: Progress | None = None
    ) -> None:
        self._folder = writable_folder(out / "steps")
        remove_leftovers(self._folder)
        self._progress, self._anew = progress, anew
        self._changed: dict[str, str] = {}  # what to say of steps that are made again
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
            if (kept := self.kept(step.name, step.inputs)) is not None:
                self._progress(f"{step.name}: kept from an earlier run")
                results[k] = kept.result
        waiting = {k: step for k, step in enumerate(steps) if k not in results}
        for k, computed in self._computed(waiting, min(jobs or available_cores(), len(waiting))):
            results[k] = self.keep(steps[k].name, steps[k].inputs, computed)
        return [results[k] for k in range(len(steps))]

    def kept(self, name: str, inputs: Mapping[str, Any]) -> Kept | None:
        """Result of a step that was made from equal inputs; None if there is none, and ``anew`` is told why."""
        path = self._folder / f"{name}.json"
        if not path.exists():
            return None
        try:
            content = read_json(path, "step")
        except InputError:
            return None  # damaged: made again
        if not isinstance(content, dict) or not content.keys() >= {"inputs", "result"}:
            return None
        if content.get("sha256") != sha256_of(inputs, self._code):
            why = input_differences(content["inputs"], inputs) or "the program has changed"
            self._changed[name] = f"{name}: made again: {why}"
            if self._anew is not None:
                self._anew(self._changed.pop(name))
            return None
        return Kept(content["result"]) if content.get("result_sha256") == sha256_of(content["result"]) else None

    def keep(self, name: str, inputs: Mapping[str, Any], computed: Any) -> Any:
        """Keep the result of a step; returns it as JSON gives it back, now and whenever it is read again.

        Raises:
            OutputError: it cannot be kept.
        """
        result = as_json(computed)
        digests = {"sha256": sha256_of(inputs, self._code), "result_sha256": sha256_of(result)}
        write_json(self._folder / f"{name}.json", {"inputs": inputs, "result": result, **digests})
        return result

    def _computed(self, steps: Mapping[int, Step], workers: int) -> Iterator[tuple[int, Any]]:
        """Number and result of each step, as it finishes."""
        if workers <= 1:
            for number, step in steps.items():
                self._tell(step)
                yield number, step.compute()
            return
        for number, result in side_by_side({number: step.compute for number, step in steps.items()}, workers):
            self._tell(steps[number])
            yield number, result

    def _tell(self, step: Step) -> None:
        self._progress(self._changed.pop(step.name, step.name))


def as_json(data: Any) -> Any:
    """Plain data as JSON gives it back."""
    return json.loads(json.dumps(data, allow_nan=False))
