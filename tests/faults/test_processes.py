"""Processes that are killed, work at the same time or cannot begin: files are whole, no run is lost, and nothing runs on."""

from __future__ import annotations

import errno
import itertools
import json
import multiprocessing
import os
import signal
import subprocess
import sys
import time
import warnings
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from multiprocessing.synchronize import Barrier
from pathlib import Path
from types import SimpleNamespace

import pytest
from joblib.externals.loky import get_reusable_executor

import nlp_gait
from compare.__main__ import fix_environment
from compare.study.record import RunRecord
from compare.study.record_files import find_record, read_records, write_records
from compare.study.run_study import Study, run_study
from compare.study.task import ProblemSpec, Stop, Task
from metaheuristics import ParticleSwarm
from metaheuristics.errors import SearchError
from metaheuristics.interface import Search, Start
from metaheuristics.settings import check_installed
from nlp_gait.backends.kernel import library_cache
from nlp_gait.errors import NoWorkersError, WorkerError
from nlp_gait.files import remove_leftovers
from nlp_gait.processes import run_in_processes
from tests.compare.cli import calls
from tests.compare.questions.test_contract import without_times
from tests.faults.processes import ROOT, fake_compiler, start

STEM = "walk12-sweep-step_length_m-ipopt"
SECONDS = 10.0  # within which all must have ended; on an idle machine it takes one
WALK = ProblemSpec(name="walk12")
STUDIES, RUNS = 3, 6


