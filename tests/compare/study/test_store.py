"""Results that are stored and loaded again."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import nlp_gait
from compare.study import store as module
from compare.study.store import Computation, Store, pass_through_json
from nlp_gait.backends.identity import fingerprint
from nlp_gait.errors import OutputError


def test_a_result_is_computed_once_for_equal_inputs(tmp_path: Path) -> None:
    calls: list[int] = []

    def compute() -> dict[str, float]:
        calls.append(1)
        return {"f": 0.1}

    messages: list[str] = []
    for _ in range(2):
        assert Store(tmp_path).compute("one", {"seed": 1}, compute, progress=messages.append) == {"f": 0.1}
    assert len(calls) == 1
    assert messages == ["one", "one: stored by an earlier run"]
    Store(tmp_path).compute("one", {"seed": 2}, compute)
    assert len(calls) == 2


def test_a_result_is_recomputed_when_its_code_has_changed(tmp_path: Path) -> None:
    Store(tmp_path).compute("one", {}, lambda: 1)
    assert Store(tmp_path).compute("one", {}, lambda: 2, code=[nlp_gait]) == 2


@pytest.mark.parametrize("text", ["", "{", "[]", '{"sha256": "0"}'])
def test_a_damaged_result_is_recomputed(tmp_path: Path, text: str) -> None:
    store = Store(tmp_path)
    store.compute("one", {}, lambda: 1)
    file = tmp_path / "store" / "one.json"
    file.write_text(text)
    assert store.compute("one", {}, lambda: 2) == 2
    assert json.loads(file.read_text())["result"] == 2


def test_an_interrupted_computation_leaves_no_file(tmp_path: Path) -> None:
    def interrupted() -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        Store(tmp_path).compute("one", {}, interrupted)
    assert not list((tmp_path / "store").iterdir())


def test_fingerprint_distinguishes_values_and_mathematics() -> None:
    one = fingerprint(nlp_gait.load("walk12"))
    assert one == fingerprint(nlp_gait.load("walk12"))
    assert one != fingerprint(nlp_gait.load("walk12").with_values(step_time_s=2.0))
    other = fingerprint(nlp_gait.load("walk12", zmp="appendix"))
    assert one["values"] != other["values"]


@pytest.mark.slow
def test_results_of_worker_processes_are_stored_one_by_one(tmp_path: Path) -> None:
    """In two processes; what is stored is not computed again."""
    todo = [Computation(name=f"root-{k}", inputs={"k": k}, function=partial(math.sqrt, k)) for k in range(4)]
    told: list[str] = []
    Store(tmp_path).compute("root-1", {"k": 1}, lambda: 7.0)
    values = Store(tmp_path).compute_all(todo, jobs=2, progress=told.append)
    assert list(values.items()) == [(f"root-{k}", 7.0 if k == 1 else math.sqrt(k)) for k in range(4)]
    assert sorted(told) == ["root-0", "root-1: stored by an earlier run", "root-2", "root-3"]
    assert Store(tmp_path).compute_all(todo, jobs=2, progress=told.append) == values
    assert all("stored" in note for note in told[4:])


@pytest.mark.parametrize(
    ("jobs", "processors", "count", "workers"),
    [
        (None, 4, 3, [3]),
        (None, 2, 3, [2]),
        (2, 8, 3, [2]),
        (8, 1, 3, [3]),
        (1, 8, 3, []),
        (None, 1, 3, []),
        (4, 8, 1, []),
    ],
)
def test_there_are_as_many_workers_as_required_and_no_more_than_computations(
    jobs: int | None, processors: int, count: int, workers: list[int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without workers all in this process."""
    asked: list[int] = []

    def run_in_processes(work: dict[str, Any], workers: int) -> Iterator[tuple[str, Any]]:
        asked.append(workers)
        yield from ((name, function()) for name, function in work.items())

    monkeypatch.setattr(module, "available_cores", lambda: processors)
    monkeypatch.setattr(module, "run_in_processes", run_in_processes)
    todo = [Computation(name=f"root-{k}", inputs={"k": k}, function=partial(math.sqrt, k)) for k in range(count)]
    assert list(Store(tmp_path).compute_all(todo, jobs=jobs).values()) == [math.sqrt(k) for k in range(count)]
    assert asked == workers


