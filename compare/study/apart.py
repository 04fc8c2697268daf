"""A run in its own process: it may hang, die, exit or print, and its record says so."""

from __future__ import annotations

import json
import multiprocessing
from collections.abc import Callable

from compare.judge import evaluate
from compare.study.record import RunRecord, record_from
from compare.study.task import Task
from nlp_gait.backends.kernel.compiled import compile_objective
from nlp_gait.errors import WorkerError
from nlp_gait.files import LARGEST_FILE, replace_nan
from nlp_gait.processes import run_isolated

# A run that respects its time limit ends within it and is then judged; its process is killed this long after the limit.
GRACE_S = 5.0


def run_apart(task: Task, run: Callable[[], RunRecord]) -> RunRecord:
    """Return the record that a run makes in a forked process, or one that says why there is none.

    Everything but the run is built before the fork, so that the time limit is for the run alone. What it prints is dropped.
    Where processes cannot be forked (Windows), and in a worker that may have no children (Dask), it runs in this process.

    Args:
        task: what is run; without a time limit it may take forever.
        run: performs the task.
    """
    if "fork" not in multiprocessing.get_all_start_methods() or multiprocessing.current_process().daemon:
        return run()
    problem = task.problem.load()
    compile_objective(problem, threads=1)
    evaluate(problem, 0.5 * (problem.lower + problem.upper))
    limit = task.stop.time_limit_s
    try:
        sent = run_isolated(
            lambda: json.dumps(replace_nan(run().to_json()), allow_nan=False).encode(),
            None if limit is None else limit + GRACE_S,
            LARGEST_FILE,
        )
    except TimeoutError:
        return RunRecord.failed(
            task, f"failed: it did not return within {GRACE_S:g} s after the time limit of {limit:g} s"
        )
    except WorkerError as error:
        return RunRecord.failed(task, f"failed: {error}")
    try:
        record = record_from(json.loads(sent))  # checked as a record from a file
    except (ValueError, RecursionError) as error:
        return RunRecord.failed(task, f"failed: its process sent no record: {error}")
    same = (record.problem, record.solver, record.run) == (task.problem.title, task.title, task.run)
    return record if same else RunRecord.failed(task, "failed: its process sent the record of another run")
