"""Any small problem: from CasADi expressions, from CasADi's dictionary of an NLP, or from an Opti stack."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeAlias

import casadi as ca
import numpy as np
from casadi import MX, SX

from nlp_gait.errors import InputError, format_value, unknown
from nlp_gait.formulation.assembly import Assembly, Constraint, Objective, Parameter, Point, Variable, to_floats
from nlp_gait.formulation.gait_problem import GaitProblem
from nlp_gait.formulation.locking import lock_casadi
from nlp_gait.formulation.signals import Array
from nlp_gait.symbolic.nonsmooth import Nonsmooth

Expression: TypeAlias = MX | SX

SHARE = 0.1
SAMPLES = 5  # points within the bounds
UNNAMED = "problem"  # until it is loaded as FILE.py:NAME
BOUNDS = ("lbx", "ubx", "lbg", "ubg")


@dataclass(frozen=True, kw_only=True, eq=False)
class _Parts:
    """A problem as CasADi states it."""

    x: Sequence[Expression]  # symbols
    p: Sequence[Expression]  # symbols
    values: Sequence[float]  # of all entries of p
    f: Expression
    rows: Mapping[str, tuple[Expression, Expression, Expression]]  # value, and lower and upper bound as functions of p
    bounds: Sequence[tuple[float, float, str]]  # lower and upper bound and unit of all entries of x


@lock_casadi
def problem(
    objective: Any,
    constraints: Sequence[Any] | Mapping[str, Any] = (),
    *,
    x: Mapping[str, Sequence[Any]] | None = None,
    p: Mapping[str, float] | Sequence[float] | float = (),
    unit: str = "1",
    sense: str = "minimise",
    tolerance: float = 0.0,
    **bounds: Any,
) -> GaitProblem:
    """Return a problem of your own, for all commands (as ``FILE.py:NAME``) and functions.

    Args:
        objective: expression of named symbols; CasADi's dictionary with ``x``, ``f``, ``g`` and ``p``; or an Opti stack.
        constraints: comparisons of expressions, such as ``[shear <= 13600]``, or these by name.
        x: lower and upper bound of each variable by name, and optionally its unit, ``{"h": (0.1, 2.0, "in")}``.
        p: values of parameters, by name or in the order of the dictionary's ``p``; they can be changed later.
        unit: of the objective.
        sense: ``"minimise"`` or ``"maximise"``.
        tolerance: by which an equation may be missed; searches need about 1e-4.
        bounds: of the dictionary: ``lbx``, ``ubx``, ``lbg``, ``ubg``.

    Raises InputError that says what is missing or not allowed, also for integer variables.
    """
    if wrong := bounds.keys() - set(BOUNDS):
        raise unknown("argument of problem", min(wrong), BOUNDS)
    if isinstance(objective, ca.Opti):
        parts = _read_opti(objective)
    elif isinstance(objective, Mapping):
        parts = _read_dictionary(objective, p, bounds)
    else:
        parts = _read_expressions(objective, constraints, x, p)
    return _make(parts, Objective(name="objective", unit=unit, sense=sense), tolerance)  # type: ignore[arg-type]


def _make(parts: _Parts, objective: Objective, tolerance: float) -> GaitProblem:
    names = [name for symbol in parts.x for name in _name_entries(symbol)]
    for name, (low, high, _) in zip(names, parts.bounds, strict=True):
        if not (math.isfinite(low) and math.isfinite(high)):
            raise InputError(
                f"variable {name} needs finite bounds, got {low:g} and {high:g}: searches draw points in them"
            )
    variables = tuple(
        Variable(name=name, unit=unit, lower=low, upper=high)
        for name, (low, high, unit) in zip(names, parts.bounds, strict=True)
    )
    if not 0.0 <= tolerance < math.inf:
        raise InputError(f"tolerance must be >= 0 and finite, got {tolerance}")
    values, lows, highs = ([row[k] for row in parts.rows.values()] for k in range(3))
    function = ca.Function("problem", [*parts.x, *parts.p], [parts.f, *values])
    limits = ca.Function("limits", list(parts.p), [*lows, *highs])
    given, m = _split(ca.DM(parts.values), parts.p), len(parts.rows)
    defaults = [np.array(value).ravel() for value in limits.call(given)]
    draw = np.random.default_rng(0).uniform
    points = [ca.DM([draw(low, high) for low, high, _ in parts.bounds]) for _ in range(SAMPLES)]
    samples = [function.call([*_split(point, parts.x), *given])[1:] for point in points]
    scales = [
        _choose_scale([defaults[k], defaults[m + k]], [rows[k].full().ravel() for rows in samples]) for k in range(m)
    ]

    def assemble(point: Point, ops: Nonsmooth) -> Assembly:
        own = point.p[: len(parts.values)]
        f, *rows = function.call([*_split(point.x, parts.x), *_split(own, parts.p)])
        ends = [MX(ca.densify(end)) for end in limits.call(_split(own, parts.p))]
        constraints = []
        for k, (name, value) in enumerate(zip(parts.rows, rows, strict=True)):
            slack = np.where(defaults[k] == defaults[m + k], tolerance, 0.0)
            labels = tuple(map(str, range(value.shape[0]))) if value.shape[0] > 1 else ()
            row = Constraint(
                name=name,
                labels=labels,
                unit="1",
                scale=scales[k],
                value=ca.densify(value),
                lower=ends[k] - slack,
                upper=ends[m + k] + slack,
                over="once",
            )
            constraints.append(row)
        return Assembly(objective=ca.densify(f), constraints=tuple(constraints))

    parameters = [name for symbol in parts.p for name in _name_entries(symbol)]
    return GaitProblem(
        name=UNNAMED,
        title=f"Problem of {len(names)} variable{'s' * (len(names) > 1)}",
        variables=variables,
        own_parameters=tuple(
            Parameter(name=name, unit="1", default=float(value), description="")
            for name, value in zip(parameters, parts.values, strict=True)
        ),
        objective=objective,
        assemble=assemble,
    )


def _choose_scale(bounds: Sequence[Array], samples: Sequence[Array]) -> float:
    """Return the violation of a row that counts as 1: a share of its largest bound, or of its values if these are zero."""
    for columns in (bounds, samples):
        numbers = np.concatenate(columns)
        size = float(np.abs(numbers[np.isfinite(numbers)]).max(initial=0.0))
        if size > 0.0:
            return SHARE * size
    return SHARE


def _name_entries(symbol: Expression) -> list[str]:
    name = symbol.name()
    return [name] if symbol.numel() == 1 else [f"{name}[{k}]" for k in range(symbol.numel())]


def _split(values: Any, symbols: Sequence[Expression]) -> list[Any]:
    """Return the values of each symbol from a column of all."""
    ends = np.cumsum([0, *(symbol.numel() for symbol in symbols)]).tolist()
    return [ca.reshape(values[a:b], *s.shape) for s, a, b in zip(symbols, ends[:-1], ends[1:], strict=True)]


def _read_expressions(objective: Any, constraints: Any, x: Any, p: Any) -> _Parts:
    if not isinstance(objective, (MX, SX)) or objective.numel() != 1:
        raise InputError(f"the objective must be a scalar CasADi expression, got {format_value(objective)}")
    if not isinstance(x, Mapping):
        raise InputError(f"x must be the bounds by variable, such as {{'h': (0.1, 2.0)}}, got {format_value(x)}")
    constraints = [constraints] if isinstance(constraints, (MX, SX)) else constraints
    named = constraints if isinstance(constraints, Mapping) else {f"g{k}": g for k, g in enumerate(constraints, 1)}
    for name, constraint in named.items():
        if not isinstance(constraint, type(objective)):
            raise InputError(
                f"constraint {name} must be a comparison of {type(objective).__name__} expressions, such as shear <= 13600, "
                f"got {format_value(constraint)}"
            )
    used = ca.symvar(ca.veccat(objective, *named.values()))
    symbols = {s.name(): s for s in used}
    if len(symbols) < len(used):
        repeated = next(s.name() for s in used if s is not symbols[s.name()])
        raise InputError(f"two symbols have the same name {repeated!r}; rename one of them")
    p = {} if isinstance(p, Sequence) and not len(p) else p
    if not isinstance(p, Mapping):
        raise InputError(f"p must be the values of parameters by name, got {format_value(p)}")
    for name in [*x, *p]:
        if name not in symbols:
            raise InputError(f"no expression contains {name!r}; they contain {', '.join(symbols) or 'no symbol'}")
    for name in symbols:
        if (name in x) == (name in p):
            raise InputError(
                f"give {name!r} either bounds, x={{{name!r}: (lower, upper)}}, or a value, p={{{name!r}: value}}"
            )
    bounds = []
    for name, given in x.items():
        ends = tuple(given) if isinstance(given, (Sequence, np.ndarray)) else ()
        if len(ends) not in (2, 3):
            raise InputError(
                f"bounds of {name} must be (lower, upper) or (lower, upper, unit), got {format_value(given)}"
            )
        low, high = (_to_column(f"a bound of {name}", end, symbols[name].numel()) for end in ends[:2])
        bounds += [(a, b, ends[2] if len(ends) == 3 else "1") for a, b in zip(low, high, strict=True)]
    return _Parts(
        x=[symbols[name] for name in x],
        p=[symbols[name] for name in p],
        values=[v for name in p for v in _to_column(f"parameter {name}", p[name], symbols[name].numel())],
        f=objective,
        rows={name: _read_comparison(name, constraint, x) for name, constraint in named.items()},
        bounds=bounds,
    )


def _read_comparison(name: str, constraint: Any, x: Mapping[str, Any]) -> tuple[Any, Any, Any]:
    """Return value, lower and upper bound of a comparison; a side without variables is the bound."""
    kind, sides = type(constraint), []
    for entry in constraint.elements() if kind is SX else [constraint]:
        if entry.op() not in (ca.OP_LE, ca.OP_LT, ca.OP_EQ):
            raise InputError(
                f"constraint {name} must be a comparison, such as shear <= 13600, got {format_value(entry)}"
            )
        left, right = (entry.dep(i) + kind.zeros(entry.shape) for i in range(2))
        free = [any(s.name() in x for s in ca.symvar(side)) for side in (left, right)]
        if not any(free):
            raise InputError(f"constraint {name} contains no variable: {format_value(entry)}")
        if all(free):
            left, right, free = left - right, kind.zeros(entry.shape), [True, False]
        is_equation, missing = entry.op() == ca.OP_EQ, math.inf * kind.ones(entry.shape)
        value, bound = (left, right) if free[0] else (right, left)
        lower = bound if is_equation or free[1] else -missing
        upper = bound if is_equation or free[0] else missing
        sides.append((value, lower, upper))
    return tuple(ca.veccat(*column) for column in zip(*sides, strict=True))


def _read_dictionary(nlp: Mapping[str, Any], p: Any, bounds: Mapping[str, Any]) -> _Parts:
    if wrong := nlp.keys() - {"x", "f", "g", "p"}:
        raise unknown("key of CasADi's dictionary", min(wrong), ("x", "f", "g", "p"))
    if "x" not in nlp or "f" not in nlp:
        raise InputError("CasADi's dictionary needs at least x and f")
    for key, value in nlp.items():
        if not isinstance(value, (MX, SX)) or type(value) is not type(nlp["x"]):
            raise InputError(f"{key} of CasADi's dictionary must be MX or SX as x is, got {format_value(value)}")
        if key in "xp" and (not value.is_valid_input() or sum(s.numel() for s in ca.symvar(value)) != value.numel()):
            raise InputError(f"{key} of CasADi's dictionary must be different symbols, got {format_value(value)}")
    symbols, kind = ca.symvar(nlp["x"]), type(nlp["x"])
    g, given = nlp.get("g", kind(0, 1)), nlp.get("p", kind(0, 1))
    n, m = nlp["x"].numel(), g.numel()
    if free := {s.name() for s in ca.symvar(ca.veccat(nlp["f"], g))} - {
        s.name() for s in (*symbols, *ca.symvar(given))
    }:
        raise InputError(f"f or g contains {min(free)!r}, which is neither in x nor in p")
    ends = {name: _to_column(name, bounds.get(name, sign * math.inf), size)
            for name, sign, size in (("lbx", -1, n), ("ubx", 1, n), ("lbg", -1, m), ("ubg", 1, m))}  # fmt: skip
    entries = [name for symbol in ca.symvar(given) for name in _name_entries(symbol)]
    values = [p[name] for name in entries] if isinstance(p, Mapping) and set(p) == set(entries) else p
    rows = {"g": (ca.vec(g), kind(ends["lbg"]), kind(ends["ubg"]))} if m else {}
    return _Parts(
        x=symbols,
        p=ca.symvar(given),
        values=_to_column(f"p ({', '.join(entries)})", values, given.numel()),
        f=nlp["f"],
        rows=rows,
        bounds=[(low, high, "1") for low, high in zip(ends["lbx"], ends["ubx"], strict=True)],
    )


def _read_opti(opti: ca.Opti) -> _Parts:
    symbols, parameters = ([s for s in ca.symvar(column)] for column in (opti.x, opti.p))
    if opti.f.is_constant():
        raise InputError("the Opti stack has no objective; call minimize first")
    if not opti.ng:
        raise InputError("the Opti stack has no bounds of its variables: opti.subject_to(opti.bounded(low, x, high))")
    for symbol in symbols:
        if opti.advanced.get_meta(symbol).domain != ca.OPTI_DOMAIN_REAL:
            remedy = "relax it, or use a mixed-integer solver such as Bonmin"
            raise InputError(f"{symbol.name()} is an integer variable; problems here are continuous: {remedy}")
    values = [v for symbol in parameters for v in np.array(opti.debug.value(symbol)).ravel()]
    chosen, low, high, *_ = ca.detect_simple_bounds(opti.x, opti.p, opti.g, opti.lbg, opti.ubg)
    ends = ca.Function("ends", [opti.p], [low, high])(ca.DM(values))
    lower, upper = (np.array(end).ravel().tolist() for end in ends)
    old = [*symbols, *parameters]
    new = [
        MX.sym(f"{kind}{k}", *s.shape)
        for kind, group in (("x", symbols), ("p", parameters))
        for k, s in enumerate(group, 1)
    ]
    f, g, lbg, ubg = ca.graph_substitute([opti.f, opti.g, opti.lbg, opti.ubg], old, new)
    return _Parts(
        x=new[: len(symbols)],
        p=new[len(symbols) :],
        values=values,
        f=f,
        rows={f"g{k}": (g[k], lbg[k], ubg[k]) for k in chosen},
        bounds=[(a, b, "1") for a, b in zip(lower, upper, strict=True)],
    )


def _to_column(what: str, values: Any, size: int) -> list[float]:
    """Return ``size`` numbers; a single one counts for all."""
    numbers = to_floats(what, values).ravel()
    if numbers.size not in (1, size) or (numbers.size == 0 and size):
        raise InputError(f"{what} must be one number{f' or {size}' if size > 1 else ''}, got {numbers.size}")
    return [float(v) for v in np.broadcast_to(numbers, size)]


def name_problem(problem: GaitProblem, name: str) -> GaitProblem:
    """Return a problem under the name of the variable that holds it, unless it has one."""
    return replace(problem, name=name, title=name) if problem.name == UNNAMED else problem
