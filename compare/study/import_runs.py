"""Results from elsewhere as records of a study: judged like all others; unknown values stay unknown."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np

from compare.judge import evaluate
from compare.study.record import History, RunRecord, Times, describe_evaluation, list_versions
from compare.study.references import SAME_VALUE, find_reference
from compare.study.run import LABEL, Inputs, ProblemSpec
from compare.study.study import read_records, read_study_file
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.identity import describe_difference, hash_json, identify_problem
from nlp_gait.columns import CsvTable, read_table
from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, GaitProblem

# Table next to the variables.
FINALS = ("run", "seed", "objective", "violation", "evaluations", "time_s")
HISTORY = ("run", "evaluations", "objective")
MOST_POINTS = 100_000
ROUNDED = 1e-3  # relative difference of a history's end from the judged value that printed digits explain
SAMPLES = 100  # random points and corners among those that round to printed digits
FEW_DIGITS = 10  # of a printed number; more are exact for all that is judged
# Least values of those that are numbers, not counts.
LEAST = {"objective": -math.inf, "violation": 0.0, "time_s": 0.0}


def read_points(path: Path, problem: GaitProblem, others: Sequence[str] = ()) -> tuple[CsvTable, Array]:
    """Read points (m, n) from CSV: columns by the variables' names and some others, or without a header as in x.

    Raises:
        InputError: the file cannot be read, or a row is not a point.
        UnknownNameError: an unknown column.
    """
    table = read_table(path, "points")
    if table.header:
        table.check_header(problem.names, others)
        order = [table.header.index(name) for name in problem.names]
    elif table.width == len(problem.names):
        order = list(range(table.width))
    else:
        raise InputError(
            f"{table.owner} has {table.width} columns and no header; {problem.name} has {len(problem.names)} variables: "
            f"{', '.join(problem.names)}"
        )
    if len(table.rows) > MOST_POINTS:
        raise InputError(
            f"{table.owner} has {len(table.rows)} rows; at most {MOST_POINTS} are read at once: split the file"
        )
    points = np.array(table.rows, dtype=float)[:, order]
    for line, x in zip(table.lines, points, strict=True):
        if not np.isfinite(x).all():
            name = problem.names[int(np.flatnonzero(~np.isfinite(x))[0])]
            raise InputError(f"{table.owner}, line {line}: {name} must be a finite number")
    return table, points


def import_runs(
    spec: ProblemSpec,
    finals: Path,
    label: str,
    histories: Path | None = None,
    evaluations: int | None = None,
    progress: Callable[[int, int], None] = lambda done, total: None,
) -> list[RunRecord]:
    """Return a record for each row of a file of final points; raises InputError for unreadable files and impossible values.

    Args:
        spec: the problem.
        finals: one row for each run: the variables and, where known, ``FINALS``, with objective and violation as reported.
        label: of the solver in the study.
        histories: best so far: ``HISTORY``, objective empty before the first feasible point, and optionally ``time_s``.
        evaluations: of every run, if neither file has them; None if they are unknown: such runs have no history.
        progress: called with the number of rows that were evaluated and of all.
    """
    if not LABEL.fullmatch(label):
        raise InputError(f"--as takes letters, digits, spaces and . _ + : ( ) -, 64 at most, got {label!r}")
    problem = spec.load()
    table, points = read_points(finals, problem, FINALS)
    order = [table.header.index(name) for name in problem.names] if table.header else list(range(table.width))
    given = {name: None if name in problem.names else table.column(name) for name in FINALS}
    runs = [table.count("run", k, v) for k, v in enumerate(given["run"] or range(len(points)))]
    if len(set(runs)) < len(runs):
        raise InputError(f"{table.owner}: a run is duplicated")
    stored = {} if histories is None else _read_histories(histories, runs)
    identity = identify_problem(problem)
    bound = find_reference(identity).bound
    records = []
    for k, (run, x) in enumerate(zip(runs, points, strict=True)):
        row = {name: math.nan if column is None else column[k] for name, column in given.items()}
        x, note = _choose_point(problem, x, [table.texts[k][place] for place in order])
        judged = describe_evaluation(evaluate(problem, x, prove=False))
        for name, least in LEAST.items():
            table.number(name, k, row[name], least)
        history, seconds = stored.get(run) or _make_history(table, k, row, judged, evaluations)
        history, seconds, cut = _cut_history(problem.objective.sign, history, seconds, judged, bound)
        solve = (time for time in (row["time_s"], *seconds[-1:]) if not math.isnan(time))
        reported = None if math.isnan(row["objective"]) else row["objective"]
        seed = run if math.isnan(row["seed"]) else table.count("seed", k, row["seed"])
        content = [x.tolist(), {name: repr(value) for name, value in row.items()}, asdict(history), repr(seconds)]
        records.append(
            RunRecord(
                problem=spec.title,
                solver=label,
                run=run,
                inputs=Inputs(
                    problem=identity,
                    objective=problem.objective,
                    solver=label,
                    seed=seed,
                    imported=hash_json(content),
                ),
                settings={"kind": "imported", "file": finals.name},
                status=f"imported from {finals.name}{note}{cut}",
                reported_feasible=reported is not None and not row["violation"] > 0.0,
                x=problem.by_name(x),
                reported_objective=reported,
                **judged,
                counts={"f": history.evaluations[-1]} if history.evaluations else {},
                history=history,
                time_s=Times(solve=next(solve, math.nan), history=seconds),
                versions=list_versions(),
            )
        )
        progress(k + 1, len(points))
    return records


def _choose_point(problem: GaitProblem, x: Array, printed: Sequence[str]) -> tuple[Array, str]:
    """Return a point, or if it is infeasible a feasible one that rounds to its printed digits, and a note on that."""
    near = None if build_exact_model(problem).at(x, problem.p).feasible else find_feasible(problem, printed)
    return (x, "") if near is None else (near, "; judged at a feasible point that rounds to its printed digits")


def find_feasible(problem: GaitProblem, printed: Sequence[str]) -> Array | None:
    """Return the point (n,) nearest to the printed one that rounds to it and is feasible; None if no point that is tried is.

    All numbers have as many significant digits as the longest one: programs leave zeros at the end out. Points with more than
    ``FEW_DIGITS`` digits stand for themselves.
    """
    x, model = np.array([float(text) for text in printed]), build_exact_model(problem)
    digits = max(len(Decimal(text.strip()).as_tuple().digits) for text in printed)
    if digits > FEW_DIGITS:
        return None
    half = 0.5 * 10.0 ** (np.floor(np.log10(np.maximum(np.abs(x), np.finfo(float).tiny))) + 1 - digits)
    box = np.stack([x - half, x + half], axis=-1)
    rng = np.random.default_rng(0)
    places = np.concatenate([rng.uniform(size=(SAMPLES, len(x))), rng.integers(2, size=(SAMPLES, len(x)))])
    points = np.clip(box[:, 0] + places * np.diff(box)[:, 0], problem.lower, problem.upper)
    distances = np.abs((points - x) / np.diff(box)[:, 0]).max(axis=1)
    for point in points[np.argsort(distances)]:
        if ((box[:, 0] <= point) & (point <= box[:, 1])).all() and model.at(point, problem.p).feasible:
            return point
    return None


def _make_history(
    table: CsvTable, k: int, row: Mapping[str, float], judged: Mapping[str, Any], evaluations: int | None
) -> tuple[History, tuple[float, ...]]:
    """Return the end of a run alone as its history and its time; empty if the number of evaluations is unknown."""
    count = row["evaluations"]
    if math.isnan(count):
        if evaluations is None:
            return History(), ()
        count = evaluations
    end = judged["objective"] if judged["feasible"] else None
    return History(evaluations=(table.count("evaluations", k, count, 1),), objective=(end,)), (row["time_s"],)


def _cut_history(
    sign: float, history: History, seconds: tuple[float, ...], judged: Mapping[str, Any], bound: float | None
) -> tuple[History, tuple[float, ...], str]:
    """Return a history without values that its run cannot have had, and a sentence about them.

    No value may be better than the run's judged end, beyond the digits of imported files, or than a proven bound.
    """
    end = judged["objective"] if judged["feasible"] else math.nan
    best = sign * end - ROUNDED * abs(end) if judged["feasible"] else math.inf
    least = best if bound is None else max(best, sign * bound - SAME_VALUE * abs(bound))
    wrong = [k for k, value in enumerate(history.objective) if value is not None and sign * value < least]
    if not wrong:
        return history, seconds, ""
    kept = [k for k in range(len(history.objective)) if k not in set(wrong)]
    cut = History(
        evaluations=tuple(history.evaluations[k] for k in kept), objective=tuple(history.objective[k] for k in kept)
    )
    count, why = (
        len(wrong),
        "better than its point, or than the proven bound" if judged["feasible"] else "of no feasible point",
    )
    last = (history.evaluations[-1], end if judged["feasible"] else None)
    if kept[-1:] != [len(history.objective) - 1]:  # its length stays, and its end is the judged one
        cut = History(evaluations=(*cut.evaluations, last[0]), objective=(*cut.objective, last[1]))
        kept.append(len(history.objective) - 1)
    return cut, tuple(seconds[k] for k in kept), f"; {count} value{'s' * (count > 1)} of its history left out: {why}"


def _read_histories(path: Path, runs: Sequence[int]) -> dict[int, tuple[History, tuple[float, ...]]]:
    table = read_table(path, "history")
    table.check_header(HISTORY, ("time_s",))
    columns = [table.column(name) or () for name in HISTORY]
    seconds = table.column("time_s") or (math.nan,) * len(table.rows)
    entries_by_run: dict[int, list[tuple[int, float | None, float]]] = {}
    for k, (run, count, value, time) in enumerate(zip(*columns, seconds, strict=True)):
        entries = entries_by_run.setdefault(table.count("run", k, run), [])
        evaluations = table.count("evaluations", k, count, 1)
        if entries and evaluations < entries[-1][0]:
            raise InputError(f"{table.owner}, line {table.lines[k]}: evaluations of run {run:g} must ascend")
        table.number("objective", k, value)
        least = entries[-1][2] if entries and not math.isnan(entries[-1][2]) else 0.0
        table.number("time_s", k, time, least)
        entries.append((evaluations, None if math.isnan(value) else value, time))
    for run in entries_by_run:
        if run not in runs:
            raise InputError(f"{table.owner}: run {run} has no final point")
    missing = [run for run in runs if run not in entries_by_run]
    if missing:
        raise InputError(f"{table.owner}: run {missing[0]} has no history")
    courses = {run: zip(*entries, strict=True) for run, entries in entries_by_run.items()}
    return {run: (History(evaluations=counts, objective=f), times) for run, (counts, f, times) in courses.items()}


def read_imported_records(folder: Path, records: Sequence[RunRecord]) -> list[RunRecord]:
    """Return the imported records in a folder whose problems are those of some records."""
    problems = {record.problem: record.inputs.problem for record in records}
    return [
        record
        for record in (read_records(folder)[0] if read_study_file(folder).runs else ())
        if record.inputs.imported
        and record.problem in problems
        and not describe_difference(record.inputs.problem, problems[record.problem])
    ]
