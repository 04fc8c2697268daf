"""Jobs in processes: those that crash, exit, raise, hang or answer nonsense are errors of their own, and all others return."""

import errno
import faulthandler
import multiprocessing
import os
import re
import signal
import subprocess
import sys
import time
from collections.abc import Callable
from functools import partial
from typing import Any

import pytest

from nlp_gait import processes
from nlp_gait.errors import InputError, NoWorkersError, WorkerError
from nlp_gait.interrupts import never
from nlp_gait.processes import Job, run_alone, run_in_forks, run_jobs
from tests.faults.processes import ROOT, is_alive, wait_for

METHODS = [method for method in ("fork", "spawn") if method in multiprocessing.get_all_start_methods()]
needs_fork = pytest.mark.skipif("fork" not in METHODS, reason="processes cannot be copied here")
Send = Callable[[Any], None]


class Unreadable:
    """It is pickled, but what is read is no integer."""

    def __reduce__(self) -> tuple[type[int], tuple[str]]:
        return int, ("no integer",)


def misbehave(kind: str, send: Send) -> object:
    if kind == "crashes":
        faulthandler.disable()
        os.kill(os.getpid(), signal.SIGSEGV)
    if kind == "is killed":
        os.kill(os.getpid(), signal.SIGKILL)
    if kind == "exits":
        os._exit(3)
    if kind == "leaves":
        sys.exit("enough")
    if kind == "hangs":
        time.sleep(600)
    if kind == "raises":
        raise InputError("no")
    if kind == "is unreadable":
        return Unreadable()
    return lambda: kind  # cannot be pickled


ENDS = {
    "crashes": (WorkerError, "its process ended without a result, by signal SIGSEGV"),
    "is killed": (WorkerError, "its process ended without a result, by signal SIGKILL"),
    "exits": (WorkerError, "its process ended without a result, by status 3"),
    "leaves": (SystemExit, "enough"),
    "hangs": (TimeoutError, ""),
    "raises": (InputError, "no"),
    "is unreadable": (WorkerError, "its process sent something that cannot be read: .*no integer"),
    "returns a function": (WorkerError, ".*[Cc]an't pickle|.*[Cc]an't get local"),
}


def square(number: int, send: Send) -> tuple[int, int]:
    send(number)
    return number * number, os.getpid()


@pytest.mark.commit
@pytest.mark.parametrize("alone", [False, True])
@pytest.mark.parametrize("method", METHODS)
def test_each_job_ends_in_its_own_way_and_the_others_return(method: str, alone: bool) -> None:
    every = 4 if alone and method == "spawn" else 1  # each process imports everything
    names, heard, found = list(ENDS)[::every], list[int](), dict[int, Any]()
    late = {"hangs": lambda: len(found) == len(jobs) - 1}  # when all others have ended
    jobs = [Job(call=partial(misbehave, name), is_late=late.get(name, never), alone=alone) for name in names]
    jobs += [Job(call=partial(square, k), receive=heard.append, alone=alone) for k in range(6)]
    for number, result in run_jobs(jobs, 3, method=method):
        assert number not in found
        found[number] = result
    assert len(found) == len(jobs)
    for number, name in enumerate(names):
        kind, text = ENDS[name]
        assert type(found[number]) is kind, name
        assert re.match(text, str(found[number])), name
    assert [found[len(names) + k][0] for k in range(6)] == [k * k for k in range(6)] and sorted(heard) == list(range(6))
    pids = {found[len(names) + k][1] for k in range(6)}
    assert os.getpid() not in pids and (len(pids) == 6 if alone else len(pids) <= 3)
    assert not multiprocessing.active_children()


@needs_fork
def test_messages_arrive_in_order_before_the_result_and_decide_how_long_it_may_run() -> None:
    def count(send: Send) -> str:
        for number in range(10**9):
            send(number)
            time.sleep(0.001)
        return "ended"

    heard: list[int] = []
    job = Job(call=count, receive=heard.append, is_late=lambda: len(heard) > 20, alone=True)
    ((_, result),) = run_jobs([job])
    assert isinstance(result, TimeoutError) and heard == list(range(len(heard))) and len(heard) > 20


@needs_fork
def test_no_more_jobs_begin_after_a_stop_and_a_closed_pool_leaves_no_process() -> None:
    ended: list[int] = []
    for number, _ in run_jobs([Job(call=partial(square, k)) for k in range(50)], 2, lambda: len(ended) >= 3):
        ended.append(number)
    assert 3 <= len(ended) <= 5
    results = run_jobs([Job(call=partial(square, 0)), *[Job(call=partial(misbehave, "hangs"))] * 3], 2)
    assert next(results)[0] == 0
    assert multiprocessing.active_children()
    results.close()  # type: ignore[attr-defined]
    assert not multiprocessing.active_children()


