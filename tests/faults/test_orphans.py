"""Whatever ends a command, ends its workers and compilers with it, within seconds."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path

import pytest

from nlp_gait.backends.kernel import library_cache
from tests.faults.processes import ROOT, fake_compiler, start

SECONDS = 10.0  # within which all must have ended; on an idle machine it takes one


def offspring(parent: int) -> set[int]:
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


def running(processes: set[int]) -> set[int]:
    """Return those that have not ended; a process that is not yet reaped has ended."""
    states = {}
    for number in processes:
        try:
            states[number] = Path(f"/proc/{number}/stat").read_text().rpartition(")")[2].split()[0]
        except OSError:
            continue
    return {number for number, state in states.items() if state != "Z"}


def wait_for(condition: Callable[[], bool], seconds: float = 60.0) -> None:
    end = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < end
        time.sleep(0.05)


def command_line(number: int) -> str:
    try:
        return Path(f"/proc/{number}/cmdline").read_bytes().replace(b"\0", b" ").decode(errors="replace")
    except OSError:
        return ""


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="reads /proc")
@pytest.mark.parametrize("name", ["SIGHUP", "SIGKILL"])
def test_workers_end_with_the_study(name: str, tmp_path: Path) -> None:
    effort = ("--runs", "4", "--evaluations", "90000000", "--jobs", "2")
    study = start("compare", "walk12", "--algorithms", "pso", *effort, "--out", str(tmp_path / "results"))
    try:
        wait_for(lambda: sum("loky" in command_line(child) for child in offspring(study.pid)) >= 2)
        time.sleep(1.0)  # the runs are in progress
        started = offspring(study.pid)
        assert running(started)
    finally:
        os.kill(study.pid, getattr(signal, name))
        study.communicate(timeout=30)
    wait_for(lambda: not running(started), SECONDS)


@pytest.mark.slow
@pytest.mark.skipif(not Path("/proc/self/stat").exists(), reason="reads /proc")
@pytest.mark.parametrize("name", ["SIGTERM", "SIGKILL"])
def test_the_compiler_ends_with_the_process_that_started_it(name: str, tmp_path: Path) -> None:
    compiler = fake_compiler(tmp_path, "sleep 600 & wait")
    program = "import nlp_gait; nlp_gait.compile_objective(nlp_gait.load('walk12'))"
    environment = {**os.environ, "CXX": compiler, library_cache.FOLDER_VARIABLE: str(tmp_path / "cache")}
    process = subprocess.Popen([sys.executable, "-c", program], cwd=ROOT, env=environment)
    try:
        wait_for(lambda: any("sleep 600" in command_line(child) for child in offspring(process.pid)))
        started = offspring(process.pid)
    finally:
        os.kill(process.pid, getattr(signal, name))
        process.wait(timeout=30)
    wait_for(lambda: not running(started), SECONDS)
