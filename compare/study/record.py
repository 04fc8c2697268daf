"""One finished run, as plain data, as a JSON file, and as a row of a table: the only place that knows the schema.

A new field of a record needs one line in ``RunRecord``, where the run fills it in (``run_task.py``), and ``SCHEMA`` + 1.
What differs when a run is repeated belongs to ``Times`` or ``Origin``, which ``verify`` does not compare.
"""

from __future__ import annotations

import itertools
import json
import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from operator import attrgetter
from pathlib import Path
from typing import Any, TypeVar

from compare.judge import Evaluation
from compare.study.origin import Origin, format_now
from compare.study.task import LABEL, Inputs, ProblemSpec, Task
from nlp_gait.decoding import decode
from nlp_gait.errors import InputError
from nlp_gait.files import LARGEST_FILE, check_plain, convert_errors, read_json, replace_nan
from nlp_gait.formulation import GaitProblem, Result, load_result
from nlp_gait.formulation.registry import resolve_stored
from nlp_gait.formulation.result import StoredProblem
from nlp_gait.formulation.solution import ActiveConstraint, Evaluations
from nlp_gait.notebook import import_pandas
from nlp_gait.proofs.guarantee import Guarantee

T = TypeVar("T")
K = TypeVar("K")

SCHEMA = 5
OPTIONAL = {"origin", "finished"}  # fields that a file may lack
REMEDY = "delete it to have the run repeated"
CALLS = tuple(kind.name for kind in fields(Evaluations))
CLAIMED = ("problem", "solver", "run", "seed", "claimed", "status", "claimed_objective", "claimed_violation")


@dataclass(frozen=True, kw_only=True)
class History:
    """Best so far over a run."""

    evaluations: tuple[int, ...] = ()  #: calls of f so far
    objective: tuple[float | None, ...] = ()  #: in the problem's sense; None before the first feasible point


@dataclass(frozen=True, kw_only=True)
class Times:
    """Wall times [s], the only difference between two equal runs; NaN if unknown."""

    build: float = math.nan  #: of the symbolic problem and NLP; near 0 if the process had them already
    compile: float = math.nan  #: of the objective, or of derivatives and solver; likewise
    solve: float = math.nan
    objective: float = math.nan  #: share of ``solve`` in the objective
    history: tuple[float, ...] = ()  #: at each entry of the history, from the start of the solve
    finished: str = ""  #: date and time of the end of the run, UTC; empty if unknown


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """The judge's verdict on the point of a run; by default that on a run without a point."""

    objective: float = math.nan  #: exact value, in the problem's sense
    violation: float = math.inf  #: exact total violation
    feasible: bool = False  #: at the problem's samples
    indexes: Mapping[str, float] = field(default_factory=dict)
    dense: Mapping[str, float] | None = None  #: the same on the dense grid; None without one
    dense_feasible: bool | None = None  #: whether all rows are satisfied on the dense grid; None without one
    #: Names of the worst violated rows with their violation, those at the problem's samples first
    violated: tuple[str, ...] = ()
    guaranteed: Guarantee | None = None  #: what is proven between the samples; None if the point is infeasible

    @classmethod
    def from_evaluation(cls, evaluation: Evaluation) -> Verdict:
        """Return the verdict of an evaluation."""
        worst = [*evaluation.violations[:5], *evaluation.dense_violations[:5]]
        return cls(
            objective=float(evaluation.objective["value"]),
            violation=evaluation.violation,
            feasible=evaluation.feasible,
            indexes=evaluation.indexes,
            dense=evaluation.dense,
            dense_feasible=None if evaluation.dense is None else not evaluation.dense_violations,
            violated=tuple(f"{row.name} by {row.violation:.3g} {row.unit}".removesuffix(" 1") for row in worst),
            guaranteed=evaluation.guaranteed,
        )


