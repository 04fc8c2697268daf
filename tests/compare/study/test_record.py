"""Whatever is written of a run can be read: anything that a run may return becomes a record, if need be that of a failed run."""

import json
import math
import os
import random
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest
from casadi import MX

from compare.judge import evaluate
from compare.study.perform import catch_errors
from compare.study.record import History, RunRecord, Times, read_record
from compare.study.run import ProblemSpec, Run, make_inputs
from compare.study.study import Study, read_records, run_study, write_record
from nlp_gait.errors import GaitError, InputError
from nlp_gait.formulation.registry import check_mathematics
from tests.backends.toys import row, toy
from tests.compare.records import judged, run_once

RUN = Run(problem=ProblemSpec(name="walk12"), solver="random", evaluations=50)
TEXTS = ("caf\udce9.csv", "\x00\x1b[31m", "a\nb\u2028c", "$x$", "x" * 10**4, "=HYPERLINK(1)", "\ud83d", "", "\u202e")
NUMBERS = (math.nan, math.inf, -1.0, 2**63, 10**400, True, None)


def deep(levels: int) -> Any:
    return [] if levels == 0 else [deep(levels - 1)]


def hostile_results(record: RunRecord, seed: int) -> Iterator[Callable[[], RunRecord]]:
    """Runs that return a record with a hostile part, or raise an error with one."""
    draw = random.Random(seed)
    values = (*TEXTS[:2], *TEXTS[4:7], *NUMBERS, deep(60), object(), b"x", {1: 2}, {"a": math.nan}, {"\udce9": 1.0})

    def change(**parts: Any) -> Callable[[], RunRecord]:
        return lambda: replace(record, **parts)

    for value in values:
        yield change(settings={"kind": value})
        yield change(x={**record.x, "lambda": value})
        for name in ("status", "reported_objective", "failed_evaluations", "iterations", "reported_feasible"):
            yield change(**{name: value})
        for name in ("objective", "violation", "feasible", "metrics", "violated"):
            yield change(**{name: value})
        yield change(counts={"f": value})
        yield change(history=History(evaluations=(1,) * 2, objective=(1.0, value)), time_s=times(2))
        yield change(history=History(evaluations=(1, draw.choice(values)), objective=(1.0, 1.0)), time_s=times(2))
        yield change(time_s=Times(solve=draw.choice(values), history=record.time_s.history))
        yield lambda value=value: fail(RuntimeError(value))
        yield lambda value=value: fail(type("Stop", (BaseException,), {"__str__": lambda self: value})())
    yield lambda: fail(type("Mute", (Exception,), {"__str__": lambda self: 1 / 0})())
    yield change(history=History(evaluations=(1,) * 20_000, objective=(1.0,) * 20_000), time_s=times(20_000))


def times(entries: int) -> Times:
    return Times(solve=1.0, history=(0.5,) * entries)


def fail(error: BaseException) -> RunRecord:
    raise error


def test_no_result_of_a_run_makes_a_record_that_cannot_be_read(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("compare.study.record.LARGEST_FILE", 2**20)
    sound = judged("random", dict.fromkeys(RUN.problem.load().names, 0.1), problem="walk12")
    attacks, (inputs,) = list(hostile_results(sound, 1)), make_inputs([RUN])
    failed = 0
    for make in attacks:
        record = catch_errors(RUN, inputs, make)
        path = write_record(record, tmp_path)
        read = read_record(path)
        assert read.to_json() == json.loads(path.read_text(encoding="utf-8"))
        failed += read.status.startswith("failed: ")
    assert len(attacks) > 250 and 0.3 * len(attacks) < failed < len(attacks)


def test_a_value_that_is_not_finite_at_a_feasible_point_is_a_failure(tmp_path: Path) -> None:
    def make(x: MX, y: MX, limit: MX, ops: object) -> tuple[MX, tuple[Any, ...]]:
        return (x - 9).log(), (row(x, upper=limit + 9),)

    problem = ProblemSpec(name=toy(make))
    runs = [Run(problem=problem, solver=name, number=k, evaluations=60) for name in ("random", "slsqp") for k in (0, 1)]
    records = run_study(Study(runs=tuple(runs), folder=tmp_path))
    assert ["without an objective" in record.status for record in records] == [True] * 4
    assert not any(record.x for record in records)
    assert len(read_records(tmp_path)[0]) == 4


@pytest.mark.parametrize("value", [2**70, deep(60), "\udce9", {"a": "\ud83d"}])
def test_settings_that_no_record_can_contain_are_rejected_before_the_work(tmp_path: Path, value: Any) -> None:
    (tmp_path / "own.py").write_text("def search(f, lower, upper, evaluations, seed, setting): raise RuntimeError\n")
    with pytest.raises(InputError):
        run_once(replace(RUN, solver=f"{tmp_path}/own.py:search", settings={"setting": value}))


@pytest.mark.parametrize("end", ["lower", "upper"])
@pytest.mark.parametrize("bound", [lambda p: MX(math.nan), lambda p: MX(math.inf) - math.inf, lambda p: (p - 1).log()])
def test_bounds_that_are_nan_are_rejected_or_never_satisfied(end: str, bound: Callable[[MX], MX]) -> None:
    problem = toy(lambda x, y, limit, ops: (x * y, (row(x, **{end: bound(limit)}),)))
    with pytest.raises(InputError, match=f"{end} is NaN"):
        check_mathematics(problem)
    assert not evaluate(problem, [0.1, 0.2]).feasible
    later = toy(lambda x, y, limit, ops: (x * y, (row(x, **{end: limit.sqrt()}),))).with_values(limit=-1.0)
    found = evaluate(later, [0.1, 0.2])
    assert not found.feasible and math.isnan(found.violation)


def test_an_algorithm_that_changes_the_working_folder_keeps_its_run(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "own.py").write_text(
        "import os, tempfile\ndef search(f, lower, upper, evaluations, seed):\n"
        " with tempfile.TemporaryDirectory() as folder:\n  os.chdir(folder)\n  f(lower[None])\n"
    )
    monkeypatch.chdir(tmp_path)
    record = run_once(replace(RUN, solver="own.py:search"))
    assert record.x and not record.status.startswith("failed"), record.status
    with pytest.raises(GaitError):
        run_once(replace(RUN, solver="gone.py:search"))
    assert Path(os.getcwd()) == tmp_path
