"""One finished run as plain data and as one JSON file."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from compare.judge import Evaluation
from compare.storage import read_json, write_json
from nlp_gait.backends.solution import ActiveConstraint
from nlp_gait.errors import InputError

SCHEMA = 2


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
    """

    objective: float
    violation: float
    feasible: bool
    indexes: Mapping[str, float]
    dense: Mapping[str, float] | None
    dense_feasible: bool | None
    violated: tuple[str, ...]

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
        )


@dataclass(frozen=True, kw_only=True)
class RunRecord:
    """A run of one solver on one problem: its claim, the judge's verdict, its cost.

    Attributes:
        problem: label, or name without one.
        algorithm: label, or name without one.
        run: number within the study.
        seed: of this run alone: it repeats the run.
        definition: all that the result depends on.
        settings: of the algorithm, defaults included.
        status: why it ended, in words.
        success: the solver itself claims a feasible result.
        x: by variable name; empty if the run failed before it had a point.
        objective: as claimed, in the problem's sense; None if there is none.
        violation: as claimed; None if there is none.
        verdict: of the judge.
        evaluations: calls by kind: f (with all constraints), g, gradient, jacobian, hessian.
        failed_evaluations: calls that gave NaN or infinity.
        iterations: generations of a population, iterations of an NLP solver.
        active_constraints: bounds with a price, dearest first, where the solver knows prices.
        history: best so far.
        time_s: wall times; the only part that two equal runs do not share.
    """

    problem: str
    algorithm: str
    run: int
    seed: int
    definition: Mapping[str, Any]
    settings: Mapping[str, Any]
    status: str
    success: bool
    x: Mapping[str, float]
    objective: float | None
    violation: float | None
    verdict: Verdict
    evaluations: Mapping[str, int]
    failed_evaluations: int
    iterations: int
    active_constraints: tuple[ActiveConstraint, ...]
    history: History
    time_s: Times

    def to_json(self) -> dict[str, Any]:
        """Plain dictionaries, lists and numbers, with a schema version; what is not finite is null."""
        return {"schema": SCHEMA, **_without_nan(asdict(self))}

    def write(self, path: Path) -> None:
        """One file, whole or absent."""
        write_json(path, self.to_json())


def read_record(path: Path) -> RunRecord:
    """Record from its file.

    Raises:
        InputError: the file is damaged or of another schema.
    """
    raw = read_json(path)
    if not isinstance(raw, dict) or raw.get("schema") != SCHEMA:
        found = raw.get("schema") if isinstance(raw, dict) else type(raw).__name__
        raise InputError(f"record {str(path)!r}: 'schema' must be {SCHEMA}, got {found!r}; run the study anew")
    try:
        return _from_json(raw)
    except (AttributeError, KeyError, TypeError, ValueError) as error:
        raise InputError(f"record {str(path)!r} is damaged ({error!r}); delete it to have it made anew") from error


def _from_json(raw: Mapping[str, Any]) -> RunRecord:
    values = {field.name: raw[field.name] for field in fields(RunRecord)}
    verdict = {**raw["verdict"], "violated": tuple(map(str, raw["verdict"]["violated"]))}
    verdict["objective"] = _number(verdict["objective"], math.nan)
    verdict["violation"] = _number(verdict["violation"], math.inf)
    verdict["indexes"] = _numbers(verdict["indexes"])
    verdict["dense"] = None if verdict["dense"] is None else _numbers(verdict["dense"])
    values["verdict"] = Verdict(**verdict)
    values["active_constraints"] = tuple(
        ActiveConstraint(**{**row, "price": float(row["price"]), "bound": float(row["bound"])})
        for row in raw["active_constraints"]
    )
    history = History(
        evaluations=tuple(int(count) for count in raw["history"]["evaluations"]),
        objective=tuple(None if value is None else float(value) for value in raw["history"]["objective"]),
    )
    times = {name: _number(raw["time_s"][name], math.nan) for name in ("build", "compile", "solve", "objective")}
    values["history"] = history
    values["time_s"] = Times(**times, history=tuple(float(t) for t in raw["time_s"]["history"]))
    for name, kind in (
        ("problem", str),
        ("algorithm", str),
        ("status", str),
        ("run", int),
        ("seed", int),
        ("success", bool),
    ):
        if not isinstance(values[name], kind):
            raise TypeError(f"{name} must be {kind.__name__}, got {values[name]!r}")
    values["x"] = _numbers(raw["x"])
    values["evaluations"] = {str(kind): int(count) for kind, count in raw["evaluations"].items()}
    for name in ("objective", "violation"):
        values[name] = None if values[name] is None else float(values[name])
    if not len(history.evaluations) == len(history.objective) == len(values["time_s"].history):
        raise ValueError("the columns of the history differ in length")
    if values["verdict"].feasible and not math.isfinite(values["verdict"].objective):
        raise ValueError("a feasible verdict without an objective")
    return RunRecord(**values)


def _number(value: float | None, missing: float) -> float:
    return missing if value is None else float(value)


def _numbers(values: Mapping[str, Any]) -> dict[str, float]:
    return {str(name): _number(value, math.nan) for name, value in values.items()}


def _without_nan(data: Any) -> Any:
    if isinstance(data, float):
        return data if math.isfinite(data) else None
    if isinstance(data, dict):
        return {key: _without_nan(value) for key, value in data.items()}
    if isinstance(data, (list, tuple)):
        return [_without_nan(value) for value in data]
    return data
