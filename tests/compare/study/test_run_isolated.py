"""User code runs in its own process: what comes back, what its record says otherwise, and what is left behind."""

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

from compare.study.record import RunRecord
from compare.study.run_task import try_task
from compare.study.task import ProblemSpec, Stop, Task

STOP = Stop(evaluations=20, time_limit_s=60.0)

pytestmark = pytest.mark.skipif(
    "fork" not in multiprocessing.get_all_start_methods(), reason="processes cannot be copied here"
)


@pytest.fixture
def task(tmp_path: Path) -> Task:
    path = tmp_path / "own.py"
    path.write_text("def search(f, lower, upper, evaluations, seed): ...\n")
    return Task(problem=ProblemSpec(name="walk12"), solver=f"{path}:search", stop=STOP)


def status(task: Task, say: Callable[[], object] = lambda: "") -> str:
    """Status of the record that comes back from a run that says something."""
    return try_task(task, run=lambda task: RunRecord.make_failed(task, str(say()))).status.removeprefix("failed: ")


def test_a_run_has_its_own_process_and_session_and_no_output(task: Task, capfd: pytest.CaptureFixture[str]) -> None:
    def say() -> str:
        print("out")
        print("err", file=sys.stderr)
        os.write(1, b"out")
        handler = signal.getsignal(signal.SIGINT) == signal.SIG_DFL
        return f"{os.getpid()} {os.getsid(0)} {handler} {os.read(0, 1)!r}"

    own, session, handler, read = status(task, say).split()
    assert own == session != str(os.getpid()) and handler == "True" and read == "b''"
    assert capfd.readouterr() == ("", "")


class Rubbish:
    """No record."""

    def __init__(self, data: object) -> None:
        self.data = data

    def to_json(self) -> object:
        return self.data


def test_what_it_sends_is_read_as_a_file_would_be(task: Task) -> None:
    other = RunRecord.make_failed(replace(task, run=7), "of another run")
    good = RunRecord.make_failed(task, "").to_json()
    for sent, message in (
        (other, "failed: its process sent the record of another run"),
        (Rubbish({**good, "iterations": "many"}), "failed: its record could not be read again: "),
        (Rubbish([]), "failed: its record could not be read again: "),
    ):
        run: Any = lambda *_, sent=sent: sent  # noqa: E731
        assert try_task(task, run=run).status.startswith(message)


def test_what_it_started_ends_with_it(task: Task) -> None:
    def say() -> int:
        child = os.fork()
        if child == 0:
            time.sleep(60)
            os._exit(0)
        return child

    child = int(status(task, say))
    for _ in range(200):
        try:
            os.kill(child, 0)
        except ProcessLookupError:
            return
        if (stat := Path(f"/proc/{child}/stat")).exists() and stat.read_text().rpartition(")")[2].split()[0] == "Z":
            return  # ended, not yet reaped
        time.sleep(0.05)
    raise AssertionError("it continues")


def test_a_worker_that_may_have_no_children_runs_it_itself(task: Task, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(multiprocessing.current_process()._config, "daemon", True)  # type: ignore[attr-defined]
    assert status(task, os.getpid) == str(os.getpid())
