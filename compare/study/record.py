"""One finished run as plain data and as one JSON file."""

from __future__ import annotations

import itertools
import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields, replace
from pathlib import Path
from typing import Any

from compare.judge import Evaluation
from compare.study.task import LABEL, ProblemSpec, Task
from nlp_gait.decoding import decode
from nlp_gait.errors import InputError
from nlp_gait.files import convert_errors, read_json, replace_nan
from nlp_gait.formulation import Objective, Result
from nlp_gait.formulation.result import StoredProblem
from nlp_gait.formulation.solution import ActiveConstraint, Evaluations
from nlp_gait.notebook import format_html_table
from nlp_gait.proofs.guarantee import Guarantee
from nlp_gait.user_code import resolve_code

SCHEMA = 3
REMEDY = "delete it to have it made anew"
CALLS = frozenset(field.name for field in fields(Evaluations))


@dataclass(frozen=True, kw_only=True)
class History:
    """Best so far over a run.

    Attributes:
        evaluations: calls of f until then.
        objective: in the problem's sense; None while nothing was feasible.
    """

    evaluations: tuple[int, ...]
    objective: tuple[float | None, ...]


@dataclass(frozen=True, kw_only=True)
class Times:
    """Wall time [s]: all that differs between two equal runs.

    Attributes:
        build: symbolic problem and NLP, near 0 where the process had them already.
        compile: compiled objective, or derivatives and solver; likewise.
        solve: the run itself.
        objective: part of it in the objective; NaN where it is not known.
        history: at each entry of the history, from the beginning of the solve.
    """

    build: float
    compile: float
    solve: float
    objective: float
    history: tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """What the judge finds at a run's point.

    Attributes:
        objective: exact value, in the problem's sense; NaN without a point.
        violation: exact total violation; infinite without a point.
        feasible: on the problem's own samples.
        indexes: performance figures.
        dense: the same on the dense grid, if there is one.
        dense_feasible: no row violated on the dense grid; None without one.
        violated: names of the worst violated rows with the amount, own samples first.
        guaranteed: what is proven between the samples; None where the point is infeasible.
    """

    objective: float
    violation: float
    feasible: bool
    indexes: Mapping[str, float]
    dense: Mapping[str, float] | None
    dense_feasible: bool | None
    violated: tuple[str, ...]
    guaranteed: Guarantee | None

    @classmethod
    def of(cls, evaluation: Evaluation) -> Verdict:
        """Verdict from a full evaluation."""
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

    @classmethod
    def without_point(cls) -> Verdict:
        """Verdict on a run that failed before it had a point."""
        return cls(
            objective=math.nan,
            violation=math.inf,
            feasible=False,
            indexes={},
            dense=None,
            dense_feasible=None,
            violated=(),
            guaranteed=None,
        )


@dataclass(frozen=True, kw_only=True, repr=False)
class RunRecord:
    """A run of one solver on one problem: its claim, the judge's verdict, its cost.

    Attributes:
        problem: label, or name without one.
        solver: label, or name without one.
        run: number within the study.
        seed: of this run alone: it repeats the run.
        definition: all that the result depends on.
        settings: of the solver, defaults included.
        status: why it ended, in words.
        claimed: whether the solver claims a feasible result.
        x: by variable name; empty if the run failed before it had a point.
        claimed_objective: in the problem's sense; None without a claim.
        claimed_violation: total; None without a claim.
        verdict: of the judge.
        evaluations: calls by kind: f (with all constraints), g, gradient, jacobian, hessian.
        failed_evaluations: calls that gave NaN or infinity.
        iterations: generations of a population, iterations of an NLP solver.
        active_constraints: bounds with a price, dearest first, where the solver knows prices.
        history: best so far.
        time_s: wall times; the only part that two equal runs do not share.
    """

    problem: str
    solver: str
    run: int
    seed: int
    definition: Mapping[str, Any]
    settings: Mapping[str, Any]
    status: str
    claimed: bool
    x: Mapping[str, float]
    claimed_objective: float | None
    claimed_violation: float | None
    verdict: Verdict
    evaluations: Mapping[str, int]
    failed_evaluations: int
    iterations: int
    active_constraints: tuple[ActiveConstraint, ...]
    history: History
    time_s: Times

    @classmethod
    def of(cls, task: Task, **found: Any) -> RunRecord:
        """Record of a task, with what its run found: the fields from ``settings`` on."""
        return cls(
            problem=task.problem.title,
            solver=task.title,
            run=task.run,
            seed=task.run_seed,
            definition=task.definition(),
            **found,
        )

    @classmethod
    def failed(cls, task: Task, status: str) -> RunRecord:
        """Record of a run that has no result."""
        return cls.of(
            task,
            settings={},
            status=status,
            claimed=False,
            x={},
            claimed_objective=None,
            claimed_violation=None,
            verdict=Verdict.without_point(),
            evaluations={"f": 0},
            failed_evaluations=0,
            iterations=0,
            active_constraints=(),
            history=History(evaluations=(), objective=()),
            time_s=Times(build=0.0, compile=0.0, solve=0.0, objective=0.0, history=()),
        )

    @property
    def objective_in_words(self) -> str:
        """Of the judge, for example ``power 0.845869 W``."""
        if not self.verdict.feasible:
            return "infeasible"
        asked = self.definition["objective"]
        return f"{asked['name']} {self.verdict.objective:.6g} {asked['unit']}".removesuffix(" 1")

    def __repr__(self) -> str:
        """One line: whose run on what, and what the judge finds."""
        return f"<RunRecord of {self.solver} on {self.problem}, run {self.run}: {self.objective_in_words}>"

    def _repr_html_(self) -> str:
        calls = ", ".join(f"{kind} {count}" for kind, count in self.evaluations.items())
        note = f"{self.status}; seed {self.seed}; calls {calls}; {self.time_s.solve:.3g} s"
        return format_html_table(
            repr(self)[1:-1], ("variable", "value"), [(n, f"{v:.6g}") for n, v in self.x.items()], note
        )

    def to_json(self) -> dict[str, Any]:
        """Plain dictionaries, lists and numbers, with a schema version; what is not finite is null."""
        return {"schema": SCHEMA, **replace_nan(asdict(self))}


