"""Processes that are killed, work at the same time or cannot begin: files are whole, no run is lost, and nothing runs on."""

import itertools
import multiprocessing
import os
import signal
import subprocess
import sys
import time
from dataclasses import dataclass, replace
from multiprocessing.synchronize import Barrier
from pathlib import Path

import pytest

import nlp_gait
from compare.study.record import RunRecord
from compare.study.record_files import find_record, read_records, write_records
from compare.study.run_study import Study, run_study
from compare.study.settings import Session, SolverSpec, StudySettings, read_manifest, write_manifest
from compare.study.task import ProblemSpec, Stop, Task
from metaheuristics import ParticleSwarm
from metaheuristics.interface import Search, Start
from nlp_gait.backends.kernel import library_cache
from tests.compare.cli import calls
from tests.faults.processes import ROOT, fake_compiler, start, wait_for

SECONDS = 10.0  # within which all must have ended; on an idle machine it takes one
WALK = ProblemSpec(name="walk12")
STUDIES, RUNS = 3, 6


def make_task(evaluations: int, run: int, label: str = "") -> Task:
    return Task(problem=WALK, solver="random", label=label, stop=Stop(evaluations=evaluations), run=run)


@dataclass(frozen=True, kw_only=True)
class DiesOnce(ParticleSwarm):
    """Particle swarm, but the first process that begins it is killed."""

    marker: str

    def start(self, start: Start) -> Search:
        if not Path(self.marker).exists():
            Path(self.marker).touch()
            os.kill(os.getpid(), signal.SIGKILL)
        return super().start(start)


@pytest.mark.slow
def test_a_worker_that_dies_in_the_middle_costs_no_run(tmp_path: Path) -> None:
    solver = DiesOnce(marker=str(tmp_path / "dead"))
    tasks = tuple(replace(make_task(300, run), solver=solver) for run in range(4))
    dying = run_study(Study(tasks=tasks, folder=tmp_path / "study", jobs=2))
    assert (tmp_path / "dead").exists() and len(read_records(tmp_path / "study")) == 4
    undisturbed = run_study(Study(tasks=tuple(replace(task, solver=ParticleSwarm()) for task in tasks)))
    assert [record.x for record in dying] == [record.x for record in undisturbed]


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


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="reads /proc")
@pytest.mark.parametrize(("name", "started"), [("SIGKILL", "loky"), ("SIGINT", "sleep 600"), ("SIGTERM", "sleep 600")])
def test_workers_and_compilers_end_with_what_started_them(name: str, started: str, tmp_path: Path) -> None:
    if started == "loky":
        line = "compare walk12 --algorithms pso --runs 4 --evaluations 90000000 --jobs 2 --out"
        process = start(*line.split(), str(tmp_path / "results"))
    else:
        compiler = {"CXX": fake_compiler(tmp_path, "sleep 600 & wait")}
        cache = {library_cache.FOLDER_VARIABLE: str(tmp_path / "cache")}
        program = "import nlp_gait; nlp_gait.compile_objective(nlp_gait.load('walk12'))"
        call = [sys.executable, "-c", program]
        process = subprocess.Popen(call, cwd=ROOT, env={**os.environ, **compiler, **cache}, text=True)
    count = 2 if started == "loky" else 1
    try:
        wait_for(lambda: sum(started in text for text in list_offspring(process.pid).values()) >= count)
        time.sleep(1.0 if started == "loky" else 0.0)  # the runs are in progress
        offspring = list_offspring(process.pid)
    finally:
        os.kill(process.pid, getattr(signal, name))
        process.communicate(timeout=30)
    wait_for(lambda: not offspring.keys() & list_offspring(0).keys(), SECONDS)


def write_study(folder: Path, study: int, barrier: Barrier) -> None:
    """Write all records of a study, in step with the others, read those of this study back in between, and add sessions."""
    tasks = [make_task(50 + study, run, f"study {study}") for run in range(RUNS)]
    records = [RunRecord.make_failed(task, "tried") for task in tasks]
    settings = StudySettings(problems=(WALK,), solvers=(SolverSpec(name="random"),))
    for count in range(1, RUNS + 1):
        barrier.wait(60)
        write_records(records[:count], folder)
        write_manifest(folder, settings, Session.begin(f"study {study}", "1"))
        stored = find_record(folder, tasks[count - 1])
        assert stored is not None and stored.inputs.stop["evaluations"] == 50 + study
        assert len(read_records(folder)) >= count  # as for the report, while others write
        barrier.wait(60)
        assert len(read_records(folder)) == STUDIES * count


@pytest.mark.slow
@pytest.mark.skipif("fork" not in multiprocessing.get_all_start_methods(), reason="processes cannot be copied here")
def test_several_studies_in_one_folder_lose_nothing(tmp_path: Path) -> None:
    make_task(50, 0).inputs()  # built before the forks
    context = multiprocessing.get_context("fork")
    studies = [*range(STUDIES), 0]  # one of them twice
    barrier = context.Barrier(len(studies))
    jobs = [context.Process(target=write_study, args=(tmp_path, study, barrier)) for study in studies]
    for job in jobs:
        job.start()
    for job in jobs:
        job.join()
    assert [job.exitcode for job in jobs] == [0] * len(jobs)
    stored = sorted((r.inputs.stop["evaluations"], r.run) for r in read_records(tmp_path))
    assert stored == [(50 + study, run) for study in range(STUDIES) for run in range(RUNS)]
    assert len(read_manifest(tmp_path).sessions) == len(studies) * RUNS


def test_durations_do_not_follow_the_clock_on_the_wall(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    backwards = itertools.count(2e9, -3600.0)
    monkeypatch.setattr(time, "time", lambda: next(backwards))
    tasks = [Task(problem=WALK, solver=name, stop=Stop(evaluations=300)) for name in ("pso", "slsqp", "ipopt")]
    for record in run_study(Study(tasks=tuple(tasks), folder=tmp_path)):
        times = record.time_s
        assert min(times.build, times.compile, times.solve, *times.history) >= 0.0
        assert list(times.history) == sorted(times.history)
    solution = nlp_gait.solve(nlp_gait.load("walk12"))
    assert min(solution.time_s.build, solution.time_s.compile, solution.starts[0].time_s) >= 0.0


@pytest.mark.slow
def test_a_limit_of_open_files_is_one_sentence_and_keeps_runs(tmp_path: Path, coarse_pictures: None) -> None:
    line = f"compare walk12 --algorithms random --starts 0 --evaluations 60 --out {tmp_path} --jobs"
    calls.nlp_gait(*line.split(), "1", "--runs", "2")
    command = f'ulimit -n 24; exec "{sys.executable}" -m nlp_gait {line} 20 --runs 22'
    done = subprocess.run(["sh", "-c", command], cwd=ROOT, capture_output=True, text=True, timeout=120)
    assert done.returncode == 1 and done.stdout == "" and done.stderr.count("\n") == 1
    assert "too many files are open" in done.stderr
    assert len(list(tmp_path.glob("records/*/*.json"))) == 2