@needs_fork
def test_forks_yield_in_order_and_end_early_together() -> None:
    big = bytes(10**7)  # more than a pipe holds

    def work(number: int, stop: Callable[[], bool]) -> tuple[int, int, bool]:
        time.sleep(0.05 * (3 - number % 4))
        return number, len(big) + number, stop()

    assert [item[:2] for item in run_in_forks(work, 8, 3)] == [(k, 10**7 + k) for k in range(8)]
    started, end = time.monotonic(), time.monotonic() + 0.5

    def wait(number: int, stop: Callable[[], bool]) -> int:
        while not stop():
            time.sleep(0.01)
        return number

    assert list(run_in_forks(wait, 100, 3, lambda: time.monotonic() > end)) == [0, 1, 2]
    assert time.monotonic() < started + 10.0


@needs_fork
@pytest.mark.parametrize("name", ["is killed", "exits", "raises"])
def test_a_fork_that_fails_ends_all(name: str) -> None:
    def work(number: int, _: Callable[[], bool]) -> object:
        return misbehave(name if number == 1 else "hangs" if number == 2 else "", print) if number else 0

    with pytest.raises(ENDS[name][0], match=ENDS[name][1]):
        list(run_in_forks(work, 5, 2))
    assert not multiprocessing.active_children()


@needs_fork
def test_what_runs_alone_has_no_streams_its_own_session_and_no_survivors(capfd: pytest.CaptureFixture[str]) -> None:
    def call(send: Send) -> tuple[str, int]:
        print("to the output")
        os.write(2, b"to the errors")
        child = subprocess.Popen(["sleep", "600"])
        send((os.getsid(0), child.pid))
        return sys.stdin.read() if sys.stdin else "", os.getpid()

    heard: list[tuple[int, int]] = []
    text, pid = run_alone(call, receive=heard.append)
    ((session, child),) = heard
    assert (text, session) == ("", pid) and capfd.readouterr() == ("", "")
    wait_for(lambda: not is_alive(child), 5.0)


PARENT = """
import os, sys, time
from nlp_gait.interrupts import never
from nlp_gait.processes import Job, run_jobs

def call(send):
    send(os.getpid())
    time.sleep(600)

jobs = [Job(call=call, receive=lambda pid: print(pid, flush=True), alone=alone) for alone in (False, True)]
if __name__ == "__main__":
    list(run_jobs(jobs, 2, method=sys.argv[1]))
"""


@pytest.mark.skipif(sys.platform != "linux", reason="reads /proc")
def test_no_process_outlives_a_parent_that_is_killed() -> None:
    parent = subprocess.Popen(
        [sys.executable, "-c", PARENT, "fork"], cwd=ROOT, stdout=subprocess.PIPE, text=True, start_new_session=True
    )
    assert parent.stdout is not None
    children = [int(parent.stdout.readline()) for _ in range(2)]
    parent.kill()
    parent.communicate(timeout=30)
    wait_for(lambda: not any(map(is_alive, children)), 5.0)


@pytest.mark.parametrize(
    ("error", "sentence"),
    [
        (OSError(errno.EMFILE, "Too many open files"), "too many files are open"),
        (OSError(errno.ENFILE, "Too many open files in system"), "too many files are open"),
        (BlockingIOError(errno.EAGAIN, "Resource temporarily unavailable"), "there are too many processes or threads"),
        (OSError(errno.ENOMEM, "Cannot allocate memory"), "there is not enough memory"),
        (OSError(errno.EPERM, "Operation not permitted"), "Operation not permitted"),
    ],
    ids=lambda value: str(value)[:40],
)
@pytest.mark.parametrize("place", ["Pipe", "Process"])
def test_processes_that_cannot_begin_are_one_sentence(
    place: str, error: OSError, sentence: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    def fail(*_: object, **__: object) -> None:
        raise error

    context = multiprocessing.get_context()
    monkeypatch.setattr(context, place, fail, raising=False)
    monkeypatch.setattr(processes.multiprocessing, "get_context", lambda method: context)
    with pytest.raises(NoWorkersError, match=f"cannot begin: {sentence}; use fewer --jobs"):
        list(run_jobs([Job(call=partial(square, 2))]))
