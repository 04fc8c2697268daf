"""Records are evidence: their numbers must follow from their points, histories and seeds, and none may contradict a proof.

Every point is evaluated again by the exact functions, all points of a problem at once.
"""

import math
from collections import Counter
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Literal, NamedTuple, TypeVar

from compare.judge import evaluate
from compare.study.origin import hash_installed_code
from compare.study.record import RunRecord, Verdict, group_by, load_problem
from compare.study.record_files import read_each
from compare.study.references import SAME_VALUE, find_reference
from nlp_gait.backends.exact import ExactValues, build_exact_model
from nlp_gait.backends.identity import describe_difference, hash_json, identify_problem
from nlp_gait.backends.solve import count_workers
from nlp_gait.errors import GaitError, InputError, UserCodeError
from nlp_gait.files import replace_nan
from nlp_gait.formulation import GaitProblem
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE
from nlp_gait.processes import run_in_forks
from nlp_gait.proofs.time_search import DECISIVE, MEAN_SHARPNESS

T = TypeVar("T")
R = TypeVar("R")

# A total violation of up to 1e-6 may improve the objective by up to this much, relatively.
SLACK = 1e-4
# Relative difference of the last value of a history from the judged one: exact for searches, lifted for NLP solvers, and rounded
# for imported runs.
END_OF_SEARCH, END_OF_SOLVER, END_OF_IMPORT = 1e-9, 1e-5, 1e-3


class Exclusion(NamedTuple):
    """A record that is no evidence, and why."""

    name: str  #: problem, solver and run, or the file
    reasons: tuple[str, ...]
    record: RunRecord | None = None  #: None for a file that cannot be read
    needs_code: bool = False  #: that the command does not name, so that nothing was evaluated

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


@dataclass(kw_only=True)
class CheckedRun:
    """A record, what it is compared with, and what is wrong with it."""

    record: RunRecord
    reasons: list[str] = field(default_factory=list)  #: why it is no evidence
    problem: GaitProblem | None = None  #: None if it cannot be loaded
    needs_code: bool = False  #: that the command does not name
    exact: ExactValues | None = None  #: at its x; None if not evaluated
    bound: float | None = None  #: proven: no feasible point has a better objective
    first: tuple[RunRecord, ...] = ()  #: with this label, with this solver, and with this seed of the solver
    code: tuple[str, str] | None = None  #: hash of the code, and version of CasADi, of most records


Check = Callable[[CheckedRun], str | None]
"""Returns what is wrong with a record; None if nothing is."""


def check_records(
    records: Sequence[RunRecord],
    *,
    find_problem: Callable[[RunRecord], GaitProblem] = load_problem,
    between_samples: Scope = "best",
) -> CheckedRecords:
    """Check records against their points, proofs, each other and the code that made them.

    Args:
        records: in any order, each once.
        find_problem: returns the problem of a record; by default it is loaded by name, and the command must name user code.
        between_samples: for which runs the verdict between the samples is repeated, a tenth of a second each: for the best one of
            every solver, all or none.
    """
    cases = _make_cases(records, find_problem)
    for case in cases:
        case.reasons += filter(None, (check(case) for check in CHECKS))
    chosen = _choose_cases(cases, between_samples)
    for case in {id(case.problem): case for case in chosen}.values():  # builds what the forks inherit
        check_between_samples(case)
    for case, reason in zip(chosen, compute_in_forks(check_between_samples, chosen), strict=True):
        case.reasons += filter(None, [reason])
    excluded = [Exclusion(name_record(c.record), tuple(c.reasons), c.record, c.needs_code) for c in cases if c.reasons]
    return CheckedRecords([case.record for case in cases if not case.reasons], excluded)


def read_evidence(
    folder: Path, between_samples: Scope = "best", find_problem: Callable[[RunRecord], GaitProblem] = load_problem
) -> CheckedRecords:
    """Read and check the records of a study.

    Raises:
        InputError: there are no records, or none of them can be used.
    """
    files = read_each(folder)
    readable = [record for _, record in files if isinstance(record, RunRecord)]
    evidence = check_records(readable, find_problem=find_problem, between_samples=between_samples)
    damaged = [(path, error) for path, error in files if isinstance(error, InputError)]
    evidence.excluded[:0] = [Exclusion(path.relative_to(folder).as_posix(), (str(error),)) for path, error in damaged]
    if not evidence.records:
        sentences = "; ".join(evidence.sentences)
        raise InputError(f"none of the {len(files)} records in {str(folder)!r} can be used: {sentences}")
    return evidence