@dataclass(frozen=True, kw_only=True, repr=False)
class RunRecord:
    """One run of a solver on a problem: the claim, the judge's verdict, the cost."""

    problem: str  #: label, or name without one
    solver: str  #: label, or name without one
    run: int  #: number within the study
    inputs: Inputs  #: everything that the result depends on
    status: str = ""  #: why the run ended, in words
    settings: Mapping[str, Any] = field(default_factory=dict)  #: of the solver, defaults included
    claimed: bool = False  #: whether the solver claims a feasible result
    x: Mapping[str, float] = field(default_factory=dict)  #: by variable name; empty without a point
    claimed_objective: float | None = None  #: in the problem's sense; None without a claim
    claimed_violation: float | None = None  #: total; None without a claim
    verdict: Verdict = Verdict()  #: what the judge finds at x
    #: Calls by kind: f (with all constraints), g, gradient, jacobian, hessian; empty for an imported result without counts
    evaluations: Mapping[str, int] = field(default_factory=dict)
    failed_evaluations: int = 0  #: calls that returned NaN or infinity
    iterations: int = 0  #: generations of a population, iterations of an NLP solver
    #: Bounds with a price, largest first, from solvers with multipliers
    active_constraints: tuple[ActiveConstraint, ...] = ()
    history: History = History()
    time_s: Times = Times()
    origin: Origin | None = None  #: of this run; None for imported results

    @classmethod
    def from_task(cls, task: Task, *, time_s: Times, **results: Any) -> RunRecord:
        """Return the record of a task with the results of its run, which ends now: the fields from ``status`` on."""
        return cls(
            problem=task.problem.title,
            solver=task.title,
            run=task.run,
            inputs=task.inputs(),
            time_s=replace(time_s, finished=format_now()),
            origin=Origin.make(),
            **results,
        )

    @classmethod
    def make_failed(cls, task: Task, reason: str) -> RunRecord:
        """Return the record of a run without a result."""
        times = Times(build=0.0, compile=0.0, solve=0.0, objective=0.0)
        return cls.from_task(task, status=f"failed: {reason}", evaluations={"f": 0}, time_s=times)

    @property
    def seed(self) -> int:
        """Seed of this run."""
        return self.inputs.seed

    @property
    def cost(self) -> float:
        """The judge's objective, to be minimised; infinite where the run is not feasible."""
        return self.inputs.objective.sign * self.verdict.objective if self.verdict.feasible else math.inf

    @property
    def objective_text(self) -> str:
        """The judge's objective, for example ``power 0.845869 W``."""
        if not self.verdict.feasible:
            return "infeasible"
        objective = self.inputs.objective
        return f"{objective.name} {self.verdict.objective:.6g} {objective.unit}".removesuffix(" 1")

    def __repr__(self) -> str:
        return f"<RunRecord of {self.solver} on {self.problem}, run {self.run}: {self.objective_text}>"

    def to_json(self) -> dict[str, Any]:
        """Return plain data with a schema version; numbers that are not finite become null."""
        return {"schema": SCHEMA, **replace_nan(self)}


def find_best(records: Iterable[RunRecord]) -> RunRecord | None:
    """Return the best feasible record; None without any."""
    best = min(records, key=lambda record: record.cost, default=None)
    return best if best is not None and best.verdict.feasible else None


def group_by(items: Iterable[T], key: Callable[[T], K]) -> dict[K, list[T]]:
    """Return lists of items by a key of each, in the order of the first ones."""
    groups: dict[K, list[T]] = {}
    for item in items:
        groups.setdefault(key(item), []).append(item)
    return groups


def read_record(path: Path) -> RunRecord:
    """Return the record in a file; raises InputError if it is damaged or has another schema."""
    raw = read_json(path, "record", remedy=REMEDY)
    schema = raw.get("schema") if isinstance(raw, dict) else type(raw).__name__
    if type(schema) is not int or schema != SCHEMA:
        newer = type(schema) is int and schema > SCHEMA
        remedy = "a newer version of nlp-gait wrote it" if newer else "rerun the study"
        raise InputError(f"record {str(path)!r}: 'schema' must be {SCHEMA}, got {schema!r}; {remedy}")
    with convert_errors(f"record {str(path)!r} is damaged", InputError, REMEDY):
        return parse_record(raw)


