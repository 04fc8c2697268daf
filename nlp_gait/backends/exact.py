"""A problem under the exact interpretation, as one CasADi function that is compiled, searched and judged; its identity."""

import hashlib
import inspect
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from random import Random
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from casadi import MX

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.locking import lock_casadi
from nlp_gait.formulation.registry import find_maker
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE, ConstraintValue
from nlp_gait.providers import PROBLEMS
from nlp_gait.symbolic.nonsmooth import Exact
from nlp_gait.user_code import shorten_name


class ExactValues(NamedTuple):
    """Exact values at a point."""

    cost: float  #: sign * objective, which is minimised
    violation: float  #: sum over all rows, each divided by its scale; NaN if a row is NaN
    g: Array  #: (m,) rows, the variables last
    lower: Array  #: (m,)
    upper: Array  #: (m,)
    metrics: dict[str, float]  #: performance figures by name

    @property
    def feasible(self) -> bool:
        """Whether the point is feasible, with a finite cost."""
        return self.violation <= FEASIBILITY_TOLERANCE and math.isfinite(self.cost)


@dataclass(frozen=True, kw_only=True, eq=False)
class ExactModel:
    """Exact function of a problem and the names of its outputs."""

    function: ca.Function  #: (x, p) to the parts of ``ExactValues``, in their order
    row_names: tuple[str, ...]  #: (m,) names of the constraint rows; the last n are the variables' bounds
    row_groups: tuple[str, ...]  #: (m,) names of the constraints to which they belong, ``bounds`` for the variables
    row_units: tuple[str, ...]  #: (m,)
    row_scales: Array  #: (m,) scales of the violations [unit of the row]
    metric_names: tuple[str, ...]

    @cached_property
    @lock_casadi
    def kernel(self) -> ca.Function:
        """(x, p) to cost and g (m,): what is evaluated for each candidate."""
        x, p = self.function.mx_in()
        cost, _, g, *_ = self.function.call([x, p], True, False)
        return ca.Function("kernel", [x, p], [cost, g])

    def row_bounds(self, problem: GaitProblem) -> tuple[Array, Array]:
        """Return lower and upper bounds (m,) of the rows for the problem's parameter values."""
        values = self.at(problem.lower, problem.p)
        check_row_bounds(problem, self.row_names, values.lower, values.upper)
        return values.lower, values.upper

    @lock_casadi
    def at(self, x: Sequence[float] | Array, p: Array) -> ExactValues:
        """Return the values at x (n,) and parameter values p (k,)."""
        function = self.function
        inputs = [np.ascontiguousarray(v, dtype=float).reshape(function.numel_in(i)) for i, v in enumerate((x, p))]
        outputs = [np.empty(function.numel_out(i)) for i in range(function.n_out())]
        buffer, call = function.buffer()  # 1 ms faster than converting to CasADi's matrices and back; it keeps no array
        for i, array in enumerate(inputs):
            buffer.set_arg(i, array.data)
        for i, array in enumerate(outputs):
            buffer.set_res(i, array.data)
        call()
        cost, violation, g, lower, upper, metrics = outputs
        if np.isnan(lower).any() or np.isnan(upper).any():  # CasADi's fmax ignores it
            violation = np.full(1, math.nan)
        named = dict(zip(self.metric_names, metrics.tolist(), strict=True))
        return ExactValues(float(cost[0]), float(violation[0]), g, lower, upper, named)

    def find_violated(self, values: ExactValues) -> tuple[ConstraintValue, ...]:
        """Return the rows that are violated by more than the tolerance, worst first; NaN is the worst."""
        violated = np.flatnonzero(~(_compute_violations(values) <= FEASIBILITY_TOLERANCE)).tolist()
        return find_violated_rows(self.rows(values, violated))

    def rows(self, values: ExactValues, chosen: Sequence[int] | None = None) -> tuple[ConstraintValue, ...]:
        """Return all rows, or chosen ones, with their names and units."""
        chosen = range(len(self.row_names)) if chosen is None else chosen
        columns = (values.g, values.lower, values.upper, _compute_violations(values))
        return tuple(
            ConstraintValue(
                name=self.row_names[k],
                value=value,
                lower=lower if math.isfinite(lower) else None,
                upper=upper if math.isfinite(upper) else None,
                violation=violation,
                unit=self.row_units[k],
            )
            for k, value, lower, upper, violation in zip(
                chosen, *(column[chosen].tolist() for column in columns), strict=True
            )
        )


# Solvers, targets and gaps have absolute tolerances of 1e-8 to 1e-9: an objective must change by more than this, or not at all.
LEAST_CHANGE = 1e-4
SAMPLES = 3  # points at which it is evaluated


def build_exact_model(problem: GaitProblem) -> ExactModel:
    """Return the exact function of a problem, built once for all copies that differ in parameter values only.

    Raises InputError for an objective in units so large that solvers would take its changes for rounding errors.
    """
    return problem.build_once(_build)


def check_row_bounds(problem: GaitProblem, names: Sequence[str], lower: Array, upper: Array) -> None:
    """Raise InputError unless the bounds of rows are numbers, and the lower ones not above the upper ones."""
    wrong = np.flatnonzero(~(lower <= upper))
    if wrong.size:
        i = wrong[0]
        what = "NaN" if np.isnan(lower[i] + upper[i]) else f"inverted, lower {lower[i]:g} above upper {upper[i]:g},"
        raise InputError(f"{problem.name}: bounds of constraint {names[i]} are {what} at these parameters; change them")


