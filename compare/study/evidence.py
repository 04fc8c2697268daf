"""Records are evidence: their numbers must follow from their points, histories and seeds, and none may contradict a proof.

Every point is evaluated again by the exact functions, all points of a problem at once.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from typing import Literal, NamedTuple

import numpy as np

from compare.judge import evaluate
from compare.study.consistency import Reasons, check_claims, check_code, check_history, find_copies, group_by, is_same
from compare.study.origin import Origin
from compare.study.record import RunRecord, Verdict, load_problem
from compare.study.record_files import read_each
from compare.study.references import SAME_VALUE, find_reference
from nlp_gait.backends.exact import build_exact_model
from nlp_gait.backends.identity import HASH, hash_json, identify_problem
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


class Evidence(NamedTuple):
    """Records that passed all checks, and the others."""

    records: list[RunRecord]
    excluded: list[Exclusion]


def check_records(
    records: Sequence[RunRecord],
    *,
    find_problem: Callable[[RunRecord], GaitProblem] | None = None,
    between_samples: Scope = "best",
) -> Evidence:
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
    evidence = Evidence([], [])
    for record, why in zip(records, reasons, strict=True):
        if why:
            evidence.excluded.append(Exclusion(name_record(record), tuple(why), record))
        else:
            evidence.records.append(record)
    return evidence


def read_evidence(
    folder: Path, between_samples: Scope = "best", find_problem: Callable[[RunRecord], GaitProblem] | None = None
) -> Evidence:
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
        sentences = "; ".join(exclusion.sentence for exclusion in evidence.excluded)
        raise InputError(f"none of the {len(found)} records in {str(folder)!r} can be used: {sentences}")
    return evidence


def name_record(record: RunRecord) -> str:
    """Return problem, solver and run, for messages."""
    return f"{record.problem}, {record.solver}, run {record.run}"


def _check_points(problem: GaitProblem, records: Sequence[RunRecord], reasons: Reasons) -> None:
    """Compare objective, violation, feasibility and indexes with the exact functions at x."""
    identity, described, here = identify_problem(problem), asdict(problem.objective), Origin.make()
    points: dict[int, Array] = {}
    for k, (record, why) in enumerate(zip(records, reasons, strict=True)):
        known = record.definition["problem"].get(HASH)
        other_casadi = record.origin is not None and record.origin.casadi != here.casadi
        if known != identity[HASH] and not other_casadi:
            why.append("its problem has changed since: the hashes of the exact functions or values differ")
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


def _check_bound(objective: Objective, records: Sequence[RunRecord], reasons: Reasons) -> None:
    """Find feasible objectives that no feasible point can have."""
    bound = find_reference(records[0].definition["problem"]).bound
    if bound is None:
        return
    for record, why in zip(records, reasons, strict=True):
        verdict = record.verdict
        slack = SAME_VALUE if verdict.violation == 0.0 else SLACK
        if verdict.feasible and objective.sign * (bound - verdict.objective) > slack * abs(bound):
            why.append(f"its objective {verdict.objective:.9g} is better than the proven bound {bound:.9g}")


def _check_between_samples(problem: GaitProblem, records: Sequence[RunRecord], reasons: Reasons, scope: Scope) -> None:
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