def name_record(record: RunRecord) -> str:
    """Return problem, solver and run, for messages."""
    return f"{record.problem}, {record.solver}, run {record.run}"


def compute_in_forks(call: Callable[[T], R], items: Sequence[T]) -> Iterator[R]:
    """Return call(item) of each item in order, in forks where they pay."""
    workers = min(count_workers(), len(items) // 2)
    return run_in_forks(lambda k, _: call(items[k]), len(items), workers) if workers > 1 else map(call, items)


def is_same(a: float, b: float, scale: float = 0.0) -> bool:
    """Return whether two numbers agree to nine digits; numbers that are not finite agree with their kind."""
    if not (math.isfinite(a) and math.isfinite(b)):
        return a == b or (math.isnan(a) and not math.isfinite(b)) or (math.isnan(b) and not math.isfinite(a))
    return abs(a - b) <= SAME_VALUE * max(abs(a), abs(b), scale)


def _make_cases(records: Sequence[RunRecord], find_problem: Callable[[RunRecord], GaitProblem]) -> list[CheckedRun]:
    """Load each problem once, and evaluate all of its points."""
    cases = [CheckedRun(record=record) for record in records]
    for group in group_by(cases, lambda case: hash_json(case.record.inputs.problem)).values():
        _evaluate_points(group, find_problem)
    codes = Counter((r.inputs.code, r.origin.casadi) for r in records if r.origin is not None)
    installed = [code for code in codes if code[0] == hash_installed_code()]
    usual = max(installed or codes, key=lambda code: codes[code], default=None)
    first_records: dict[object, RunRecord] = {}
    for case in sorted(cases, key=lambda case: case.record.run):
        solver = case.record.problem, case.record.solver, case.record.inputs.solver_key
        marks = (solver[:2], solver, (*solver, case.record.seed))
        case.first = tuple(first_records.setdefault(mark, case.record) for mark in marks)
        case.code = usual
    return cases


def _evaluate_points(cases: Sequence[CheckedRun], find_problem: Callable[[RunRecord], GaitProblem]) -> None:
    """Fill in problem, bound and exact values of records with one problem, or the reasons why they cannot be evaluated."""
    stored = cases[0].record.inputs.problem
    try:
        problem = find_problem(cases[0].record)
        difference = describe_difference(stored, identify_problem(problem))
        bound = find_reference(stored).bound
    except (GaitError, ValueError) as error:
        for case in cases:
            case.needs_code = isinstance(error, UserCodeError)
            case.reasons.append(f"its problem cannot be evaluated: {error}")
        return
    model = build_exact_model(problem)
    for case in cases:
        case.problem, case.bound = problem, bound
        case.reasons += [f"its problem has changed since: {difference}"] if difference else []
        try:
            case.exact = model.at(problem.check_x(case.record.x), problem.p) if case.record.x else None
        except (GaitError, ValueError) as error:
            case.reasons.append(f"its point does not belong to the problem: {error}")


def _choose_cases(cases: Sequence[CheckedRun], scope: Scope) -> list[CheckedRun]:
    """Return the runs whose verdict between the samples is repeated."""
    evaluated = [case for case in cases if case.record.x and not case.reasons]
    if scope == "best":
        feasible = [case for case in evaluated if case.record.verdict.feasible]
        groups = group_by(feasible, lambda c: (hash_json(c.record.inputs.problem), c.record.solver))
        return [min(group, key=lambda case: case.record.cost) for group in groups.values()]
    return evaluated if scope == "all" else []


def check_objective(case: CheckedRun) -> str | None:
    """Compare the name, unit and sense of the objective with the problem's."""
    stated = case.record.inputs.objective
    if case.problem is not None and stated != case.problem.objective:
        return f"its objective is {stated}, that of the problem {case.problem.objective}"
    return None


def check_verdict(case: CheckedRun) -> str | None:
    """Compare the verdict with what is evaluated at x; a run without a point has none."""
    record, verdict, exact = case.record, case.record.verdict, case.exact
    if not record.x:
        return None if replace_nan(verdict) == replace_nan(Verdict()) else "it has a verdict, but no point"
    if exact is None:
        return None
    objective = record.inputs.objective.sign * exact.cost
    violation = math.inf if math.isnan(exact.violation) else exact.violation
    differences = [
        *_list_differences({"objective": verdict.objective}, {"objective": objective}, scale=0.0),
        *_list_differences({"violation": verdict.violation}, {"violation": violation}),
        *_list_differences(verdict.indexes, exact.indexes),
    ]
    if verdict.feasible != (verdict.violation <= FEASIBILITY_TOLERANCE):
        word = "feasible" if verdict.feasible else "infeasible"
        differences.append(f"it is called {word} with a violation of {verdict.violation:.3g}")
    return "; ".join(differences) or None


def check_bound(case: CheckedRun) -> str | None:
    """Find a feasible objective that no feasible point can have."""
    verdict, bound, sign = case.record.verdict, case.bound, case.record.inputs.objective.sign
    slack = SAME_VALUE if verdict.violation == 0.0 else SLACK
    if bound is None or not verdict.feasible or not sign * (bound - verdict.objective) > slack * abs(bound):
        return None
    return f"its objective {verdict.objective:.9g} is better than the proven bound {bound:.9g}"


def check_history(case: CheckedRun) -> str | None:
    """Check that the history ends at the judged value, and at the number of evaluations that the run counts."""
    inputs, history, judged = case.record.inputs, case.record.history, case.record.verdict.objective
    last = history.objective[-1] if history.objective else None
    tolerance = END_OF_SEARCH if inputs.is_search else END_OF_IMPORT if inputs.imported else END_OF_SOLVER
    if last is not None and not abs(last - judged) <= tolerance * max(abs(last), abs(judged)):
        return f"its history ends at {last:.9g}, but the judge finds {judged:.9g}"
    counted, budget = history.evaluations[-1] if history.evaluations else 0, inputs.stop.get("evaluations")
    f = case.record.evaluations.get("f", counted)
    if not inputs.imported and (counted > f or (inputs.is_search and history.evaluations and counted != f)):
        return f"its history ends after {counted} evaluations, but it counts {f}"
    if inputs.is_search and budget is not None and f > budget:
        return f"it counts {f} evaluations, more than its budget of {budget}"
    return None


def check_settings(case: CheckedRun) -> str | None:
    """Find a run whose settings are not those of the other runs of its name, or whose seed is that of another one."""
    record, (namesake, first, twin) = case.record, case.first
    if namesake.inputs.solver_key != record.inputs.solver_key:
        return f"its inputs are not those of run {namesake.run} of the same name; give the solvers different labels"
    if record.inputs.is_search and record.x and first.x and record.settings != first.settings:
        return f"its settings are not those of run {first.run}"
    if twin is not record:
        return f"its seed {record.seed} repeats that of run {twin.run}"
    return None


def check_code(case: CheckedRun) -> str | None:
    """Find a run of other code than the installed one, or, if no record is of that, than most records."""
    record = case.record
    if record.inputs.imported or case.code is None:
        return None
    if record.origin is None or not record.inputs.code:
        return "it does not say which code computed it"
    code = record.inputs.code, record.origin.casadi
    if code == case.code:
        return None
    actual, usual = (f"{digest[:8]}, CasADi {casadi}" for digest, casadi in (code, case.code))
    return f"it was computed by other code ({actual}) than the others ({usual})"


def check_between_samples(case: CheckedRun) -> str | None:
    """Judge a point again between the samples, as a run does: on the dense grid, and by proof."""
    assert case.problem is not None  # for the type checker
    stated = case.record.verdict
    # Narrow bounds of means are a third of the work, and rarely change a word.
    for sharpness in (DECISIVE, MEAN_SHARPNESS):
        again = Verdict.from_evaluation(evaluate(case.problem, case.record.x, mean_sharpness=sharpness))
        words = ["nothing" if v.guaranteed is None else v.guaranteed.word for v in (stated, again)]
        if words[0] == words[1] != "?":
            break
    if stated.dense_feasible != again.dense_feasible or _list_differences(stated.dense or {}, again.dense or {}):
        return "its verdict on the dense grid does not follow from its x"
    if words[0] != words[1]:
        return f"guaranteed between the samples: recorded {words[0]}, found {words[1]}"
    if [text.partition(" by ")[0] for text in stated.violated] != [t.partition(" by ")[0] for t in again.violated]:
        return f"violated: recorded {', '.join(stated.violated) or 'nothing'}, found {', '.join(again.violated) or 'nothing'}"
    return None


def _list_differences(stated: Mapping[str, float], found: Mapping[str, float], scale: float = 1.0) -> list[str]:
    """Return which stated values are not those of a point."""
    if stated.keys() != found.keys():
        return ["its indexes have other names than those of the problem"]
    return [
        f"its {name} is {stated[name]:.9g}, but that of its x is {value:.9g}"
        for name, value in found.items()
        if not is_same(stated[name], value, scale)
    ]


CHECKS: tuple[Check, ...] = (check_objective, check_verdict, check_bound, check_history, check_settings, check_code)
