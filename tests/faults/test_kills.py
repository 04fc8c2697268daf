"""kill -9 and hang-ups: what is finished stays whole, what was started ends, and the same command continues."""

from __future__ import annotations

import json
import os
import random
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

import pytest

from compare.study.record import read_record
from compare.study.run_study import Study, run_study
from compare.study.task import ProblemSpec, Stop, Task
from metaheuristics import ParticleSwarm
from metaheuristics.interface import Search, Start
from nlp_gait.backends.kernel import library_cache
from tests.compare.cli.calls import nlp_gait
from tests.compare.questions.test_contract import without_times
from tests.faults.processes import ROOT, fake_compiler, start

pytestmark = pytest.mark.slow
STEM = "walk12-sweep-step_length_m-ipopt"
SECONDS = 10.0  # within which all must have ended; on an idle machine it takes one
reads_proc = pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="reads /proc")


def test_a_sweep_killed_and_interrupted_ends_as_undisturbed(tmp_path: Path, undrawn_pictures: None) -> None:
    command = ("sweep", "walk12", "--over", "step_length_m=0.06:0.12:4", "--starts", "1")
    nlp_gait(*command, "--out", tmp_path / "undisturbed")
    killed, steps = tmp_path / "killed", tmp_path / "killed" / "store"
    for number, wanted in ((signal.SIGKILL, 2), (signal.SIGINT, 4)):
        process = start(*command, "--out", str(killed))
        wait_for(lambda: process.poll() is not None or len(list(steps.glob("solve-*.json"))) >= wanted)  # noqa: B023
        process.send_signal(number)
        _, messages = process.communicate(timeout=60)
        assert process.returncode == (-9 if number == signal.SIGKILL else 130), messages
        for path in steps.glob("*.json"):
            json.loads(path.read_text())  # whole or absent
    *_, said = messages.splitlines()
    assert said.startswith("nlp-gait: interrupted after") and said.endswith("; rerun the command to continue")
    assert "results were stored by an earlier run" in nlp_gait(*command, "--out", killed).stderr
    whole, resumed = (
        without_times(json.loads((tmp_path / name / f"{STEM}.json").read_text())) for name in ("undisturbed", "killed")
    )
    assert resumed == whole and len(whole["points"]) == 4
    names = [{path.name for path in (tmp_path / name / "store").iterdir()} for name in ("undisturbed", "killed")]
    assert names[0] == names[1]


def test_the_result_of_an_earlier_solve_survives_a_killed_one(tmp_path: Path) -> None:
    out = tmp_path / "best.json"
    nlp_gait("solve", "walk12", "--starts", "1", "--out", out)
    before = out.read_bytes()
    process = start("solve", "walk12", "--starts", "100000", "--out", str(out), "--force")
    time.sleep(random.Random(2).uniform(1.0, 2.0))
    process.kill()
    process.communicate()
    assert out.read_bytes() == before


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


def test_a_worker_that_dies_in_the_middle_costs_no_run(tmp_path: Path) -> None:
    def run(solver: object, **where: object) -> list[object]:
        tasks = [
            Task(problem=ProblemSpec(name="walk12"), solver=solver, run=k, stop=Stop(evaluations=300)) for k in range(6)
        ]
        return [record.x for record in run_study(Study(tasks=tuple(tasks), **where))]

    dying = run(DiesOnce(marker=str(tmp_path / "dead")), folder=tmp_path / "study", jobs=2)
    assert (tmp_path / "dead").exists()
    assert dying == run(ParticleSwarm(population=20))
    assert len([read_record(path) for path in (tmp_path / "study").rglob("*.json")]) == 6


def list_offspring(parent: int) -> set[int]:
    """Processes that a process has started, and those that they have."""
    parents: dict[int, int] = {}
    for entry in Path("/proc").iterdir():
        if entry.name.isdigit():
            try:
                parents[int(entry.name)] = int((entry / "stat").read_text().rpartition(")")[2].split()[1])
            except OSError:  # ended meanwhile
                continue
    found: set[int] = set()
    while new := {child for child, above in parents.items() if above in found | {parent}} - found:
        found |= new
    return found


def is_running(number: int) -> bool:
    try:
        return Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0] != "Z"
    except OSError:
        return False


def wait_for(condition: Callable[[], bool], seconds: float = 60.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.01)


def read_command(number: int) -> str:
    try:
        return Path(f"/proc/{number}/cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
    except OSError:
        return ""


@reads_proc
@pytest.mark.parametrize(
    ("name", "started"),
    [
        *(("SIGHUP", "loky"), ("SIGKILL", "loky")),
        *((name, "sleep 600") for name in ("SIGINT", "SIGTERM", "SIGKILL")),
    ],
)
def test_workers_and_compilers_end_with_what_started_them(name: str, started: str, tmp_path: Path) -> None:
    if started == "loky":
        effort = "--runs 4 --evaluations 90000000 --jobs 2"
        line = f"compare walk12 --algorithms pso {effort} --out {tmp_path / 'results'}"
        process = start(*line.split())
    else:
        compiler = {"CXX": fake_compiler(tmp_path, "sleep 600 & wait")}
        cache = {library_cache.FOLDER_VARIABLE: str(tmp_path / "cache")}
        program = "import nlp_gait; nlp_gait.compile_objective(nlp_gait.load('walk12'))"
        process = subprocess.Popen(
            [sys.executable, "-c", program], cwd=ROOT, env={**os.environ, **compiler, **cache}, text=True
        )
    count = 2 if started == "loky" else 1
    try:
        wait_for(lambda: sum(started in read_command(child) for child in list_offspring(process.pid)) >= count)
        time.sleep(1.0 if started == "loky" else 0.0)  # the runs are in progress
        offspring = list_offspring(process.pid)
    finally:
        os.kill(process.pid, getattr(signal, name))
        process.communicate(timeout=30)
    wait_for(lambda: not any(map(is_running, offspring)), SECONDS)
