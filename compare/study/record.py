"""One finished run, as plain data, as a JSON file, and as a row of a table: the only place that knows the schema.

A new field of a record needs one line in ``RunRecord``, where the run fills it in (``perform.py``), and ``SCHEMA`` + 1.
"""

from __future__ import annotations

import itertools
import json
import math
import platform
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, fields, replace
from datetime import UTC, datetime
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from operator import attrgetter
from pathlib import Path
from typing import Any, TypeVar

from compare.judge import Evaluation
from compare.study.run import LABEL, Inputs, ProblemSpec
from nlp_gait import __version__
from nlp_gait.backends.kernel.compiler import find_compiler, read_cpu_info
from nlp_gait.decoding import decode
from nlp_gait.errors import CompilerError, InputError
from nlp_gait.files import LARGEST_FILE, check_plain, convert_errors, read_json, replace_nan
from nlp_gait.formulation import GaitProblem, Result, load_result
from nlp_gait.formulation.registry import resolve_stored
from nlp_gait.formulation.signals import import_pandas
from nlp_gait.formulation.solution import ActiveConstraint, Evaluations, StoredProblem

T = TypeVar("T")
K = TypeVar("K")

SCHEMA = 8
REMEDY = "delete it to have the run repeated"
CALLS = tuple(kind.name for kind in fields(Evaluations))
PACKAGES = ("casadi", "numpy", "scipy", "cma", "pymoo", "distributed")


@dataclass(frozen=True, kw_only=True)
class History:
    """Best so far over a run."""

    evaluations: tuple[int, ...] = ()  #: calls of f so far
    objective: tuple[float | None, ...] = ()  #: in the problem's sense; None before the first feasible point


@dataclass(frozen=True, kw_only=True)
class Times:
    """Wall times [s], which differ when a run is repeated; NaN if unknown."""

    build: float = math.nan  #: of the symbolic problem and NLP; near 0 if the process had them already
    compile: float = math.nan  #: of the objective, or of derivatives and solver; likewise
    solve: float = math.nan
    objective: float = math.nan  #: share of ``solve`` in the objective
    history: tuple[float, ...] = ()  #: at each entry of the history, from the start of the solve
    finished: str = ""  #: date and time of the end of the run, UTC; empty if unknown


@dataclass(frozen=True, kw_only=True, repr=False)
class RunRecord:
    """One run of a solver on a problem: what the solver reported, what the judge computed at its point, and the cost."""

    problem: str  #: label, or name without one
    solver: str  #: label, or name without one
    run: int  #: number within the study
    inputs: Inputs  #: everything that the result depends on
    status: str = ""  #: why the run ended, in words
    settings: Mapping[str, Any] = field(default_factory=dict)  #: of the solver, defaults included
    reported_feasible: bool = False  #: whether the solver reports a feasible result
    reported_objective: float | None = None  #: in the problem's sense; None without a report
    x: Mapping[str, float] = field(default_factory=dict)  #: by variable name; empty without a point
    objective: float = math.nan  #: exact value at x, in the problem's sense
    violation: float = math.inf  #: exact total violation at x
    feasible: bool = False  #: at the problem's samples
    metrics: Mapping[str, float] = field(default_factory=dict)  #: performance figures at x
    feasible_between_samples: bool | None = None  #: on the dense grid; None without one
    #: Names of the worst violated constraints with their violation, those at the problem's samples first
    violated: tuple[str, ...] = ()
    #: Calls by kind: f (with all constraints), g, gradient, jacobian, hessian; empty for an imported result without counts
    counts: Mapping[str, int] = field(default_factory=dict)
    failed_evaluations: int = 0  #: calls that returned NaN or infinity
    iterations: int = 0  #: generations of a population, iterations of an NLP solver
    #: Bounds with a price, largest first, from solvers with multipliers
    active_constraints: tuple[ActiveConstraint, ...] = ()
    history: History = History()
    time_s: Times = Times()
    versions: Mapping[str, str] = field(default_factory=dict)  #: of packages, compiler, processor and system

    @property
    def seed(self) -> int:
        """Seed of this run."""
        return self.inputs.seed

    @property
    def cost(self) -> float:
        """The judge's objective, to be minimised; infinite where the run is not feasible."""
        return self.inputs.objective.sign * self.objective if self.feasible else math.inf

    @property
    def name(self) -> str:
        """Problem, solver and run, for messages."""
        return f"{self.problem}, {self.solver}, run {self.run}"

    def __repr__(self) -> str:
        objective, end = self.inputs.objective, "infeasible"
        if self.feasible:
            end = f"{objective.name} {self.objective:.6g} {objective.unit}".removesuffix(" 1")
        return f"<RunRecord of {self.solver} on {self.problem}, run {self.run}: {end}>"

    def to_json(self) -> dict[str, Any]:
        """Return plain data with a schema version; numbers that are not finite become null."""
        return {"schema": SCHEMA, **replace_nan(self)}


