"""Runs repeated from their records: the same seed gives the same bits."""

from collections.abc import Sequence

from compare.study.definition import describe_differences, hash_definition
from compare.study.record import RunRecord
from compare.study.run_task import try_task
from compare.study.task import Handling, ProblemSpec, Stop, Task
from nlp_gait.decoding import decode
from nlp_gait.errors import InputError
from nlp_gait.formulation.result import StoredProblem
from nlp_gait.user_code import resolve_code


def make_task(record: RunRecord, known: RunRecord | None = None) -> Task:
    """Return the task of a record.

    Args:
        record: of the run.
        known: the record as it was written, if the files of its problem are elsewhere now.

    Raises:
        InputError: the run ended by the clock, or its solver was an object in Python.
        UserCodeError: it needs user code that the command does not name.
    """
    definition = record.definition
    solver, stored = definition["solver"], decode(StoredProblem, definition["problem"], "problem")
    if not isinstance(solver, str):
        if "name" not in solver:
            raise InputError("its solver was an object of Python, which has no name")
        solver = resolve_code(solver["name"], "algorithm", "the run")
    polishes = definition.get("polishes") or {}
    stop, handling = ({**polishes, **definition}.get(key) for key in ("stop", "handling"))
    if (stop or {}).get("time_limit_s") is not None:
        raise InputError("it ended by the clock or could have")
    name = resolve_code(stored.name, "problem", "the run")
    task = Task(
        problem=ProblemSpec(name=name, options=stored.options, values=stored.parameters, label=record.problem),
        solver=solver,
        settings=definition["settings"],
        handling=decode(Handling, handling) if handling else Handling(),
        stop=decode(Stop, stop) if stop else Stop(),
        seed=record.seed - record.run if record.seed >= record.run else record.seed,
        run=record.run if record.seed >= record.run else 0,
        label=record.solver,
        polishes=polishes.get("solver", ""),
        start=definition.get("start") or {},
    )
    own, wanted = task.definition(), dict((known or record).definition)
    if polishes:  # its key is of the search, whose record is compared
        wanted["polishes"] = {key: value for key, value in polishes.items() if key != "key"}
    if hash_definition(own) != hash_definition(wanted):
        raise InputError(f"it has another definition here: {describe_differences(wanted, own)}")
    return task


def compare_runs(record: RunRecord, task: Task, records: Sequence[RunRecord]) -> str:
    """Repeat a run; return the first difference in words, or an empty text if everything but the times is equal."""
    start = None
    if task.polishes:
        key = (record.problem, task.polishes, record.run)
        start = next((r for r in records if (r.problem, r.solver, r.run) == key), None)
        if start is None:
            return f"run {record.run} of {task.polishes}, which it polishes, is missing"
    again = try_task(task, start)
    names = (
        "status",
        "x",
        "evaluations",
        "history",
        "failed_evaluations",
        "iterations",
        "claimed_objective",
        "verdict",
    )
    for what in names:
        before, now = (getattr(of, what) for of in (record, again))
        if before != now and repr(before) != repr(now):  # NaN differs from itself
            return f"its {what.replace('_', ' ')} differs: recorded {before!r:.100}, found {now!r:.100}"
    return ""
