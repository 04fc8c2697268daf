"""A clock that is put back, and a worker process that dies: no run is lost, and no time is negative."""

from __future__ import annotations

import itertools
import os
import time
import warnings
from functools import partial
from pathlib import Path

import pytest

import nlp_gait
from compare.study.run_study import Study, run_study
from compare.study.task import ProblemSpec, Stop, Task
from nlp_gait.files import remove_leftovers
from nlp_gait.processes import run_in_processes

WALK = ProblemSpec(name="walk12")
STOP = Stop(evaluations=300)


def test_durations_do_not_follow_the_clock_on_the_wall(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    backwards = itertools.count(2e9, -3600.0)
    monkeypatch.setattr(time, "time", lambda: next(backwards))
    tasks = tuple(Task(problem=WALK, solver=name, stop=STOP) for name in ("pso", "slsqp", "ipopt"))
    for record in run_study(Study(tasks=tasks, folder=tmp_path)):
        times = record.time_s
        assert min(times.build, times.compile, times.solve, *times.history) >= 0.0
        assert list(times.history) == sorted(times.history)
    solution = nlp_gait.solve(nlp_gait.load("walk12"))
    assert min(solution.time_s.build, solution.time_s.compile, solution.starts[0].time_s) >= 0.0


def test_records_from_the_future_are_kept_and_their_leftovers_go(tmp_path: Path) -> None:
    task = Task(problem=WALK, solver="pso", stop=STOP)
    run_study(Study(tasks=(task,), folder=tmp_path))
    (record,) = tmp_path.glob("records/*/*.json")
    leftover = record.with_name(".0123456789abcdef.tmp")
    leftover.write_text("{")
    ahead = time.time() + 86_400.0
    for path in (record, leftover):
        os.utime(path, (ahead, ahead))
    kept: list[int] = []
    run_study(Study(tasks=(task,), folder=tmp_path), on_stored=kept.append)
    assert kept == [1] and record.stat().st_mtime == pytest.approx(ahead) and not leftover.exists()
    fresh = tmp_path / ".fedcba9876543210.tmp"
    fresh.write_text("{")
    remove_leftovers(tmp_path)
    assert fresh.exists()  # another process may be writing it


@pytest.mark.slow
def test_cancelled_runs_are_not_reported_after_an_early_stop() -> None:
    """Ctrl-C in a study is one sentence: joblib's warning of cancelled calls is not a second one."""
    results = run_in_processes({number: partial(time.sleep, 0.05 * number) for number in range(12)}, workers=2)
    assert next(results) == (0, None)
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        results.close()  # type: ignore[attr-defined]
    assert not heard
