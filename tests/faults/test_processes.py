"""Processes that are killed, work at the same time or cannot begin: files are whole, no run is lost, and nothing runs on."""

import itertools
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest

import nlp_gait
from compare.study.run import ProblemSpec, Run
from compare.study.study import Study, read_records, run_study
from nlp_gait.backends.kernel.compiler import FOLDER_VARIABLE
from tests.compare.cli import calls
from tests.faults.processes import ROOT, fake_compiler, is_alive, start, wait_for

SECONDS = 10.0  # within which all must have ended; on an idle machine it takes one
WALK = ProblemSpec(name="walk12")


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="reads /proc")
def test_a_compiler_ends_with_what_started_it(tmp_path: Path) -> None:
    """And so does what it has started itself."""
    number = tmp_path / "number"
    compiler = {"CXX": fake_compiler(tmp_path, f"sleep 600 & echo $! > {number}; wait")}
    cache = {FOLDER_VARIABLE: str(tmp_path / "cache")}
    program = "import nlp_gait; nlp_gait.compile_objective(nlp_gait.load('walk12'))"
    process = subprocess.Popen([sys.executable, "-c", program], cwd=ROOT, env={**os.environ, **compiler, **cache})
    wait_for(lambda: number.exists() and number.read_text().endswith("\n"))
    process.send_signal(signal.SIGINT)
    process.communicate(timeout=30)
    wait_for(lambda: not is_alive(int(number.read_text())), SECONDS)


def test_four_processes_of_one_study_that_are_killed_lose_nothing_and_the_same_command_continues(
    tmp_path: Path,
) -> None:
    line = f"compare walk12 --algorithms random,pso --starts 0 --evaluations 2000 --runs 20 --jobs 1 --out {tmp_path}"
    studies = [start(*line.split()) for _ in range(4)]
    wait_for(lambda: len(list(tmp_path.glob("records/*/*.json"))) > 4)
    for study in studies:
        os.killpg(study.pid, signal.SIGKILL)
        time.sleep(0.03)
    for study in studies:
        study.communicate(timeout=30)
    kept, damaged = read_records(tmp_path)
    times = {path: path.stat().st_mtime_ns for path in tmp_path.glob("records/*/*.json")}
    assert not damaged and 4 < len(kept) == len(times) < 40
    calls.nlp_gait(*line.split())
    records, damaged = read_records(tmp_path)
    assert len(records) == 40 and not damaged and {path: path.stat().st_mtime_ns for path in times} == times
    runs = tuple(Run(problem=WALK, solver=record.solver, number=record.run, evaluations=2000) for record in records)
    assert [record.x for record in run_study(Study(runs=runs, jobs=2))] == [record.x for record in records]


def test_durations_do_not_follow_the_clock_on_the_wall(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    backwards = itertools.count(2e9, -3600.0)
    monkeypatch.setattr(time, "time", lambda: next(backwards))
    runs = tuple(Run(problem=WALK, solver=name, evaluations=300) for name in ("pso", "slsqp", "ipopt"))
    for record in run_study(Study(runs=runs, folder=tmp_path)):
        times = record.time_s
        assert min(times.build, times.compile, times.solve, *times.history) >= 0.0
        assert list(times.history) == sorted(times.history)
    solution = nlp_gait.solve(nlp_gait.load("walk12"))
    assert min(solution.time_s.build, solution.time_s.compile, solution.starts[0].time_s) >= 0.0


def test_a_limit_of_open_files_is_one_sentence_and_keeps_runs(tmp_path: Path, coarse_pictures: None) -> None:
    line = f"compare walk12 --algorithms random --starts 0 --evaluations 60 --out {tmp_path} --jobs"
    calls.nlp_gait(*line.split(), "1", "--runs", "2")
    command = f'ulimit -n 24; exec "{sys.executable}" -m nlp_gait {line} 20 --runs 22'
    done = subprocess.run(["sh", "-c", command], cwd=ROOT, capture_output=True, text=True, timeout=120)
    assert done.returncode == 1 and done.stdout == "" and done.stderr.count("\n") == 1
    assert "too many files are open" in done.stderr
    assert len(list(tmp_path.glob("records/*/*.json"))) == 2
