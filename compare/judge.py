"""The one judge: whatever a solver claims about x, these are the exact functions' values.

A point is evaluated on the problem's own samples, where its constraints are stated, and again on a dense grid, where
violations between the samples show.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from nlp_gait.backends.exact import FEASIBILITY_TOLERANCE, exact_model
from nlp_gait.problem import Array, GaitProblem

DENSE_INTERVALS = 1000  # at least this many equal parts on the dense grid


@dataclass(frozen=True, slots=True, kw_only=True)
class ConstraintValue:
    """One constraint row at a point; a missing bound is None."""

    name: str
    value: float
    lower: float | None
    upper: float | None
    violation: float
    unit: str


@dataclass(frozen=True, kw_only=True)
class Evaluation:
    """Exact values of a problem at a point.

    Attributes:
        problem: name.
        options: what the problem was built with.
        parameters: values that differ from the defaults.
        x: by variable name.
        objective: name, value and unit.
        indexes: performance figures on the problem's own samples.
        constraints: every row, the variables' bounds last.
        violation: total over all rows, each divided by its scale.
        feasible: total violation at most 1e-6.
        dense: the same indexes on the dense grid; None for a problem without samples.
        dense_violations: rows violated on the dense grid, worst first; times are samples of that grid.
        dense_intervals: equal parts of the dense grid.
    """

    problem: str
    options: Mapping[str, Any]
    parameters: Mapping[str, float]
    x: Mapping[str, float]
    objective: Mapping[str, Any]
    indexes: Mapping[str, float]
    constraints: tuple[ConstraintValue, ...]
    violation: float
    feasible: bool
    dense: Mapping[str, float] | None
    dense_violations: tuple[ConstraintValue, ...]
    dense_intervals: int | None

    @property
    def violations(self) -> tuple[ConstraintValue, ...]:
        """Violated rows, worst first."""
        return _worst(self.constraints)

    def to_json(self) -> dict[str, Any]:
        """Plain dictionaries, lists and numbers; the robot stands beside the problem's name."""
        robot = {"robot": self.options["robot"]} if "robot" in self.options else {}
        return {"schema": 1, "problem": self.problem, **robot, **asdict(self)}


def evaluate(problem: GaitProblem, x: Sequence[float] | Array) -> Evaluation:
    """Exact values at a point.

    Args:
        problem: with its current parameter values.
        x: (n,) decision variables, in the problem's order.

    Raises:
        InputError: x has the wrong length or is not finite.
    """
    point = problem.check_x(x)
    cost, violation, rows, indexes = _values(problem, point)
    parts = DENSE_INTERVALS if problem.grid is None else problem.grid.parts
    factor = math.ceil(DENSE_INTERVALS / parts)
    dense = problem.dense(factor)
    dense_rows, dense_indexes = _values(dense, point)[2:] if dense is not None else ((), None)
    objective = problem.objective
    return Evaluation(
        problem=problem.name,
        options=dict(problem.options),
        parameters=dict(problem.values),
        x=problem.by_name(point),
        objective={"name": objective.name, "value": objective.sign * cost, "unit": objective.unit},
        indexes=indexes,
        constraints=rows,
        violation=violation,
        feasible=violation <= FEASIBILITY_TOLERANCE,
        dense=dense_indexes,
        dense_violations=_worst(dense_rows),
        dense_intervals=None if dense is None else factor * parts,
    )


def _values(problem: GaitProblem, x: Array) -> tuple[float, float, tuple[ConstraintValue, ...], dict[str, float]]:
    """Cost, total violation, rows and indexes."""
    exact = exact_model(problem)
    cost, violation, g, lower, upper, indexes = (np.array(v).ravel() for v in exact.function(x, problem.p))
    excess = np.maximum(np.maximum(lower - g, g - upper), 0.0)
    rows = tuple(
        ConstraintValue(name=name, value=value, lower=_bound(low), upper=_bound(high), violation=amount, unit=unit)
        for name, value, low, high, amount, unit in zip(
            exact.row_names, g.tolist(), lower.tolist(), upper.tolist(), excess.tolist(), exact.row_units, strict=True
        )
    )
    named = dict(zip(exact.index_names, indexes.tolist(), strict=True))
    return float(cost[0]), float(violation[0]), rows, named


def _bound(value: float) -> float | None:
    return value if math.isfinite(value) else None


def _worst(rows: Sequence[ConstraintValue]) -> tuple[ConstraintValue, ...]:
    violated = [row for row in rows if not row.violation <= FEASIBILITY_TOLERANCE]
    return tuple(sorted(violated, key=lambda row: -row.violation))