def describe_evaluation(evaluation: Evaluation) -> dict[str, Any]:
    """Return what the judge found at a point, as fields of a record."""
    worst = [*evaluation.violations[:5], *evaluation.dense_violations[:5]]
    return {
        "objective": float(evaluation.objective["value"]),
        "violation": evaluation.violation,
        "feasible": evaluation.feasible,
        "metrics": evaluation.metrics,
        "feasible_between_samples": None if evaluation.dense is None else not evaluation.dense_violations,
        "violated": tuple(f"{row.name} by {row.violation:.3g} {row.unit}".removesuffix(" 1") for row in worst),
    }


@cache
def list_versions() -> dict[str, str]:
    """Return the versions of this package and of others, and compiler, processor and system."""
    versions = {"nlp-gait": __version__, "python": sys.version.split()[0]}
    for package in PACKAGES:
        with suppress(PackageNotFoundError):
            versions[package] = version(package)
    try:
        versions["compiler"] = find_compiler().summary
    except CompilerError:
        versions["compiler"] = "none: interpreted"
    versions["processor"] = read_cpu_info("model name") or platform.processor() or "unknown"
    versions["system"] = f"{platform.system()} {platform.release()} {platform.machine()}"
    return versions


def format_now() -> str:
    """Return the date and time, UTC."""
    return datetime.now(UTC).strftime("%Y-%m-%d %H:%M:%S UTC")


def find_best(records: Iterable[RunRecord]) -> RunRecord | None:
    """Return the best feasible record; None without any."""
    best = min(records, key=lambda record: record.cost, default=None)
    return best if best is not None and best.feasible else None


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
    if math.isnan(record.violation):
        record = replace(record, violation=math.inf)
    decode(StoredProblem, record.inputs.problem, "inputs.problem")
    if missing := replace_nan(record).keys() - raw.keys():
        raise ValueError(f"{min(missing)} is missing")  # a default would be another run's
    for text in (record.inputs.objective.name, record.inputs.objective.unit):
        if not text.isprintable() or "$" in text:  # labels of axes, where a dollar begins a formula
            raise ValueError(f"{text!r} is not a name or unit of an objective")
    for title in (record.problem, record.solver):
        if not LABEL.fullmatch(title):  # names of files are made from it
            raise ValueError(f"{title!r} is not a label of a problem or solver")
    history = record.history
    if not len(history.evaluations) == len(history.objective) == len(record.time_s.history):
        raise ValueError("the columns of the history differ in length")
    counts = (record.run, record.seed, record.failed_evaluations, record.iterations, *record.counts.values())
    if min(counts) < 0 or any(a > b for a, b in itertools.pairwise((0, *history.evaluations))):
        raise ValueError("counts must be at least 0, and those of the history ascend")
    times, course = attrgetter("build", "compile", "solve", "objective")(record.time_s), record.time_s.history
    if any(time < 0.0 for time in times) or any(a > b for a, b in itertools.pairwise((0.0, *course))):  # NaN is neither
        raise ValueError("times must be at least 0, and those of the history ascend")
    unknown = record.inputs.imported and not record.counts and not history.evaluations
    if not unknown and ("f" not in record.counts or not set(CALLS).issuperset(record.counts)):
        raise ValueError(f"counts must be of {', '.join(sorted(CALLS))}, among them f")
    if record.feasible and not math.isfinite(record.objective):
        raise ValueError("a feasible point without an objective")
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
    """Return the problem of a record; raises GaitError if it cannot be loaded, and UserCodeError for code that is not named."""
    stored = decode(StoredProblem, record.inputs.problem, "inputs.problem")
    name, options = resolve_stored(stored.name, stored.options, f"the record of {record.solver}, run {record.run},")
    return ProblemSpec(name=name, options=options, values=stored.parameters).load()


# Columns of tables of runs: what the judge finds, and everything.
JUDGED: dict[str, Callable[[RunRecord], object]] = {
    name: attrgetter(name) for name in ("objective", "violation", "feasible", "feasible_between_samples")
}
COLUMNS: dict[str, Callable[[RunRecord], object]] = {
    **{name: attrgetter(name) for name in ("problem", "solver", "run", "seed", "status")},
    **{name: attrgetter(name) for name in ("reported_feasible", "reported_objective")},
    **JUDGED,
    **{f"calls_{kind}": lambda record, kind=kind: record.counts.get(kind) for kind in CALLS},  # type: ignore[misc]
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