@pytest.mark.parametrize("number", [math.nan, math.inf])
def test_what_json_cannot_represent_is_not_stored(number: float, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="not JSON compliant"):
        Store(tmp_path).compute("one", {}, lambda: [number])
    assert not list((tmp_path / "store").iterdir())
    with pytest.raises(ValueError, match="not JSON compliant"):
        pass_through_json([number])


def test_the_reason_of_a_recomputation_is_reported(tmp_path: Path) -> None:
    told: list[str] = []
    Store(tmp_path).compute("one", {"starts": 5}, lambda: 1, code=[nlp_gait])
    store = Store(tmp_path, told.append)
    store.compute("one", {"starts": 10}, lambda: 1, code=[nlp_gait])
    store.compute("one", {"starts": 10}, lambda: 1, code=[nlp_gait, module])
    assert told == ["one: recomputed: starts 5 -> 10", "one: recomputed: the program has changed"]
    file = tmp_path / "store" / "one.json"
    content = json.loads(file.read_text())
    file.write_text(json.dumps({**content, "result": 2}))
    assert store.compute("one", {"starts": 10}, lambda: 3, code=[nlp_gait, module]) == 3
    assert len(told) == 2  # damaged


def test_progress_counts_a_recomputed_result_once(tmp_path: Path) -> None:
    told: list[str] = []
    for starts in (5, 10):
        Store(tmp_path).compute("one", {"starts": starts}, lambda: 1, progress=told.append)
    assert told == ["one", "one: recomputed: starts 5 -> 10"]


def test_a_result_that_a_run_needs_twice_is_not_of_an_earlier_run(tmp_path: Path) -> None:
    store = Store(tmp_path)
    for _ in range(3):
        store.compute("one", {}, lambda: 1)
    assert store.summary == ""
    later = Store(tmp_path)
    for name in ("one", "two", "one", "two"):
        later.compute(name, {}, lambda: 1)
    assert later.summary == "1 of 2 results were stored by an earlier run"


def test_results_of_different_inputs_lie_next_to_each_other(tmp_path: Path) -> None:
    calls: list[int] = []
    for seed in (1, 2, 1):
        store = Store(tmp_path)
        value = store.compute("solves/one-{key}", {"seed": seed}, lambda seed=seed: calls.append(seed) or seed)
        assert value == seed
    assert calls == [1, 2] and len(list((tmp_path / "store" / "solves").glob("one-*.json"))) == 2
    assert store.summary == "1 of 1 results were stored by an earlier run"


def test_arrays_are_stored_with_their_inputs(tmp_path: Path) -> None:
    store, arrays = Store(tmp_path), {"x": np.array([[0.1, np.nan]]), "f": np.zeros(0)}
    assert store.load_arrays("points/a", {"run": 1}) is None
    store.save_arrays("points/a", {"run": 1}, arrays)
    found = Store(tmp_path).load_arrays("points/a", {"run": 1})
    assert found is not None and found.keys() == arrays.keys()
    assert all(found[name].tobytes() == arrays[name].tobytes() for name in arrays)
    assert store.load_arrays("points/a", {"run": 2}) is None
    file = tmp_path / "store" / "points" / "a.npz"
    file.write_bytes(file.read_bytes()[:-9])
    assert store.load_arrays("points/a", {"run": 1}) is None


def test_a_store_without_a_folder_stores_nothing() -> None:
    store = Store()
    assert [store.compute("one", {}, lambda: (1, 2)) for _ in range(2)] == [[1, 2], [1, 2]]
    store.save_arrays("two", {}, {"x": np.zeros(2)})
    assert store.load("one") is None and store.load_arrays("two", {}) is None and store.summary == ""


def test_a_folder_that_cannot_be_written_is_reported_once(tmp_path: Path) -> None:
    told: list[str] = []
    stores = Store(tmp_path / "a"), Store(tmp_path / "b", told.append)
    for name in ("a", "b"):
        (tmp_path / name / "store" / "one.json").mkdir()
    with pytest.raises(OutputError, match="it is a folder"):
        stores[0].compute("one", {}, lambda: 1)
    assert [stores[1].compute("one", {}, lambda: 1) for _ in range(2)] == [1, 1]
    (message,) = told
    assert message.endswith("it is a folder; continuing without storing results")
