"""One run of one solver on one problem, from plain data to a record."""

from __future__ import annotations

from collections.abc import Callable

from compare.study.record import History, RunRecord, Times, Verdict
from compare.study.runs.gradient_run import gradient_run
from compare.study.runs.search_run import search_run
from compare.study.task import Task

Run = Callable[[Task, RunRecord | None], RunRecord]
"""Does one run of a task, from the run that it polishes if it does; it crosses process borders."""


def run_task(task: Task, start: RunRecord | None = None, observe: Callable[..., None] | None = None) -> RunRecord:
    """Do one run and judge it.

    Args:
        task: what to run.
        start: the run that this one polishes, if it does.
        observe: called with X, f, violation of every generation (search algorithms only).
    """
    return search_run(task, observe) if task.is_search else gradient_run(task, start)


def attempt(task: Task, start: RunRecord | None = None, run: Run = run_task) -> RunRecord:
    """Do one run; whatever goes wrong in it is its record, not the end of the study."""
    try:
        return run(task, start)
    except Exception as error:
        return RunRecord.of(
            task,
            settings={},
            status=f"failed: {type(error).__name__}: {error}",
            success=False,
            x={},
            objective=None,
            violation=None,
            verdict=Verdict.without_point(),
            evaluations={"f": 0},
            failed_evaluations=0,
            iterations=0,
            active_constraints=(),
            history=History(evaluations=(), objective=()),
            time_s=Times(build=0.0, compile=0.0, solve=0.0, objective=0.0, history=()),
        )
