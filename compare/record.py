"""One finished run as plain data and as one JSON file."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import asdict, dataclass, fields
from pathlib import Path
from typing import Any

from compare.judge import Evaluation
from compare.storage import read_json, write_json
from nlp_gait.errors import InputError

SCHEMA = 1


@dataclass(frozen=True, kw_only=True)
class History:
    """Best so far over a run; objective in the problem's sense, None while nothing was feasible."""

    evaluations: tuple[int, ...]
    objective: tuple[float | None, ...]
    elapsed_s: tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class Verdict:
    """What the judge finds at a run's point.

    Attributes:
        objective: exact value, in the problem's sense.
        violation: exact total violation.
        feasible: on the problem's own samples.
        indexes: performance figures.
        dense: the same on the dense grid, if there is one.
        dense_feasible: no row violated on the dense grid; None without one.
        violated: names of the worst violated rows with value and limit, own samples first.
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
            violated=tuple(f"{row.name} by {row.violation:.3g} {row.unit}" for row in worst),
        )


@dataclass(frozen=True, kw_only=True)
class RunRecord:
    """A run of one solver on one problem: its claim, the judge's verdict, its cost.

    Attributes:
        problem: name.
        options: what the problem was built with.
        parameters: values that differ from the defaults.
        algorithm: for example ``"pso"`` or ``"ipopt"``.
        settings: of the algorithm.
        run: number within the study.
        seed: of this run alone: it repeats the run.
        status: why it ended, in words.
        success: the solver itself claims a feasible result.
        x: by variable name.
        objective: as claimed, in the problem's sense; None if there is none.
        violation: as claimed; None if there is none.
        verdict: of the judge.
        evaluations: calls by kind: f (with all constraints), g, gradient, jacobian, hessian.
        failed_evaluations: calls that gave NaN or infinity.
        iterations: generations of a population, iterations of IPOPT.
        time_s: wall time: solve, and the part of it in the objective.
        history: best so far.
    """

    problem: str
    options: Mapping[str, Any]
    parameters: Mapping[str, float]
    algorithm: str
    settings: Mapping[str, Any]
    run: int
    seed: int
    status: str
    success: bool
    x: Mapping[str, float]
    objective: float | None
    violation: float | None
    verdict: Verdict
    evaluations: Mapping[str, int]
    failed_evaluations: int
    iterations: int
    time_s: Mapping[str, float]
    history: History

    def to_json(self) -> dict[str, Any]:
        """Plain dictionaries, lists and numbers, with a schema version."""
        return {"schema": SCHEMA, **asdict(self)}

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
        values = {field.name: raw[field.name] for field in fields(RunRecord)}
        values["verdict"] = Verdict(**{**raw["verdict"], "violated": tuple(raw["verdict"]["violated"])})
        values["history"] = History(**{key: tuple(column) for key, column in raw["history"].items()})
        record = RunRecord(**values)
        if not math.isfinite(record.verdict.objective):
            raise ValueError(f"objective {record.verdict.objective}")
    except (KeyError, TypeError, ValueError) as error:
        raise InputError(f"record {str(path)!r} is damaged ({error!r}); delete it to have it made anew") from error
    return record