def find_violated_rows(rows: Iterable[ConstraintValue]) -> tuple[ConstraintValue, ...]:
    """Return the rows that are violated by more than the tolerance, worst first; NaN is the worst."""
    violated = [row for row in rows if not row.violation <= FEASIBILITY_TOLERANCE]
    return tuple(sorted(violated, key=lambda row: -math.inf if math.isnan(row.violation) else -row.violation))


def _compute_violations(values: ExactValues) -> Array:
    return np.maximum(np.maximum(values.lower - values.g, values.g - values.upper), 0.0)


def _build(problem: GaitProblem) -> ExactModel:
    point = problem.symbols()
    assembly = problem.assemble(point, Exact())
    constraints = assembly.constraints
    rows = [(*c.columns, MX(ca.DM.ones(c.value.shape[0]) * c.scale)) for c in constraints]
    # The bounds of x are rows, too: a candidate outside them is infeasible.
    n, k = len(problem.variables), len(problem.parameters)
    rows.append((point.x, point.p[k - 2 * n : k - n], point.p[k - n :], MX(ca.DM(problem.scale))))
    g, lower, upper, scale = (ca.vertcat(*columns) for columns in zip(*rows, strict=True))
    # fmax returns the other argument for NaN, which must not pass for feasible: it is neither above nor below a bound.
    comparable = (g <= upper) + (g > upper)
    violations = ca.fmax(ca.fmax(lower - g, g - upper), 0) / comparable
    cost = problem.objective.sign * assembly.objective
    violation = ca.sum1(violations / scale)
    outputs = {"cost": cost, "violation": violation, "g": g, "lower": lower, "upper": upper}
    outputs["metrics"] = ca.vertcat(*assembly.metrics.values())
    function = ca.Function(
        "exact", [point.x, point.p], [ca.densify(value) for value in outputs.values()], ["x", "p"], list(outputs)
    )
    names = [name for c in constraints for name in c.row_names]
    units = [c.unit for c in constraints for _ in c.row_names]
    groups = [c.name for c in constraints for _ in c.row_names] + ["bounds"] * len(problem.names)
    names += [f"bounds[{name}]" for name in problem.names]
    units += [variable.unit for variable in problem.variables]
    scales = np.array(ca.evalf(scale)).ravel()
    metrics = tuple(assembly.metrics)
    model = ExactModel(
        function=function,
        row_names=tuple(names),
        row_groups=tuple(groups),
        row_units=tuple(units),
        row_scales=scales,
        metric_names=metrics,
    )
    _check_change(problem, model)
    return model


def _check_change(problem: GaitProblem, model: ExactModel) -> None:
    draw = Random(0).random  # NumPy's generators would take a tenth of a process's start to import
    shares = np.array([[draw() for _ in problem.names] for _ in range(SAMPLES)])
    costs = [model.at(x, problem.p).cost for x in problem.lower + shares * (problem.upper - problem.lower)]
    finite = [cost for cost in costs if math.isfinite(cost)]
    change = max(finite, default=0.0) - min(finite, default=0.0)
    if 0.0 < change < LEAST_CHANGE:
        unit = "" if problem.objective.unit == "1" else f" {problem.objective.unit}"
        raise InputError(
            f"{problem.name}: {problem.objective.name} changes by {change:.2g}{unit} only between points within the bounds; "
            "use a unit in which it changes by about 1"
        )


def hash_json(data: Any) -> str:
    """Return the SHA-256 of plain data."""
    return hashlib.sha256(json.dumps(data, sort_keys=True).encode()).hexdigest()


def identify_problem(problem: GaitProblem) -> dict[str, Any]:
    """Return how to load a problem, and what it was made of; of a problem that no name loads, a hash of its formulas."""
    changed = {q.name: v for q, v in zip(problem.parameters, problem.p.tolist(), strict=True) if v != q.default}
    identity: dict[str, Any] = {"name": problem.load_name, "options": dict(problem.options), "parameters": changed}
    identity["mathematics"] = problem.mathematics
    files = dict(problem.files) if problem.has_origin else {"formulas": problem.build_once(hash_formulas)}
    return {**identity, "files": files} if files else identity


def hash_formulas(problem: GaitProblem) -> str:
    """Return a hash of a problem's exact function as CasADi writes it, of its rows' names, and of the parameters' defaults."""
    model = build_exact_model(problem)
    return hash_json([model.function.serialize(), model.row_names, [(q.name, q.default) for q in problem.parameters]])


def make_key(identity: Mapping[str, Any]) -> dict[str, Any]:
    """Return an identity without folders and without options that have their defaults: a new option changes no key."""
    name, files = identity["name"], identity.get("files", {})
    parameters = inspect.signature(find_maker(name)).parameters if name in PROBLEMS else {}
    options = {
        key: files.get(key, value)
        for key, value in identity["options"].items()
        if key not in parameters or parameters[key].default != value
    }
    return {"mathematics": 1, **identity, "name": shorten_name(name), "options": options, "files": dict(files)}


def describe_difference(before: Mapping[str, Any], after: Mapping[str, Any]) -> str:
    """Return in words how two problems differ; empty if they are the same."""
    a, b = make_key(before), make_key(after)
    for part, words in (("mathematics", "version of the formulas"), ("name", "name")):
        if a[part] != b[part]:
            return f"its {words} is {b[part]}, not {a[part]}"
    if a["files"] != b["files"]:
        changed = sorted(name for name in {**a["files"], **b["files"]} if a["files"].get(name) != b["files"].get(name))
        return f"the user's files that it is made of have changed ({', '.join(changed)})"
    for part, word in (("options", "option"), ("parameters", "parameter")):
        for name in {**a[part], **b[part]}:
            if a[part].get(name) != b[part].get(name):
                default = "its default"
                return f"{word} {name} is {b[part].get(name, default)}, not {a[part].get(name, default)}"
    return ""
