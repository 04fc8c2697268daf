"""A run in a process of its own: what comes back, what is said where nothing does, and what is left behind."""

from __future__ import annotations

import multiprocessing
import os
import signal
import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from compare.study import apart
from compare.study.record import RunRecord
from compare.study.task import ProblemSpec, Stop, Task

TASK = Task(problem=ProblemSpec(name="walk12"), solver="pso", stop=Stop(evaluations=20, time_limit_s=60.0))
IN_A_HURRY = replace(TASK, stop=Stop(evaluations=20, time_limit_s=0.05))

pytestmark = pytest.mark.skipif(
    "fork" not in multiprocessing.get_all_start_methods(), reason="processes cannot be copied here"
)


def said(say: Callable[[], object] = lambda: "", task: Task = TASK) -> str:
    """Status of the record that comes back from a run that says something."""
    return apart.run_apart(task, lambda: RunRecord.failed(TASK, str(say()))).status


def test_a_run_has_a_process_and_a_session_of_its_own_and_no_output(capfd: pytest.CaptureFixture[str]) -> None:
    def say() -> str:
        print("out")
        print("err", file=sys.stderr)
        os.write(1, b"out")
        handler = signal.getsignal(signal.SIGINT) == signal.SIG_DFL
        return f"{os.getpid()} {os.getsid(0)} {handler} {os.read(0, 1)!r}"

    own, session, handler, read = said(say).split()
    assert own == session != str(os.getpid()) and handler == "True" and read == "b''"
    assert capfd.readouterr() == ("", "")


def test_without_a_time_limit_it_is_waited_for() -> None:
    endless = replace(TASK, stop=Stop(evaluations=20))
    assert said(lambda: time.sleep(0.3) or "late", endless) == "late"


def test_after_its_time_limit_it_is_ended(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(apart, "GRACE_S", 0.1)
    status = said(lambda: time.sleep(60), IN_A_HURRY)
    assert status == "failed: it did not return within 0.1 s after the time limit of 0.05 s"
    monkeypatch.setattr(apart, "GRACE_S", 60.0)
    assert said(lambda: time.sleep(0.3) or "within the grace", IN_A_HURRY) == "within the grace"


@pytest.mark.parametrize(
    ("end", "message"),
    [
        (lambda: os._exit(0), "its process ended without a result, by status 0"),
        (lambda: os._exit(3), "its process ended without a result, by status 3"),
        (lambda: os.kill(os.getpid(), signal.SIGKILL), "its process ended without a result, by signal SIGKILL"),
    ],
)
def test_how_a_process_ended_is_said(end: Callable[[], object], message: str) -> None:
    assert said(end) == f"failed: {message}"


class Rubbish:
    """No record."""

    def __init__(self, data: object) -> None:
        self.data = data

    def to_json(self) -> object:
        return self.data


def test_what_it_sends_is_read_as_a_file_would_be() -> None:
    other = RunRecord.failed(replace(TASK, run=7), "of another run")
    good = RunRecord.failed(TASK, "").to_json()
    for run, message in (
        (other, "failed: its process sent the record of another run"),
        (Rubbish({**good, "iterations": "many"}), "failed: its process sent no record: "),
        (Rubbish([]), "failed: its process sent no record: "),
    ):
        sent: Any = run
        assert apart.run_apart(TASK, lambda sent=sent: sent).status.startswith(message)


def test_what_it_started_ends_with_it(tmp_path: Path) -> None:
    def say() -> int:
        child = os.fork()
        if child == 0:
            time.sleep(60)
            os._exit(0)
        return child

    child = int(said(say))
    for _ in range(200):
        try:
            os.kill(child, 0)
        except ProcessLookupError:
            return
        if (stat := Path(f"/proc/{child}/stat")).exists() and stat.read_text().rpartition(")")[2].split()[0] == "Z":
            return  # ended, and nobody has asked for its status
        time.sleep(0.05)
    raise AssertionError("it goes on")


def test_a_worker_that_may_have_no_children_runs_it_itself(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(multiprocessing.current_process()._config, "daemon", True)  # type: ignore[attr-defined]
    assert said(os.getpid) == str(os.getpid())
