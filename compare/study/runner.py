"""One run of one solver on one problem, from plain data to a record."""

from __future__ import annotations

from collections.abc import Callable

from compare.study.apart import run_apart
from compare.study.record import RunRecord
from compare.study.runs.gradient_run import gradient_run
from compare.study.runs.search_run import search_run
from compare.study.task import Task

Run = Callable[[Task, RunRecord | None], RunRecord]
"""Does one run of a task, from the run that it polishes if it does; it crosses process borders."""

LONGEST_REASON = 500  # characters of an error that a record keeps


def run_task(task: Task, start: RunRecord | None = None, callback: Callable[..., None] | None = None) -> RunRecord:
    """Do one run and judge it.

    Args:
        task: what to run.
        start: the run that this one polishes, if it does.
        callback: called with X, f, violation of every generation (search algorithms only).
    """
    return search_run(task, callback) if task.is_search else gradient_run(task, start)


def attempt(task: Task, start: RunRecord | None = None, run: Run = run_task) -> RunRecord:
    """Do one run; whatever goes wrong in it is its record, not the end of the study.

    Code of one's own by name runs in a process of its own, which is ended when it does not return.
    """
    if task.is_user_code:
        return run_apart(task, lambda: _attempt(task, start, run))
    return _attempt(task, start, run)


def _attempt(task: Task, start: RunRecord | None, run: Run) -> RunRecord:
    try:
        return run(task, start)
    except (Exception, SystemExit) as error:
        reason = " ".join(str(error).split())
        said = f"{type(error).__name__}: {reason[:LONGEST_REASON]}" if reason else type(error).__name__
        return RunRecord.failed(task, f"failed: {said}")
