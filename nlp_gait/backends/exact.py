"""A problem under the exact interpretation, as one CasADi function: what is compiled, searched and judged."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import MX

from nlp_gait.problem import Array, GaitProblem
from nlp_gait.problem.solution import RowViolation
from nlp_gait.symbolic.nonsmooth import Exact

# A total violation below this counts as feasible (each row in units of its scale).
FEASIBILITY_TOLERANCE = 1e-6


class ExactValues(NamedTuple):
    """Exact values at a point.

    Attributes:
        cost: sign * objective: what is minimised.
        violation: sum over all rows, each divided by its scale; NaN if a row is.
        g: (m,) rows, the bounds of the variables last.
        lower: (m,).
        upper: (m,).
        indexes: performance figures by name.
    """

    cost: float
    violation: float
    g: Array
    lower: Array
    upper: Array
    indexes: dict[str, float]


@dataclass(frozen=True, kw_only=True, eq=False)
class ExactModel:
    """Exact function of a problem and the names of its outputs.

    Attributes:
        function: (x, p) to ``cost`` (sign * objective: what is minimised), ``violation`` (sum over all rows, each divided
            by its scale; NaN if a row is), ``g`` (m,), and ``lower``, ``upper`` (m,), ``indexes``.
        row_names: (m,) names of the constraint rows; the last n are the variables' bounds.
        row_units: (m,).
        row_scales: (m,) violation that counts as 1, in the row's unit.
        index_names: names of the indexes.
    """

    function: ca.Function
    row_names: tuple[str, ...]
    row_units: tuple[str, ...]
    row_scales: Array
    index_names: tuple[str, ...]

    def at(self, x: Sequence[float] | Array, p: Array) -> ExactValues:
        """Values at x (n,) and parameter values p (k,)."""
        cost, violation, g, lower, upper, indexes = (
            np.array(value).ravel() for value in self.function(np.asarray(x), p)
        )
        named = dict(zip(self.index_names, indexes.tolist(), strict=True))
        return ExactValues(float(cost[0]), float(violation[0]), g, lower, upper, named)


def exact_model(problem: GaitProblem) -> ExactModel:
    """Exact function of a problem, built once for all copies that differ in parameter values only."""
    return problem.built("exact", lambda: _build(problem))


def row_violations(problem: GaitProblem, x: Array) -> list[RowViolation]:
    """Rows that the exact functions find violated at x by more than the tolerance, or NaN, worst first."""
    exact = exact_model(problem)
    _, _, g, lower, upper, _ = (np.array(value).ravel() for value in exact.function(x, problem.p))
    excess = np.maximum(np.maximum(lower - g, g - upper), 0.0)
    return [
        RowViolation(
            name=exact.row_names[i],
            value=float(g[i]),
            lower=float(lower[i]),
            upper=float(upper[i]),
            violation=float(excess[i]),
            unit=exact.row_units[i],
        )
        for i in np.argsort(-np.nan_to_num(excess, nan=np.inf), kind="stable")
        if not excess[i] <= FEASIBILITY_TOLERANCE
    ]


def _build(problem: GaitProblem) -> ExactModel:
    point = problem.symbols()
    assembly = problem.assemble(point, Exact())
    values, lowers, uppers, scales = [], [], [], []
    names: list[str] = []
    units: list[str] = []
    for constraint in assembly.constraints:
        value, lower, upper = constraint.columns
        values.append(value)
        lowers.append(lower)
        uppers.append(upper)
        scales.append(MX(ca.DM.ones(value.shape[0]) * constraint.scale))
        names += constraint.row_names
        units += [constraint.unit] * value.shape[0]
    # The bounds of x are rows too: a candidate outside them is infeasible like any other.
    n, k = len(problem.variables), len(problem.parameters)
    values.append(point.x)
    lowers.append(point.p[k - 2 * n : k - n])
    uppers.append(point.p[k - n :])
    scales.append(MX(ca.DM(problem.scale)))
    names += [f"bounds[{name}]" for name in problem.names]
    units += [variable.unit for variable in problem.variables]

    g, lower, upper, scale = (ca.vertcat(*parts) for parts in (values, lowers, uppers, scales))
    # fmax takes the other argument for a NaN, and a NaN must not pass for feasible: it is neither above nor below a bound.
    comparable = (g <= upper) + (g > upper)
    excess = ca.fmax(ca.fmax(lower - g, g - upper), 0) / comparable
    outputs = {
        "cost": problem.objective.sign * assembly.objective,
        "violation": ca.sum1(excess / scale),
        "g": g,
        "lower": lower,
        "upper": upper,
        "indexes": ca.vertcat(*assembly.indexes.values()),
    }
    function = ca.Function("exact", [point.x, point.p], list(outputs.values()), ["x", "p"], list(outputs))
    return ExactModel(
        function=function,
        row_names=tuple(names),
        row_units=tuple(units),
        row_scales=np.array(ca.evalf(scale)).ravel(),
        index_names=tuple(assembly.indexes),
    )
