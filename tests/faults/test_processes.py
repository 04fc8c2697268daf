"""Processes that are killed, work at the same time or cannot begin: files are whole, no run is lost, and nothing runs on."""

import itertools
import os
import signal
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import pytest

import nlp_gait
from compare.study.run import ProblemSpec, Run
from compare.study.study import Study, read_records, run_study
from nlp_gait.backends.kernel.compiler import FOLDER_VARIABLE
from tests.compare.cli import calls
from tests.faults.processes import ROOT, fake_compiler, start, wait_for

SECONDS = 10.0  # within which all must have ended; on an idle machine it takes one
WALK = ProblemSpec(name="walk12")
STUDIES, RUNS = 3, 6


def make_run(evaluations: int, number: int, label: str = "") -> Run:
    return Run(problem=WALK, solver="random", label=label, evaluations=evaluations, number=number)


def list_offspring(parent: int) -> dict[int, str]:
    """Return the command lines of living processes that a process, or one of those, has started, by number; of all for 0."""
    processes = {}
    for entry in Path("/proc").iterdir():
        try:
            state, above, *_ = (entry / "stat").read_text().rpartition(")")[2].split()
            command = (entry / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
            processes |= {int(entry.name): (int(above), command)} if state != "Z" else {}
        except (OSError, ValueError):  # ended meanwhile, or no process
            continue
    below = {parent}
    while new := {child for child, (above, _) in processes.items() if above in below} - below:
        below |= new
    return {child: processes[child][1] for child in below & processes.keys() - {parent}}


@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="reads /proc")
@pytest.mark.parametrize(("name", "started"), [("SIGKILL", "workers"), ("SIGINT", "sleep 600")])
def test_workers_and_compilers_end_with_what_started_them(name: str, started: str, tmp_path: Path) -> None:
    if started == "workers":
        line = "compare walk12 --algorithms pso --runs 4 --evaluations 90000000 --jobs 2 --out"
        process = start(*line.split(), str(tmp_path / "results"))
    else:
        compiler = {"CXX": fake_compiler(tmp_path, "sleep 600 & wait")}
        cache = {FOLDER_VARIABLE: str(tmp_path / "cache")}
        program = "import nlp_gait; nlp_gait.compile_objective(nlp_gait.load('walk12'))"
        call = [sys.executable, "-c", program]
        process = subprocess.Popen(call, cwd=ROOT, env={**os.environ, **compiler, **cache}, text=True)
    count = 2 if started == "workers" else 1
    try:
        wait_for(lambda: sum(started in text for text in list_offspring(process.pid).values()) >= count)
        time.sleep(1.0 if started == "workers" else 0.0)  # the runs are in progress
        offspring = list_offspring(process.pid)
    finally:
        os.kill(process.pid, getattr(signal, name))
        process.communicate(timeout=30)
    wait_for(lambda: not offspring.keys() & list_offspring(0).keys(), SECONDS)


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
    runs = tuple(replace(make_run(2000, record.run), solver=record.solver) for record in records)
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
