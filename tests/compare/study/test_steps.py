"""Steps of a reproduction that are kept and used again."""

from __future__ import annotations

import json
import math
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from typing import Any

import pytest

import nlp_gait
from compare.study import steps as module
from compare.study.steps import Step, Steps, as_json
from nlp_gait.backends.identity import fingerprint


def test_a_step_runs_once_for_equal_inputs(tmp_path: Path) -> None:
    calls: list[int] = []

    def compute() -> dict[str, float]:
        calls.append(1)
        return {"f": 0.1}

    messages: list[str] = []
    for _ in range(2):
        assert Steps(tmp_path, messages.append)("one", {"seed": 1}, compute) == {"f": 0.1}
    assert len(calls) == 1
    assert messages == ["one", "one: kept from an earlier run"]
    Steps(tmp_path, messages.append)("one", {"seed": 2}, compute)
    assert len(calls) == 2


def test_a_step_runs_again_when_its_code_has_changed(tmp_path: Path) -> None:
    Steps(tmp_path, print)("one", {}, lambda: 1)
    assert Steps(tmp_path, print, code=[nlp_gait])("one", {}, lambda: 2) == 2


@pytest.mark.parametrize("text", ["", "{", "[]", '{"sha256": "0"}'])
def test_a_damaged_step_runs_again(tmp_path: Path, text: str) -> None:
    steps = Steps(tmp_path, print)
    steps("one", {}, lambda: 1)
    file = tmp_path / "steps" / "one.json"
    file.write_text(text)
    assert steps("one", {}, lambda: 2) == 2
    assert json.loads(file.read_text())["result"] == 2


def test_an_interrupted_step_leaves_no_file(tmp_path: Path) -> None:
    def interrupted() -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        Steps(tmp_path, print)("one", {}, interrupted)
    assert not list((tmp_path / "steps").iterdir())


def test_fingerprint_tells_values_and_mathematics_apart() -> None:
    one = fingerprint(nlp_gait.load("walk12"))
    assert one == fingerprint(nlp_gait.load("walk12"))
    assert one != fingerprint(nlp_gait.load("walk12").with_values(step_time_s=2.0))
    other = fingerprint(nlp_gait.load("walk12", zmp="appendix"))
    assert one["mathematics_sha256"] != other["mathematics_sha256"]


@pytest.mark.slow
def test_steps_side_by_side_are_kept_one_by_one(tmp_path: Path) -> None:
    """In two processes; what is there already is not computed again."""
    todo = [Step(name=f"root-{k}", inputs={"k": k}, compute=partial(math.sqrt, k)) for k in range(4)]
    told: list[str] = []
    Steps(tmp_path, print)("root-1", {"k": 1}, lambda: 7.0)
    assert Steps(tmp_path, told.append).side_by_side(todo, jobs=2) == [0.0, 7.0, math.sqrt(2), math.sqrt(3)]
    assert sorted(told) == ["root-0", "root-1: kept from an earlier run", "root-2", "root-3"]
    assert Steps(tmp_path, told.append).side_by_side(todo, jobs=2)[3] == math.sqrt(3)
    assert all("kept" in note for note in told[4:])


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
def test_workers_are_as_many_as_asked_for_and_no_more_than_steps(
    jobs: int | None, processors: int, count: int, workers: list[int], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Without workers all in this process."""
    asked: list[int] = []

    def side_by_side(work: dict[int, Any], workers: int) -> Iterator[tuple[int, Any]]:
        asked.append(workers)
        yield from ((number, compute()) for number, compute in work.items())

    monkeypatch.setattr(module, "available_cores", lambda: processors)
    monkeypatch.setattr(module, "side_by_side", side_by_side)
    todo = [Step(name=f"root-{k}", inputs={"k": k}, compute=partial(math.sqrt, k)) for k in range(count)]
    assert Steps(tmp_path, print).side_by_side(todo, jobs) == [math.sqrt(k) for k in range(count)]
    assert asked == workers


@pytest.mark.parametrize("number", [math.nan, math.inf])
def test_what_json_cannot_say_is_not_kept(number: float, tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="not JSON compliant"):
        Steps(tmp_path, print)("one", {}, lambda: [number])
    assert not list((tmp_path / "steps").iterdir())
    with pytest.raises(ValueError, match="not JSON compliant"):
        as_json([number])


def test_why_a_step_is_made_again_is_told(tmp_path: Path) -> None:
    told: list[str] = []
    Steps(tmp_path, print)("one", {"starts": 5}, lambda: 1)
    Steps(tmp_path, print, anew=told.append)("one", {"starts": 10}, lambda: 1)
    Steps(tmp_path, print, code=[nlp_gait], anew=told.append)("one", {"starts": 10}, lambda: 1)
    assert told == ["one: made again: starts 5 -> 10", "one: made again: the program has changed"]
    file = tmp_path / "steps" / "one.json"
    content = json.loads(file.read_text())
    file.write_text(json.dumps({**content, "result": 2}))
    assert Steps(tmp_path, print, code=[nlp_gait], anew=told.append)("one", {"starts": 10}, lambda: 3) == 3
    assert len(told) == 2  # damaged


def test_progress_counts_a_step_that_is_made_again_once(tmp_path: Path) -> None:
    told: list[str] = []
    for starts in (5, 10):
        Steps(tmp_path, told.append)("one", {"starts": starts}, lambda: 1)
    assert told == ["one", "one: made again: starts 5 -> 10"]
