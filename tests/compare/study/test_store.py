"""Results that are stored and loaded again."""

import json
import math
from functools import partial
from pathlib import Path

import pytest

import nlp_gait
from compare.study.store import MISSING, Computation, Store, pass_through_json
from nlp_gait.backends.identity import fingerprint
from nlp_gait.errors import OutputError


def list_files(folder: Path) -> list[Path]:
    return sorted(path for path in (folder / "store").rglob("*") if path.is_file())


def test_a_result_is_computed_once_for_equal_inputs_and_code(tmp_path: Path) -> None:
    calls: list[object] = []
    messages: list[str] = []

    def compute(folder: Path, seed: int, **options: object) -> int:
        function = partial(lambda: calls.append(seed) or seed)
        return Store(folder).compute("solves/one", {"seed": seed}, function, progress=messages.append, **options)  # type: ignore[arg-type]

    assert [compute(tmp_path, seed) for seed in (1, 2, 1)] == [1, 2, 1]
    assert calls == [1, 2] and len(list_files(tmp_path)) == 2
    assert messages == ["solves/one", "solves/one", "solves/one: stored by an earlier run"]
    assert compute(tmp_path, 1, code=[nlp_gait]) == 1
    assert calls == [1, 2, 1]


@pytest.mark.parametrize("text", ["", "{", "[]", '{"sha256": "0"}', "edited"])
def test_a_damaged_or_edited_result_is_recomputed(tmp_path: Path, text: str) -> None:
    store = Store(tmp_path)
    store.compute("one", {}, lambda: 1)
    (file,) = list_files(tmp_path)
    file.write_text(text if text != "edited" else json.dumps({**json.loads(file.read_text()), "result": 5}))
    assert store.compute("one", {}, lambda: 2) == 2
    assert json.loads(file.read_text())["result"] == 2


def test_a_result_of_a_problem_that_evaluates_to_other_values_is_recomputed(tmp_path: Path) -> None:
    walk = fingerprint(nlp_gait.load("walk12"))
    assert walk == fingerprint(nlp_gait.load("walk12"))
    for other in (nlp_gait.load("walk12").with_values(step_time_s=2.0), nlp_gait.load("walk12", zmp="appendix")):
        assert fingerprint(other) != walk
    store = Store(tmp_path)
    store.compute("one", walk, lambda: 1)
    probes = json.loads(json.dumps(walk["probes"]))
    probes[1]["objective"] *= 1 + 1e-12
    assert store.load("one", {**walk, "probes": probes}) == 1
    probes[1]["objective"] *= 1 + 1e-7
    assert store.load("one", {**walk, "probes": probes}) is MISSING


@pytest.mark.slow
@pytest.mark.parametrize("jobs", [1, 2, None])
def test_several_results_are_stored_one_by_one_by_any_number_of_workers(jobs: int | None, tmp_path: Path) -> None:
    computations = [Computation(name=f"root-{k}", inputs={"k": k}, function=partial(math.sqrt, k)) for k in range(4)]
    messages: list[str] = []
    Store(tmp_path).compute("root-1", {"k": 1}, lambda: 7.0)
    values = Store(tmp_path).compute_all(computations, jobs=jobs, progress=messages.append)
    assert list(values.items()) == [(f"root-{k}", 7.0 if k == 1 else math.sqrt(k)) for k in range(4)]
    assert sorted(messages) == ["root-0", "root-1: stored by an earlier run", "root-2", "root-3"]
    assert Store(tmp_path).compute_all(computations, jobs=jobs, progress=messages.append) == values
    assert all("stored" in message for message in messages[4:])


@pytest.mark.parametrize("number", [math.nan, math.inf])
def test_what_json_cannot_represent_is_not_stored(number: float, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="not JSON compliant"):
        Store(tmp_path).compute("one", {}, lambda: [number])
    assert not list_files(tmp_path)
    with pytest.raises(ValueError, match="not JSON compliant"):
        pass_through_json([number])


def test_a_folder_that_cannot_be_written_is_reported_once(tmp_path: Path) -> None:
    messages: list[str] = []
    for folder, report in ((tmp_path / "a", None), (tmp_path / "b", messages.append)):
        store = Store(folder, report)
        store.compute("one", {}, lambda: 1)
        (file,) = list_files(folder)
        file.unlink()
        file.mkdir()
        if report is None:
            with pytest.raises(OutputError, match="it is a folder"):
                store.compute("one", {}, lambda: 1)
        else:
            assert [store.compute("one", {}, lambda: 1) for _ in range(2)] == [1, 1]
    (message,) = messages
    assert message.endswith("it is a folder; continuing without storing results")
