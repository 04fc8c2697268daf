"""Results from elsewhere as records of a study: judged like all others; unknown values stay unknown."""

import math
from collections.abc import Callable, Mapping, Sequence
from decimal import Decimal
from pathlib import Path
from typing import Any

import numpy as np

from compare.judge import evaluate
from compare.study.record import History, RunRecord, Times, describe_evaluation, list_versions
from compare.study.references import SAME_VALUE, find_reference
from compare.study.run import LABEL, Inputs, ProblemSpec
from compare.study.study import read_records, read_study_file
from nlp_gait.backends.exact import build_exact_model, describe_difference, hash_json, identify_problem
from nlp_gait.columns import CsvTable, read_table
from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, GaitProblem

# Table next to the variables.
FINALS = ("run", "seed", "objective", "violation", "evaluations", "time_s")
HISTORY = ("run", "evaluations", "objective")
ROUNDED = 1e-3  # relative difference of a history's end from the judged value that printed digits explain
SAMPLES = 100  # random points and corners among those that round to printed digits
FEW_DIGITS = 10  # of a printed number; more are exact for all that is judged
Entry = tuple[int, float | None, float]
"""Evaluations, best objective and seconds so far."""
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
    courses = {} if histories is None else _read_histories(histories, runs)
    identity = identify_problem(problem)
    bound = find_reference(identity).bound
    records = []
    for k, (run, x) in enumerate(zip(runs, points, strict=True)):
        row = {name: math.nan if column is None else column[k] for name, column in given.items()}
        note, judged = "", describe_evaluation(evaluate(problem, x, prove=False))
        near = None if judged["feasible"] else find_feasible(problem, [table.texts[k][place] for place in order])
        if near is not None:
            note = "; judged at a feasible point that rounds to its printed digits"
            x, judged = near, describe_evaluation(evaluate(problem, near, prove=False))
        for name, least in LEAST.items():
            table.number(name, k, row[name], least)
        course = courses.get(run, [])
        count = evaluations if math.isnan(row["evaluations"]) else table.count("evaluations", k, row["evaluations"], 1)
        if not course and count is not None:  # the end of the run alone
            course = [(count, judged["objective"] if judged["feasible"] else None, row["time_s"])]
        course, cut = _cut_course(problem.objective.sign, course, judged, bound)
        counts, objectives, seconds = zip(*course, strict=True) if course else ((), (), ())
        history = History(evaluations=counts, objective=objectives)
        solve = (time for time in (row["time_s"], *seconds[-1:]) if not math.isnan(time))
        reported = None if math.isnan(row["objective"]) else row["objective"]
        seed = run if math.isnan(row["seed"]) else table.count("seed", k, row["seed"])
        content = [x.tolist(), {name: repr(value) for name, value in row.items()}, repr(course)]
        inputs = Inputs(
            problem=identity, objective=problem.objective, solver=label, seed=seed, imported=hash_json(content)
        )
        records.append(
            RunRecord(
                problem=spec.title,
                solver=label,
                run=run,
                inputs=inputs,
                settings={"kind": "imported", "file": finals.name},
                status=f"imported from {finals.name}{note}{cut}",
                reported_feasible=reported is not None and not row["violation"] > 0.0,
                x=problem.by_name(x),
                reported_objective=reported,
                **judged,
                counts={"f": counts[-1]} if counts else {},
                history=history,
                time_s=Times(solve=next(solve, math.nan), history=seconds),
                versions=list_versions(),
            )
        )
        progress(k + 1, len(points))
    return records


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


def _cut_course(
    sign: float, course: list[Entry], judged: Mapping[str, Any], bound: float | None
) -> tuple[list[Entry], str]:
    """Return a course without values that its run cannot have had, and a sentence about them.

    No value may be better than the run's judged end, beyond the digits of imported files, or than a proven bound.
    """
    end = judged["objective"] if judged["feasible"] else None
    least = math.inf if end is None else sign * end - ROUNDED * abs(end)
    if bound is not None:
        least = max(least, sign * bound - SAME_VALUE * abs(bound))
    kept = [entry for entry in course if entry[1] is None or sign * entry[1] >= least]
    if not (count := len(course) - len(kept)):
        return course, ""
    if kept[-1:] != course[-1:]:  # its length stays, and its end is the judged one
        kept.append((course[-1][0], end, course[-1][2]))
    why = "of no feasible point" if end is None else "better than its point, or than the proven bound"
    return kept, f"; {count} value{'s' * (count > 1)} of its history left out: {why}"


def _read_histories(path: Path, runs: Sequence[int]) -> dict[int, list[Entry]]:
    table = read_table(path, "history")
    table.check_header(HISTORY, ("time_s",))
    columns = [table.column(name) or () for name in HISTORY]
    seconds = table.column("time_s") or (math.nan,) * len(table.rows)
    courses: dict[int, list[Entry]] = {}
    for k, (run, count, value, time) in enumerate(zip(*columns, seconds, strict=True)):
        course = courses.setdefault(table.count("run", k, run), [])
        evaluations = table.count("evaluations", k, count, 1)
        if course and evaluations < course[-1][0]:
            raise InputError(f"{table.owner}, line {table.lines[k]}: evaluations of run {run:g} must ascend")
        table.number("objective", k, value)
        least = course[-1][2] if course and not math.isnan(course[-1][2]) else 0.0
        table.number("time_s", k, time, least)
        course.append((evaluations, None if math.isnan(value) else value, time))
    for run in courses.keys() ^ set(runs):
        raise InputError(f"{table.owner}: run {run} has no {'final point' if run in courses else 'history'}")
    return courses


def read_imported_records(folder: Path, records: Sequence[RunRecord]) -> list[RunRecord]:
    """Return the imported records in a folder whose problems are those of some records."""
    problems = {record.problem: record.inputs.problem for record in records}
    stored = read_records(folder)[0] if read_study_file(folder).runs else []
    return [
        record
        for record in stored
        if record.inputs.imported
        and record.problem in problems
        and not describe_difference(record.inputs.problem, problems[record.problem])
    ]
