"""A run in a process of its own: it may hang, die, exit or print as it likes, and its record says so."""

from __future__ import annotations

import ctypes
import json
import multiprocessing
import os
import signal
import sys
from collections.abc import Callable
from contextlib import suppress
from multiprocessing.connection import Connection, wait

from compare.judge import evaluate
from compare.study.record import RunRecord, record_from
from compare.study.task import Task
from nlp_gait.backends.kernel.compiled import compile_objective
from nlp_gait.files import LARGEST_FILE, without_nan

# A run that heeds its time limit ends within it and is then judged; this long after the limit its process is ended.
GRACE_S = 5.0
PR_SET_PDEATHSIG = 1


def run_apart(task: Task, run: Callable[[], RunRecord]) -> RunRecord:
    """The record that a run makes in a copy of this process, or one that says why it made none.

    Everything but the run is built here before, so that its time limit is for the run alone. What it prints is dropped. Where
    processes cannot be copied (Windows), and in a worker that may have no children (Dask), it runs in this process.

    Args:
        task: what is run; without a time limit it may take forever.
        run: does it.
    """
    copied = "fork" in multiprocessing.get_all_start_methods() and not multiprocessing.current_process().daemon
    if not copied:
        return run()
    problem = task.problem.load()
    compile_objective(problem, threads=1)
    evaluate(problem, 0.5 * (problem.lower + problem.upper))
    limit = task.stop.time_limit_s
    context = multiprocessing.get_context("fork")
    receiver, sender = context.Pipe(duplex=False)
    process = context.Process(target=_alone, args=(sender, run), daemon=True)
    process.start()
    sender.close()
    try:
        ready = wait([receiver, process.sentinel], None if limit is None else limit + GRACE_S)
        if not ready:
            return RunRecord.failed(
                task, f"failed: it did not return within {GRACE_S:g} s after the time limit of {limit:g} s"
            )
        return _received(task, receiver, process)
    finally:
        if process.pid is not None:
            with suppress(ProcessLookupError, PermissionError):
                os.killpg(process.pid, signal.SIGKILL)  # with all that it started
        process.kill()
        process.join()
        receiver.close()


def _received(task: Task, receiver: Connection, process: multiprocessing.process.BaseProcess) -> RunRecord:
    """The record that a process sent, checked as one that is read from a file."""
    try:
        raw = receiver.recv_bytes(LARGEST_FILE) if receiver.poll(0) else b""
    except (EOFError, OSError):
        raw = b""
    if not raw:
        process.join(GRACE_S)
        code = process.exitcode or 0
        end = f"signal {signal.Signals(-code).name}" if code < 0 else f"status {code}"
        return RunRecord.failed(task, f"failed: its process ended without a result, by {end}")
    try:
        record = record_from(json.loads(raw))
    except (ValueError, RecursionError) as error:
        return RunRecord.failed(task, f"failed: its process sent no record: {error}")
    same = (record.problem, record.algorithm, record.run) == (task.problem.title, task.title, task.run)
    return record if same else RunRecord.failed(task, "failed: its process sent the record of another run")


def _alone(sender: Connection, run: Callable[[], RunRecord]) -> None:
    """In the new process: a session of its own, no output, ended with its parent; sends the record."""
    os.setsid()
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(PR_SET_PDEATHSIG, signal.SIGKILL)
    signal.signal(signal.SIGINT, signal.SIG_DFL)
    nowhere = os.open(os.devnull, os.O_RDWR)
    for descriptor in (0, 1, 2):
        os.dup2(nowhere, descriptor)
    # New streams: a lock of the old ones may be held by a thread that does not exist here.
    sys.stdout = sys.stderr = open(nowhere, "w", encoding="utf-8", errors="replace", closefd=False)  # noqa: SIM115
    record = run()
    sender.send_bytes(json.dumps(without_nan(record.to_json()), allow_nan=False).encode())
    sender.close()
    os._exit(0)  # nothing of this process's end is the parent's
