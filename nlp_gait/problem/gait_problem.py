"""What a gait problem is: variables, parameters and one assembly of objective and constraints.

A problem holds mathematics. It knows no solver: ``backends/`` turn it into an NLP or into compiled code, both from the same
``assemble``. Everything that a user may want to change without rebuilding is a parameter: limits, weights, and the bounds of
every variable, which appear among the parameters as ``<variable>.lower`` and ``<variable>.upper``.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal, TypeVar

import casadi as ca
import numpy as np
from casadi import MX

from nlp_gait.errors import InputError, unknown
from nlp_gait.symbolic.nonsmooth import Nonsmooth

Array = np.ndarray[Any, np.dtype[np.float64]]
T = TypeVar("T")


@dataclass(frozen=True, slots=True, kw_only=True)
class Variable:
    """Decision variable with its default bounds, in ``unit``; no bound may be set beyond ``minimum`` and ``maximum``."""

    name: str
    unit: str
    lower: float
    upper: float
    description: str
    minimum: float = -math.inf
    maximum: float = math.inf


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """Number that may change without rebuilding; ``minimum`` and ``maximum`` say what is allowed."""

    name: str
    unit: str
    default: float
    description: str
    minimum: float = -math.inf
    maximum: float = math.inf


@dataclass(frozen=True, slots=True, kw_only=True)
class Objective:
    """Name, unit and sense of what is optimised."""

    name: str
    unit: str
    sense: Literal["minimise", "maximise"] = "minimise"

    @property
    def sign(self) -> float:
        """+1 if minimised, -1 if maximised: sign * objective is what every solver minimises."""
        return 1.0 if self.sense == "minimise" else -1.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Constraint:
    """Rows lower <= value <= upper; a missing bound is None.

    Attributes:
        name: of the group, for example ``"torque_change"``.
        labels: one per row, naming joint or side and sample; empty for a single row without a label.
        unit: of value and bounds.
        scale: violation of this size counts as 1 in the total violation [unit].
        value: (m, 1).
        lower: (m, 1) or scalar, a function of parameters only.
        upper: likewise.
    """

    name: str
    labels: tuple[str, ...] = ()
    unit: str
    scale: float
    value: MX
    lower: MX | None = None
    upper: MX | None = None

    @property
    def row_names(self) -> tuple[str, ...]:
        """For example ``torque_change[LKneePitch, 3]``."""
        return tuple(f"{self.name}[{label}]" for label in self.labels) if self.labels else (self.name,)


@dataclass(frozen=True, kw_only=True, eq=False)
class Assembly:
    """A problem's mathematics under one interpretation of the non-smooth operations.

    Attributes:
        objective: scalar, in the problem's own sense.
        constraints: groups of rows.
        indexes: named performance figures (scalars); meaningful under ``Exact`` only.
    """

    objective: MX
    constraints: tuple[Constraint, ...]
    indexes: Mapping[str, MX]


@dataclass(frozen=True, kw_only=True, eq=False)
class Point:
    """Symbols of an assembly, read by name: ``point["hip_height_m"]``.

    Attributes:
        x: (n, 1) decision variables.
        p: (k, 1) parameters.
    """

    x: MX
    p: MX
    positions: Mapping[str, tuple[Literal["x", "p"], int]]

    def __getitem__(self, name: str) -> MX:
        """Symbol of a variable or a parameter."""
        kind, index = self.positions[name]
        return self.x[index] if kind == "x" else self.p[index]


@dataclass(frozen=True, kw_only=True, eq=False)
class Signals:
    """Time histories of one gait.

    Attributes:
        joints: names of the columns of q, qd, qdd and tau.
        arrays: by name; the first axis is time. Units: s, rad, rad/s, rad/s^2, Nm, m.
    """

    joints: tuple[str, ...]
    arrays: Mapping[str, Array]


@dataclass(frozen=True, kw_only=True, eq=False)
class GaitProblem:
    """A gait problem with the current values of its parameters.

    Copies made by ``with_values`` share everything that was built from the mathematics.

    Attributes:
        name: for example ``"nao-ssp"``.
        title: one line.
        options: what the mathematics was built with (robot, intervals, ...).
        variables: in the order of x.
        own_parameters: limits and weights, without the variables' bounds.
        objective: name, unit, sense.
        assemble: builds objective and constraints from symbols and an interpretation.
        refine: makes the same problem with more samples (a factor), or None if it has no samples.
        signals: time histories of a given x (n,) and parameter vector (k,), or None.
        start: a start point (n,) for gradient methods from the parameter vector and a generator; None means uniform
            within the bounds.
        hessian: of the Lagrangian, for gradient methods: exact, or approximated where that was measured to be better.
        long_derivatives: True where one solve by a gradient method pays for compiling its derivatives.
        starts: how many starts a solve makes unless told otherwise: fewer where all lead to the same end, or each takes long.
        searchable: False for a problem that only gradient methods can solve, with thousands of variables tied by equations.
        values: parameters that differ from their defaults.
    """

    name: str
    title: str
    options: Mapping[str, str | int | float | bool]
    variables: tuple[Variable, ...]
    own_parameters: tuple[Parameter, ...]
    objective: Objective
    assemble: Callable[[Point, Nonsmooth], Assembly]
    refine: Callable[[int], GaitProblem] | None = None
    signals: Callable[[Array, Array], Signals] | None = None
    start: Callable[[Array, np.random.Generator], Array] | None = None
    hessian: Literal["exact", "limited-memory"] = "exact"
    long_derivatives: bool = False
    starts: int = 20
    searchable: bool = True
    values: Mapping[str, float] = field(default_factory=dict)
    _built: dict[str, Any] = field(default_factory=dict, repr=False)

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the variables, in the order of x."""
        return tuple(variable.name for variable in self.variables)

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """All parameters, the variables' bounds included, in the order of p."""
        bounds = [
            Parameter(
                name=f"{v.name}.{end}",
                unit=v.unit,
                default=getattr(v, end),
                description=f"{end} bound of {v.name}",
                minimum=v.minimum,
                maximum=v.maximum,
            )
            for end in ("lower", "upper")
            for v in self.variables
        ]
        return (*self.own_parameters, *bounds)

    @cached_property
    def p(self) -> Array:
        """(k,) current parameter values."""
        return _frozen([self.values.get(q.name, q.default) for q in self.parameters])

    @cached_property
    def lower(self) -> Array:
        """(n,) current lower bounds."""
        return self.p[-2 * len(self.variables) : -len(self.variables)]

    @cached_property
    def upper(self) -> Array:
        """(n,) current upper bounds."""
        return self.p[-len(self.variables) :]

    @cached_property
    def scale(self) -> Array:
        """(n,) width of each variable's default range: its unit of length for solvers."""
        return _frozen([v.upper - v.lower for v in self.variables])

    def value(self, name: str) -> float:
        """Current value of a parameter."""
        return float(self.p[self._parameter_index(name)])

    def with_values(self, /, **values: float) -> GaitProblem:
        """The same problem with other parameter values; nothing is rebuilt. Names with a dot go in as ``**{...}``.

        Raises:
            UnknownNameError: no such parameter.
            InputError: not finite, outside what the parameter allows, or bounds inverted.
        """
        for name, value in values.items():
            parameter = self.parameters[self._parameter_index(name)]
            if not is_number(value):
                raise InputError(f"parameter {name!r} must be a finite number [{parameter.unit}], got {value!r}")
            if not parameter.minimum <= value <= parameter.maximum:
                raise InputError(
                    f"parameter {name!r} must be within [{parameter.minimum}, {parameter.maximum}] {parameter.unit}, got {value}"
                )
        merged = {**self.values, **{name: float(value) for name, value in values.items()}}
        changed = replace(self, values=merged)
        changed._check_pairs()
        return changed

    def fix(self, /, **values: float) -> GaitProblem:
        """The same problem with some variables held at a value, which must lie within their bounds."""
        bounds: dict[str, float] = {}
        for name, value in values.items():
            i = self.variable_index(name)
            if not (is_number(value) and self.lower[i] <= value <= self.upper[i]):
                raise InputError(
                    f"variable {name!r} cannot be fixed at {value!r}: its bounds are [{self.lower[i]:g}, {self.upper[i]:g}] "
                    f"{self.variables[i].unit}; widen them with --set {name}.lower=... or --set {name}.upper=..."
                )
            bounds |= {f"{name}.lower": value, f"{name}.upper": value}
        return self.with_values(**bounds)

    def dense(self, factor: int) -> GaitProblem | None:
        """The same problem and parameter values on a grid with ``factor`` times as many intervals."""
        refine = self.refine
        if refine is None:
            return None
        return self.built(f"dense {factor}", lambda: refine(factor)).with_values(**self.values)

    def start_point(self, rng: np.random.Generator) -> Array:
        """(n,) start point for a gradient method, within the bounds."""
        if self.start is not None:
            return np.clip(self.start(self.p, rng), self.lower, self.upper)
        return rng.uniform(self.lower, self.upper)

    def variable_index(self, name: str) -> int:
        """Position of a variable in x; raises UnknownNameError."""
        if name not in self.names:
            raise unknown(f"variable of {self.name}", name, self.names)
        return self.names.index(name)

    def check_x(self, x: Sequence[float] | Array) -> Array:
        """(n,) floats, or InputError if the length is wrong or a value is not finite."""
        try:
            array = np.asarray(x, dtype=float)
        except (TypeError, ValueError, OverflowError) as error:
            raise InputError(f"x must be {len(self.names)} numbers, got {x!r}") from error
        if array.shape != (len(self.names),):
            raise InputError(
                f"x of {self.name} must have {len(self.names)} values ({', '.join(self.names)}), got shape {array.shape}"
            )
        for name, value in zip(self.names, array, strict=True):
            if not math.isfinite(value):
                raise InputError(f"x of {self.name}: {name} must be finite, got {value}")
        return array

    def by_name(self, x: Array) -> dict[str, float]:
        """Values of x by variable name."""
        return dict(zip(self.names, (float(v) for v in x), strict=True))

    def symbols(self) -> Point:
        """Fresh symbols for x and p."""
        positions: dict[str, tuple[Literal["x", "p"], int]] = {q.name: ("p", i) for i, q in enumerate(self.parameters)}
        positions |= {v.name: ("x", i) for i, v in enumerate(self.variables)}
        return Point(x=MX.sym("x", len(self.variables)), p=MX.sym("p", len(self.parameters)), positions=positions)

    def built(self, key: str, build: Callable[[], T]) -> T:
        """What was built from the mathematics under a key, built now if it was not; shared by all copies."""
        if key not in self._built:
            self._built[key] = build()
        return self._built[key]

    def _parameter_index(self, name: str) -> int:
        for i, parameter in enumerate(self.parameters):
            if parameter.name == name:
                return i
        raise unknown(f"parameter of {self.name}", name, [q.name for q in self.parameters])

    def _check_pairs(self) -> None:
        values = {q.name: float(v) for q, v in zip(self.parameters, self.p, strict=True)}
        for name, low in values.items():
            if name.endswith(".lower"):
                stem = name.removesuffix(".lower")
                if low > values[f"{stem}.upper"]:
                    raise InputError(
                        f"bounds of {stem!r} are inverted: lower {low:g} is above upper {values[f'{stem}.upper']:g}; "
                        f"set {name} and {stem}.upper so that lower <= upper"
                    )


def is_number(value: object) -> bool:
    """Whether a value is a finite number; a truth value is none."""
    try:
        return isinstance(value, (int, float)) and not isinstance(value, bool) and math.isfinite(value)
    except OverflowError:  # a whole number beyond every float
        return False


def constraint_rows(constraint: Constraint) -> tuple[MX, MX, MX]:
    """Value, lower and upper of a constraint as columns of equal length; a missing bound is infinite."""
    m = constraint.value.shape[0]

    def column(bound: MX | None, missing: float) -> MX:
        if bound is None:
            return MX(ca.DM.ones(m) * missing)
        return bound if bound.shape[0] == m else ca.repmat(bound, m, 1)

    return constraint.value, column(constraint.lower, -math.inf), column(constraint.upper, math.inf)


def _frozen(values: Sequence[float]) -> Array:
    array = np.array(values, dtype=float)
    array.setflags(write=False)
    return array