def parse_record(raw: Any) -> RunRecord:
    """Return a record from ``RunRecord.to_json``; raises ValueError for missing, wrong or contradictory fields."""
    record = decode(RunRecord, raw, unread=("schema",))
    if math.isnan(record.verdict.violation):
        record = replace(record, verdict=replace(record.verdict, violation=math.inf))
    decode(StoredProblem, record.inputs.problem, "inputs.problem")
    plain = replace_nan(record)
    places = [(plain, raw), *((plain[name], raw.get(name, {})) for name in ("verdict", "history", "time_s"))]
    if plain["inputs"] != raw["inputs"] or any(whole.keys() - stored.keys() - OPTIONAL for whole, stored in places):
        raise ValueError("it must have every field, defaults too")  # a default would be another run's
    for text in (record.inputs.objective.name, record.inputs.objective.unit):
        if not text.isprintable() or "$" in text:  # labels of axes, where a dollar begins a formula
            raise ValueError(f"{text!r} is not a name or unit of an objective")
    for title in (record.problem, record.solver):
        if not LABEL.fullmatch(title):  # names of files are made from it
            raise ValueError(f"{title!r} is not a label of a problem or solver")
    history, verdict = record.history, record.verdict
    if not len(history.evaluations) == len(history.objective) == len(record.time_s.history):
        raise ValueError("the columns of the history differ in length")
    counts = (record.run, record.seed, record.failed_evaluations, record.iterations, *record.evaluations.values())
    if min(counts) < 0 or any(a > b for a, b in itertools.pairwise((0, *history.evaluations))):
        raise ValueError("counts must be at least 0, and those of the history ascend")
    unknown = record.inputs.imported and not record.evaluations and not history.evaluations
    if not unknown and ("f" not in record.evaluations or not set(CALLS).issuperset(record.evaluations)):
        raise ValueError(f"evaluations must be counts of {', '.join(sorted(CALLS))}, among them f")
    if verdict.feasible and not math.isfinite(verdict.objective):
        raise ValueError("a feasible verdict without an objective")
    proof = verdict.guaranteed
    if proof is not None and not (proof.satisfied or proof.violations or proof.reason):
        raise ValueError("a guarantee is missing without a violation or a reason")
    return record


def check_readable(record: RunRecord) -> None:
    """Check, before a record is written, that it can be read; raises ValueError."""
    data = record.to_json()
    check_plain(data)
    if len(json.dumps(data, indent=1, allow_nan=False)) > LARGEST_FILE:
        raise ValueError(f"it has more than {LARGEST_FILE} bytes")
    parse_record(data)


def load_gait(record: RunRecord) -> Result:
    """Return the problem and the point of a record; GaitError if it cannot be loaded or has other variables now."""
    problem = load_problem(record)
    return Result(problem=problem, x=problem.check_x(record.x))


def load_result_or_record(path: Path) -> Result:
    """Return the problem and the point in a result file or a record; raises InputError as ``load_result``."""
    raw = read_json(path, "result")
    return load_gait(read_record(path)) if isinstance(raw, dict) and "inputs" in raw else load_result(path)


def load_problem(record: RunRecord) -> GaitProblem:
    """Return the problem of a record; raises GaitError if it cannot be loaded."""
    stored = decode(StoredProblem, record.inputs.problem, "inputs.problem")
    owner = f"the record of {record.solver}, run {record.run},"
    name, options = resolve_stored(stored.name, stored.options, owner)
    return ProblemSpec(name=name, options=options, values=stored.parameters).load()


# Columns of tables of runs: what the judge finds, and everything.
JUDGED: dict[str, Callable[[RunRecord], object]] = {
    "objective": attrgetter("verdict.objective"),
    "violation": attrgetter("verdict.violation"),
    "feasible": attrgetter("verdict.feasible"),
    "feasible_between_samples": attrgetter("verdict.dense_feasible"),
    "guaranteed": lambda record: record.verdict.guaranteed and record.verdict.guaranteed.satisfied,
}
COLUMNS: dict[str, Callable[[RunRecord], object]] = {
    **{name: attrgetter(name) for name in CLAIMED},
    **JUDGED,
    **{f"calls_{kind}": lambda record, kind=kind: record.evaluations.get(kind) for kind in CALLS},  # type: ignore[misc]
    "failed_evaluations": lambda record: None if record.inputs.imported else record.failed_evaluations,
    "iterations": lambda record: None if record.inputs.imported else record.iterations,
    "time_s": attrgetter("time_s.solve"),
}


def make_row(record: RunRecord, columns: Mapping[str, Callable[[RunRecord], object]] = COLUMNS) -> list[object]:
    """Return a run as a row of a table; None for unknown values."""
    return [compute(record) for compute in columns.values()]


def list_variables(records: Iterable[RunRecord]) -> list[str]:
    """Return the names of all variables of some runs."""
    return list(dict.fromkeys(name for record in records for name in record.x))


def make_frame(records: Sequence[RunRecord]) -> Any:
    """Return records as a pandas frame: ``COLUMNS`` and a column ``x.<name>`` per variable; raises MissingExtraError."""
    names = list_variables(records)
    rows = [[*make_row(record), *map(record.x.get, names)] for record in records]
    return import_pandas().DataFrame(rows, columns=[*COLUMNS, *(f"x.{name}" for name in names)])
