"""Records are evidence: their numbers must follow from their points, histories and seeds, and none may contradict a proof.

Every point is evaluated again by the exact functions, all points of a problem at once.
"""

import itertools
import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np

from compare.judge import evaluate
from compare.study.definition import select_shared
from compare.study.record import RunRecord, Verdict, hash_installed_code, load_problem
from compare.study.record_files import read_each
from compare.study.references import SAME_VALUE, find_reference
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.identity import describe_difference, hash_json, identify_problem
from nlp_gait.backends.kernel.compiled import compile_objective
from nlp_gait.errors import GaitError, InputError
from nlp_gait.formulation import Array, GaitProblem, Objective
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE

# Up to this many points of a problem are evaluated by CasADi, a third of a millisecond each; more by the compiled objective.
MOST_INTERPRETED = 1000
# A total violation of up to 1e-6 may improve the objective by up to this much, relatively.
SLACK = 1e-4


class Exclusion(NamedTuple):
    """A record that is no evidence, and why."""

    name: str  #: problem, solver and run, or the file
    reasons: tuple[str, ...]
    record: RunRecord | None = None  #: None for a file that cannot be read

    @property
    def sentence(self) -> str:
        """Name and reasons."""
        return f"{self.name}: {'; '.join(self.reasons)}"


Scope = Literal["none", "best", "all"]


class CheckedRecords(NamedTuple):
    """Records that passed all checks, and the others."""

    records: list[RunRecord]
    excluded: list[Exclusion]

    @property
    def sentences(self) -> list[str]:
        """Names and reasons of the excluded ones."""
        return [exclusion.sentence for exclusion in self.excluded]


def check_records(
    records: Sequence[RunRecord],
    *,
    find_problem: Callable[[RunRecord], GaitProblem] | None = None,
    between_samples: Scope = "best",
) -> CheckedRecords:
    """Check records against their points, proofs, each other and the code that made them.

    Args:
        records: in any order, each once.
        find_problem: returns the problem of a record; by default it is loaded by name, and the command must name user code.
        between_samples: for which runs the verdict between the samples is repeated, a tenth of a second each: for the best one of
            every solver, all or none.
    """
    reasons: Reasons = [[] for _ in records]
    for group in group_by(records, lambda r: hash_json(r.definition["problem"])):
        own, wrong = [records[k] for k in group], [reasons[k] for k in group]
        try:
            problem = (find_problem or load_problem)(own[0])
        except (GaitError, ValueError) as error:
            for why in wrong:
                why.append(f"its problem cannot be evaluated: {error}")
            continue
        _check_points(problem, own, wrong)
        _check_bound(problem.objective, own, wrong)
        _check_between_samples(problem, own, wrong, between_samples)
    for record, why in zip(records, reasons, strict=True):
        why += check_history(record)
        why += check_claims(record)
    find_copies(records, reasons)
    check_code(records, reasons)
    evidence = CheckedRecords([], [])
    for record, why in zip(records, reasons, strict=True):
        if why:
            evidence.excluded.append(Exclusion(name_record(record), tuple(why), record))
        else:
            evidence.records.append(record)
    return evidence


def read_evidence(
    folder: Path, between_samples: Scope = "best", find_problem: Callable[[RunRecord], GaitProblem] | None = None
) -> CheckedRecords:
    """Read and check all records of a folder, those of other definitions last.

    Raises:
        InputError: there are no records, or none of them can be used.
    """
    found = read_each(folder)
    readable = [record for _, record in found if isinstance(record, RunRecord)]
    evidence = check_records(readable, find_problem=find_problem, between_samples=between_samples)
    damaged = [(path, error) for path, error in found if isinstance(error, InputError)]
    evidence.excluded[:0] = [Exclusion(path.relative_to(folder).as_posix(), (str(error),)) for path, error in damaged]
    if not evidence.records:
        sentences = "; ".join(evidence.sentences)
        raise InputError(f"none of the {len(found)} records in {str(folder)!r} can be used: {sentences}")
    return evidence


def name_record(record: RunRecord) -> str:
    """Return problem, solver and run, for messages."""
    return f"{record.problem}, {record.solver}, run {record.run}"


def _check_points(problem: GaitProblem, records: Sequence[RunRecord], reasons: "Reasons") -> None:
    """Compare objective, violation, feasibility and indexes with the exact functions at x."""
    identity, described = identify_problem(problem), asdict(problem.objective)
    points: dict[int, Array] = {}
    for k, (record, why) in enumerate(zip(records, reasons, strict=True)):
        if difference := describe_difference(record.definition["problem"], identity):
            why.append(f"its problem has changed since: {difference}")
        if record.definition["objective"] != described:
            why.append(f"its objective is {record.definition['objective']}, that of the problem {described}")
        if not record.x:
            why += _check_failed(record)
            continue
        try:
            points[k] = problem.check_x(record.x)
        except (GaitError, ValueError) as error:
            why.append(f"its point does not belong to the problem: {error}")
    if len(points) > MOST_INTERPRETED:
        costs, violations = compile_objective(problem)(np.array(list(points.values())))
        for k, cost, violation in zip(list(points), costs.tolist(), violations.tolist(), strict=True):
            if not any(_compare_verdict(records[k].verdict, problem.objective.sign * cost, violation)):
                del points[k]  # what remains is decided by the interpreted functions
    for k, x in points.items():
        exact = build_exact_model(problem).at(x, problem.p)
        objective = problem.objective.sign * exact.cost
        reasons[k] += _compare_verdict(records[k].verdict, objective, exact.violation, exact.indexes)