def wait_for(condition: Callable[[], bool], seconds: float = 60.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


@pytest.mark.slow
def test_a_sweep_killed_and_interrupted_ends_as_undisturbed(tmp_path: Path, undrawn_pictures: None) -> None:
    command = ("sweep", "walk12", "--over", "step_length_m=0.06:0.12:4", "--starts", "1", "--out")
    calls.nlp_gait(*command, tmp_path / "undisturbed")
    killed, steps = tmp_path / "killed", tmp_path / "killed" / "store"
    for number, wanted in ((signal.SIGKILL, 2), (signal.SIGINT, 4)):
        process = start(*command, str(killed))
        wait_for(lambda: process.poll() is not None or len(list(steps.glob("solve-*.json"))) >= wanted)  # noqa: B023
        process.send_signal(number)
        _, messages = process.communicate(timeout=60)
        assert process.returncode == (-9 if number == signal.SIGKILL else 130), messages
        for path in steps.glob("*.json"):
            json.loads(path.read_text())  # whole or absent
    assert messages.splitlines()[-1].endswith("; rerun the command to continue")
    assert "results were stored by an earlier run" in calls.nlp_gait(*command, killed).stderr
    whole, resumed = (
        (without_times(json.loads((folder / f"{STEM}.json").read_text())), {f.name for f in folder.glob("store/*")})
        for folder in (tmp_path / "undisturbed", killed)
    )
    assert resumed == whole and len(whole[0]["points"]) == 4


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
    tasks = tuple(replace(make_task(300, run), solver=solver) for run in range(6))
    dying = run_study(Study(tasks=tasks, folder=tmp_path / "study", jobs=2))
    assert (tmp_path / "dead").exists() and len(read_records(tmp_path / "study")) == 6
    undisturbed = run_study(Study(tasks=tuple(replace(task, solver=ParticleSwarm()) for task in tasks)))
    assert [record.x for record in dying] == [record.x for record in undisturbed]


def list_processes() -> dict[int, tuple[int, str]]:
    """Return the parent and the command line of each process that has not ended, by its number."""
    processes = {}
    for entry in Path("/proc").iterdir():
        try:
            state, parent, *_ = (entry / "stat").read_text().rpartition(")")[2].split()
            command = (entry / "cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
            processes |= {int(entry.name): (int(parent), command)} if state != "Z" else {}
        except (OSError, ValueError):  # ended meanwhile, or no process
            continue
    return processes


def list_offspring(parent: int) -> dict[int, str]:
    """Return the command lines of the processes that a process has started, and of those that they have, by number."""
    processes, below = list_processes(), set[int]()
    while new := {child for child, (above, _) in processes.items() if above in below | {parent}} - below:
        below |= new
    return {child: processes[child][1] for child in below}


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="reads /proc")
@pytest.mark.parametrize(
    ("name", "started"),
    [("SIGHUP", "loky"), ("SIGKILL", "loky")] + [(name, "sleep 600") for name in ("SIGINT", "SIGTERM", "SIGKILL")],
)
def test_workers_and_compilers_end_with_what_started_them(name: str, started: str, tmp_path: Path) -> None:
    if started == "loky":
        line = "compare walk12 --algorithms pso --runs 4 --evaluations 90000000 --jobs 2 --out"
        process = start(*line.split(), str(tmp_path / "results"))
    else:
        compiler = {"CXX": fake_compiler(tmp_path, "sleep 600 & wait")}
        cache = {library_cache.FOLDER_VARIABLE: str(tmp_path / "cache")}
        program = "import nlp_gait; nlp_gait.compile_objective(nlp_gait.load('walk12'))"
        process = subprocess.Popen(
            [sys.executable, "-c", program], cwd=ROOT, env={**os.environ, **compiler, **cache}, text=True
        )
    count = 2 if started == "loky" else 1
    try:
        wait_for(lambda: sum(started in text for text in list_offspring(process.pid).values()) >= count)
        time.sleep(1.0 if started == "loky" else 0.0)  # the runs are in progress
        offspring = list_offspring(process.pid)
    finally:
        os.kill(process.pid, getattr(signal, name))
        process.communicate(timeout=30)
    wait_for(lambda: not offspring.keys() & list_processes().keys(), SECONDS)


def write_study(folder: Path, study: int, barrier: Barrier) -> None:
    """Write all records of a study, in step with the others, and read those of this study back in between."""
    tasks = [make_task(50 + study, run, f"study {study}") for run in range(RUNS)]
    records = [RunRecord.make_failed(task, "tried") for task in tasks]
    for count in range(1, RUNS + 1):
        barrier.wait(60)
        write_records(records[:count], folder)
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


def test_records_from_the_future_are_kept_and_their_leftovers_go(tmp_path: Path) -> None:
    study = Study(tasks=(make_task(300, 0),), folder=tmp_path)
    run_study(study)
    (record,) = tmp_path.glob("records/*/*.json")
    leftover, ahead = record.with_name(".0123456789abcdef.tmp"), time.time() + 86_400.0
    leftover.write_text("{")
    for path in (record, leftover):
        os.utime(path, (ahead, ahead))
    kept: list[int] = []
    run_study(study, on_stored=kept.append)
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


def test_workers_do_not_begin_in_a_folder_that_is_gone(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    tmp_path.rmdir()
    with pytest.raises(WorkerError, match="the working folder is gone"):
        list(run_in_processes({k: partial(abs, k) for k in range(2)}, 2))


@pytest.mark.parametrize(
    ("error", "sentence"),
    [
        (OSError(errno.EMFILE, "Too many open files"), "too many files are open"),
        (OSError(errno.ENFILE, "Too many open files in system"), "too many files are open"),
        (BlockingIOError(errno.EAGAIN, "Resource temporarily unavailable"), "there are too many processes or threads"),
        (RuntimeError("can't start new thread"), "there are too many processes or threads"),
        (OSError(errno.ENOMEM, "Cannot allocate memory"), "there is not enough memory"),
        (MemoryError("std::bad_alloc"), "there is not enough memory"),
        (ImportError("x.so: failed to map segment from shared object"), "there is not enough memory"),
    ],
    ids=lambda value: str(value)[:40],
)
def test_a_shortage_at_the_start_of_workers_is_one_sentence(
    error: Exception, sentence: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Joblib hides it behind an error of its own."""

    def begin(self: object) -> None:
        try:
            raise error
        finally:
            raise UnboundLocalError

    monkeypatch.setattr("joblib.externals.loky.backend.process.LokyProcess.start", begin)
    get_reusable_executor().shutdown(wait=True, kill_workers=True)  # else its workers would do
    with pytest.raises(NoWorkersError, match=f"cannot begin: {sentence}; use fewer --jobs"):
        list(run_in_processes({k: partial(abs, k) for k in range(2)}, 2))


@pytest.mark.slow
def test_a_limit_of_open_files_is_one_sentence_and_keeps_runs(tmp_path: Path, undrawn_pictures: None) -> None:
    line = f"compare walk12 --algorithms random --starts 0 --evaluations 60 --out {tmp_path} --jobs"
    calls.nlp_gait(*line.split(), "1", "--runs", "2")
    command = f'ulimit -n 24; exec "{sys.executable}" -m nlp_gait {line} 20 --runs 22'
    done = subprocess.run(["sh", "-c", command], cwd=ROOT, capture_output=True, text=True, timeout=120)
    assert done.returncode == 1 and done.stdout == "" and done.stderr.count("\n") == 1
    assert "too many files are open" in done.stderr
    assert len(list(tmp_path.glob("records/*/*.json"))) == 2


@pytest.mark.parametrize("width", ["0", "-5", "", "wide", "1e3", "٣", "0000", "80"])
def test_a_terminal_without_a_width_has_the_usual_one(width: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setenv("COLUMNS", width)
    monkeypatch.setenv("MPLBACKEND", "nonsense")
    fix_environment()
    assert os.environ.get("COLUMNS") == ("80" if width == "80" else None) and os.environ["MPLBACKEND"] == "agg"


def test_pycma_without_docstrings_is_rejected(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("metaheuristics.settings.is_installed", lambda package: True)
    monkeypatch.setattr(sys, "flags", SimpleNamespace(optimize=2))
    with pytest.raises(SearchError, match="PYTHONOPTIMIZE"):
        check_installed("cma", "cma")
    check_installed("pymoo:GA", "pymoo")
