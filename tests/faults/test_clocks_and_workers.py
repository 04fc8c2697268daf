"""A clock that is put back, and a worker process that dies: no run is lost, and no time is negative."""

from __future__ import annotations

import itertools
import os
import signal
import time
import warnings
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import ClassVar

import pytest

import nlp_gait
from compare.study.record import read_record
from compare.study.run_study import Study, run_study
from compare.study.task import ProblemSpec, Stop, Task
from metaheuristics import ParticleSwarm
from metaheuristics.interface import Search, Start
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


@dataclass(frozen=True, kw_only=True)
class DiesOnce:
    """Particle swarm, but the first process that begins it is killed."""

    marker: str
    population: int = 20
    name: ClassVar[str] = "dies-once"

    def start(self, start: Start) -> Search:
        try:
            Path(self.marker).touch(exist_ok=False)
        except FileExistsError:
            return ParticleSwarm(population=self.population).start(start)
        os.kill(os.getpid(), signal.SIGKILL)
        raise AssertionError("still alive")


@pytest.mark.slow
def test_a_worker_that_dies_in_the_middle_costs_no_run(tmp_path: Path) -> None:
    dying = tuple(
        Task(problem=WALK, solver=DiesOnce(marker=str(tmp_path / "dead")), run=run, stop=STOP) for run in range(6)
    )
    records = run_study(Study(tasks=dying, folder=tmp_path / "study", jobs=2))
    assert (tmp_path / "dead").exists()
    healthy = tuple(
        Task(problem=WALK, solver="pso", settings={"population": 20}, run=run, stop=STOP) for run in range(6)
    )
    assert [record.x for record in records] == [record.x for record in run_study(Study(tasks=healthy))]
    assert len([read_record(path) for path in (tmp_path / "study").rglob("*.json")]) == 6


@pytest.mark.slow
def test_cancelled_runs_are_not_reported_after_an_early_stop() -> None:
    """Ctrl-C in a study is one sentence: joblib's warning of cancelled calls is not a second one."""
    results = run_in_processes({number: partial(time.sleep, 0.05 * number) for number in range(12)}, workers=2)
    assert next(results) == (0, None)
    with warnings.catch_warnings(record=True) as heard:
        warnings.simplefilter("always")
        results.close()  # type: ignore[attr-defined]
    assert not heard
