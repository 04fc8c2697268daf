"""Whether a record agrees with itself, with the other records of its study and with the code; no point is evaluated."""

from __future__ import annotations

import itertools
import math
from collections import Counter
from collections.abc import Callable, Iterator, Sequence

from compare.study.definition import select_shared
from compare.study.origin import hash_installed_code
from compare.study.record import RunRecord
from compare.study.references import SAME_VALUE
from nlp_gait.backends.identity import hash_json

Reasons = list[list[str]]
"""What is wrong with each record."""

# Relative difference of the last value of a history from the judged one: exact for searches, lifted for NLP solvers, and rounded
# for imported runs.
END_OF_SEARCH, END_OF_SOLVER, END_OF_IMPORT = 1e-9, 1e-5, 1e-3
# Histories with at least this many different values are never equal by chance.
TELLING = 3


def group_by(records: Sequence[RunRecord], key: Callable[[RunRecord], object]) -> list[list[int]]:
    """Return the positions of records with equal keys."""
    found: dict[object, list[int]] = {}
    for k, record in enumerate(records):
        found.setdefault(key(record), []).append(k)
    return list(found.values())


def is_same(a: float, b: float, scale: float = 0.0) -> bool:
    """Return whether two numbers agree to nine digits; numbers that are not finite agree with their kind."""
    if not (math.isfinite(a) and math.isfinite(b)):
        return a == b or (math.isnan(a) and not math.isfinite(b)) or (math.isnan(b) and not math.isfinite(a))
    return abs(a - b) <= SAME_VALUE * max(abs(a), abs(b), scale)


def check_history(record: RunRecord) -> Iterator[str]:
    """Check that the best so far never worsens and ends at the judged value, and that times ascend."""
    history, definition, times = record.history, record.definition, record.time_s
    is_search = "handling" in definition
    known = [value for value in history.objective if value is not None]
    if any(not math.isfinite(value) for value in known):
        yield "its history has a value that is not finite"
    sign = 1.0 if definition["objective"]["sense"] == "minimise" else -1.0
    if is_search and any(sign * (b - a) > 0.0 for a, b in itertools.pairwise(known)):
        yield "the best value of its history worsens"
    if is_search and None in history.objective[len(history.objective) - len(known) :]:
        yield "its history loses a feasible point"
    if is_search and record.claimed != bool(known):
        yield "its claim and its history disagree on whether a feasible point was found"
    last = history.objective[-1] if history.objective else None
    if last is not None:
        judged = record.verdict.objective
        tolerance = END_OF_SEARCH if is_search else END_OF_IMPORT if "imported" in definition else END_OF_SOLVER
        if not abs(last - judged) <= tolerance * max(abs(last), abs(judged)):
            yield f"its history ends at {last:.9g}, but the judge finds {judged:.9g}"
    if any(a > b for a, b in itertools.pairwise((0.0, *times.history))):
        yield "the times of its history do not ascend from 0"
    if any(value < 0.0 for value in (times.build, times.compile, times.solve, times.objective)):
        yield "it has a negative time"
    if times.history and times.history[-1] > times.solve * (1.0 + SAME_VALUE):
        yield "its history is longer than its run"


def check_claims(record: RunRecord) -> Iterator[str]:
    """Check claims and counts, which a run derives from the same functions as the judge; imported claims are anything."""
    definition, verdict = record.definition, record.verdict
    if "imported" in definition:
        return
    f = record.evaluations["f"]
    claim, is_search = record.claimed_objective, "handling" in definition
    if claim is not None and not is_same(claim, verdict.objective):
        yield f"it claims {claim:.9g}, but the judge finds {verdict.objective:.9g}"
    if is_search and record.claimed_violation is not None:
        if not is_same(record.claimed_violation, verdict.violation, 1.0):
            yield f"it claims a violation of {record.claimed_violation:.3g}, but the judge finds {verdict.violation:.3g}"
        if record.claimed != (record.claimed_violation == 0.0):
            yield "it claims a feasible point with a violation, or none without"
    budget = (definition.get("stop") or {}).get("evaluations")
    if is_search and budget is not None and f > budget:
        yield f"it counts {f} evaluations, more than its budget of {budget}"
    counted = record.history.evaluations[-1] if record.history.evaluations else f
    if counted > f or (is_search and counted != f):
        yield f"its history ends after {counted} evaluations, but it counts {f}"
    if max(record.failed_evaluations, record.iterations if is_search else 0) > f:
        yield f"it counts more failed evaluations or iterations than its {f} evaluations"


def find_copies(records: Sequence[RunRecord], reasons: Reasons) -> None:
    """Find runs that count twice: with the seed, all times or the whole history of an earlier run of the same problem."""
    order = sorted(range(len(records)), key=lambda k: records[k].run)
    seen: dict[object, RunRecord] = {}
    for k in order:
        record, why = records[k], reasons[k]
        solver = record.problem, record.solver, hash_json(select_shared(record.definition))
        first = seen.setdefault(("seed", *solver, record.seed), record)
        if first is not record:
            why.append(f"its seed {record.seed} repeats that of run {first.run}")
        if "imported" in record.definition:
            continue
        marks: list[object] = [("settings", *solver)]
        if record.time_s.solve > 0.0:
            marks.append(("times", record.problem, record.time_s.solve, *record.time_s.history))
        if "handling" in record.definition and len(set(record.history.objective)) >= TELLING:
            marks.append(("history", *solver, *record.history.objective, *record.history.evaluations))
        for mark in marks:
            first = seen.setdefault(mark, record)
            if first is record:
                continue
            if mark is not marks[0]:
                why.append(f"it is a copy of {first.solver}, run {first.run}, with all its times or its whole history")
            elif "handling" in record.definition and record.x and first.x and record.settings != first.settings:
                why.append(f"its settings are not those of run {first.run}")


def check_code(records: Sequence[RunRecord], reasons: Reasons) -> None:
    """Find runs of other code than the installed one, or, if no record is of that, than most records."""
    found = Counter((r.origin.code_sha256, r.origin.casadi) for r in records if r.origin is not None)
    own = [key for key in found if key[0] == hash_installed_code()]
    usual = max(own or found, key=lambda key: found[key], default=("", ""))
    for record, why in zip(records, reasons, strict=True):
        if record.origin is None and "imported" not in record.definition:
            why.append("it does not say which code computed it")
        elif record.origin is not None and (record.origin.code_sha256, record.origin.casadi) != usual:
            why.append(
                f"it was computed by other code ({record.origin.code}) than the others ({usual[0][:8]}, CasADi {usual[1]})"
            )