@dataclass(frozen=True, kw_only=True)
class _Definition:
    """Shape of a definition, see ``Task.definition``."""

    problem: StoredProblem
    objective: Objective
    solver: str | Mapping[str, Any]
    settings: Mapping[str, Any]
    seed: int
    imported: Mapping[str, str] | None = None
    handling: Mapping[str, Any] | None = None
    stop: Mapping[str, Any] | None = None
    polishes: Mapping[str, Any] | None = None
    start: Mapping[str, float] | None = None


def gait_of(record: RunRecord) -> Result:
    """Problem and x of a record.

    Raises:
        GaitError: the problem cannot be loaded: it is a file or module of one's own that is not named in this call, say; or it
            has other variables than the record.
    """
    stored = decode(StoredProblem, record.definition["problem"], "definition.problem")
    name = resolve_code(stored.name, "problem", f"the record of {record.solver}, run {record.run},")
    problem = ProblemSpec(name=name, options=stored.options, values=stored.parameters).load()
    return Result(problem=problem, x=problem.check_x(record.x))


def run_file(folder: Path, problem: str, solver: str, run: int) -> Path:
    """``<folder>/<problem>/<solver>-<run>.json``, where what belongs to a run is kept; a colon becomes a full stop."""
    problem, solver = (title.replace(":", ".") for title in (problem, solver))
    return folder / problem / f"{solver}-{run:04d}.json"


def read_record(path: Path) -> RunRecord:
    """Record from its file.

    Raises:
        InputError: the file is damaged or of another schema.
    """
    raw = read_json(path, "record", remedy=REMEDY)
    found = raw.get("schema") if isinstance(raw, dict) else type(raw).__name__
    if type(found) is not int or found != SCHEMA:
        newer = type(found) is int and found > SCHEMA
        remedy = "a newer version of nlp-gait wrote it" if newer else "run the study anew"
        raise InputError(f"record {str(path)!r}: 'schema' must be {SCHEMA}, got {found!r}; {remedy}")
    with convert_errors(f"record {str(path)!r} is damaged", InputError, REMEDY):
        return record_from(raw)


def record_from(raw: Any) -> RunRecord:
    """Record from what ``to_json`` gives; ValueError if it is none."""
    return _checked(decode(RunRecord, raw, unread=("schema",)))


def _checked(record: RunRecord) -> RunRecord:
    """The record, if its parts agree with each other."""
    objective = decode(_Definition, record.definition, "definition").objective
    for text in (objective.name, objective.unit):
        if not text.isprintable() or "$" in text:  # labels of axes, where a dollar begins a formula
            raise ValueError(f"{text!r} is not a name or unit of an objective")
    for title in (record.problem, record.solver):
        if not LABEL.fullmatch(title):  # names of files are made from it
            raise ValueError(f"{title!r} is not a label of a problem or solver")
    history, times, verdict = record.history, record.time_s, record.verdict
    if not len(history.evaluations) == len(history.objective) == len(times.history):
        raise ValueError("the columns of the history differ in length")
    counts = (record.run, record.seed, record.failed_evaluations, record.iterations, *record.evaluations.values())
    if min(counts) < 0 or any(a > b for a, b in itertools.pairwise((0, *history.evaluations))):
        raise ValueError("counts must be at least 0, and those of the history ascend")
    if "f" not in record.evaluations or not CALLS.issuperset(record.evaluations):
        raise ValueError(f"evaluations must be counts of {', '.join(sorted(CALLS))}, among them f")
    if record.definition["seed"] != record.seed:
        raise ValueError(f"seed is {record.seed}, but {record.definition['seed']} in the definition")
    if verdict.feasible and not math.isfinite(verdict.objective):
        raise ValueError("a feasible verdict without an objective")
    violation = math.inf if math.isnan(verdict.violation) else verdict.violation
    return replace(record, verdict=replace(verdict, violation=violation))