def _compare_verdict(
    verdict: Verdict, objective: float, violation: float, indexes: Mapping[str, float] | None = None
) -> Iterator[str]:
    if not is_same(verdict.objective, objective):
        yield f"its objective is {verdict.objective:.9g}, but that of its x is {objective:.9g}"
    violation = math.inf if math.isnan(violation) else violation
    if not is_same(verdict.violation, violation, 1.0):
        yield f"its violation is {verdict.violation:.3g}, but that of its x is {violation:.3g}"
    if verdict.feasible != (verdict.violation <= FEASIBILITY_TOLERANCE):
        yield f"it is called {'feasible' if verdict.feasible else 'infeasible'} with a violation of {verdict.violation:.3g}"
    if indexes is not None and verdict.indexes:
        if verdict.indexes.keys() != indexes.keys():
            yield "its indexes have other names than those of the problem"
        for name in verdict.indexes.keys() & indexes.keys():
            if not is_same(verdict.indexes[name], indexes[name], 1.0):
                yield f"its index {name} is {verdict.indexes[name]:.9g}, but that of its x is {indexes[name]:.9g}"


def _check_failed(record: RunRecord) -> Iterator[str]:
    verdict = record.verdict
    if verdict.feasible or math.isfinite(verdict.objective) or verdict.indexes or verdict.dense or verdict.guaranteed:
        yield "it has a verdict, but no point"


def _check_bound(objective: Objective, records: Sequence[RunRecord], reasons: "Reasons") -> None:
    """Find feasible objectives that no feasible point can have."""
    bound = find_reference(records[0].definition["problem"]).bound
    if bound is None:
        return
    for record, why in zip(records, reasons, strict=True):
        verdict = record.verdict
        slack = SAME_VALUE if verdict.violation == 0.0 else SLACK
        if verdict.feasible and objective.sign * (bound - verdict.objective) > slack * abs(bound):
            why.append(f"its objective {verdict.objective:.9g} is better than the proven bound {bound:.9g}")


def _check_between_samples(
    problem: GaitProblem, records: Sequence[RunRecord], reasons: "Reasons", scope: Scope
) -> None:
    """Judge points again as a run does, with the dense grid and the guarantee: all, or the best one of every solver."""
    chosen = list(range(len(records))) if scope == "all" else []
    if scope == "best":
        cost = [problem.objective.sign * r.verdict.objective if r.verdict.feasible else math.inf for r in records]
        chosen = [min(own, key=lambda k: cost[k]) for own in group_by(records, lambda r: r.solver)]
        chosen = [k for k in chosen if math.isfinite(cost[k])]
    for k in chosen:
        if reasons[k] or not records[k].x:
            continue
        known, found = records[k].verdict, Verdict.from_evaluation(evaluate(problem, problem.check_x(records[k].x)))
        if known.dense_feasible != found.dense_feasible or not _are_same(known.dense, found.dense):
            reasons[k].append("its verdict on the dense grid does not follow from its x")
        if _describe_guarantee(known) != _describe_guarantee(found):
            reasons[k].append(
                f"guaranteed between the samples: recorded {_describe_guarantee(known)}, found {_describe_guarantee(found)}"
            )


def _are_same(a: Mapping[str, float] | None, b: Mapping[str, float] | None) -> bool:
    if a is None or b is None:
        return a is b
    return a.keys() == b.keys() and all(is_same(a[name], b[name], 1.0) for name in a)


def _describe_guarantee(verdict: Verdict) -> str:
    return "nothing" if verdict.guaranteed is None else verdict.guaranteed.word


Reasons = list[list[str]]
"""What is wrong with each record."""

# Relative difference of the last value of a history from the judged one: exact for searches, lifted for NLP solvers, and rounded
# for imported runs.
END_OF_SEARCH, END_OF_SOLVER, END_OF_IMPORT = 1e-9, 1e-5, 1e-3
# Reason by which every search ends whose budget is used, see ``metaheuristics.minimize``.
BUDGET_USED = "evaluation budget used"
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
    counts = history.evaluations
    if is_search and any(a >= b for a, b in itertools.pairwise((0, *counts))):
        yield "its history has two entries at the same number of evaluations"
    if is_search and len(counts) > record.iterations:
        yield f"its history has {len(counts)} entries, more than its {record.iterations} iterations"
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
    if is_search and budget is not None and (f == budget) != (BUDGET_USED in record.status.split("; ")):
        yield f"it counts {f} of {budget} evaluations, but ended by: {record.status}"
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
