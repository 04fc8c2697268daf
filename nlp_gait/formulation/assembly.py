"""Parts of a problem's mathematics: variables, parameters, symbols of both, constraints, and rows as functions of time."""

import math
import sys
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from numbers import Real
from typing import Any, Generic, Literal, TypeAlias, TypeGuard, TypeVar, get_args

import casadi as ca
import numpy as np
from casadi import DM, MX, SX

from nlp_gait.errors import InputError, check_choice, format_value, unknown
from nlp_gait.formulation.signals import Array
from nlp_gait.symbolic.nonsmooth import Nonsmooth

Expression = TypeVar("Expression", MX, SX, DM)
# What rows refer to: an instant, changes over intervals, a mean over time, or no time.
Over: TypeAlias = Literal["instant", "interval", "mean", "once"]


def is_number(value: object) -> TypeGuard[float]:
    """Return whether a value is a finite real number, NumPy's included; True and False are not."""
    try:
        return isinstance(value, Real) and not isinstance(value, bool) and math.isfinite(value)
    except OverflowError:  # an integer larger than every float
        return False


def to_floats(what: str, values: object) -> Array:
    """Return array-like values of any shape as doubles, copied only if necessary; they need not be finite.

    Raises InputError for complex or masked numbers, texts, dates, true or false, which NumPy would convert silently.
    """
    # Importing numpy.ma here would cost every process a tenth of its start.
    if "numpy.ma" in sys.modules and np.ma.is_masked(values):
        raise InputError(f"{what} must be numbers, got a masked array; fill or remove masked values")
    try:
        array = np.asarray(values)
        if array.dtype.kind == "O" and all(isinstance(v, Real) and not isinstance(v, bool) for v in array.flat):
            return array.astype(np.float64)
        if array.dtype.kind in "iuf" and not isinstance(values, np.ndarray):  # true among numbers would become 1
            if any(isinstance(v, (bool, np.bool_)) for v in np.asarray(values, dtype=object).flat):
                raise InputError(f"{what} must be numbers, got true or false among them")
    except (TypeError, ValueError, OverflowError) as error:
        raise InputError(f"{what} must be numbers, got {type(values).__name__}: {error}") from error
    if array.dtype.kind not in "iuf":
        got = f"{type(values).__name__} of {array.dtype}"
        raise InputError(f"{what} must be numbers, got {got}: use real numbers, not texts, true or false")
    return array.astype(np.float64, copy=False)


@dataclass(frozen=True, slots=True, kw_only=True)
class Parameter:
    """Number that may change without rebuilding, between ``minimum`` and ``maximum``."""

    name: str
    unit: str
    default: float
    description: str
    minimum: float = -math.inf
    maximum: float = math.inf

    def __post_init__(self) -> None:
        _check_number(f"parameter {self.name!r}", "default", self.default)


@dataclass(frozen=True, slots=True, kw_only=True)
class Variable:
    """Decision variable with its default bounds, in ``unit``; bounds must stay between ``minimum`` and ``maximum``."""

    name: str
    unit: str
    lower: float
    upper: float
    description: str = ""
    minimum: float = -math.inf
    maximum: float = math.inf

    def __post_init__(self) -> None:
        owner = f"variable {self.name!r}"
        _check_number(owner, "lower", self.lower)
        _check_number(owner, "upper", self.upper)
        if not self.lower < self.upper:
            raise InputError(
                f"{owner}: lower must be below upper, got {self.lower} and {self.upper}; use fix() to hold a variable at a value"
            )

    def bound(self, end: Literal["lower", "upper"]) -> Parameter:
        """Return one bound as a parameter, ``<variable>.lower`` or ``<variable>.upper``."""
        name, text = f"{self.name}.{end}", f"{end} bound of {self.name}"
        return make_parameters((name, self.unit, getattr(self, end), text, self.minimum, self.maximum))[0]


def _check_number(owner: str, field: str, value: object) -> None:
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise InputError(f"{owner}: {field} must be a finite number, got {format_value(value)}")


def make_parameters(*table: tuple[str, str, float, str, float, float]) -> tuple[Parameter, ...]:
    """Return parameters from a table of name, unit, default, description, minimum and maximum."""
    return tuple(
        Parameter(name=name, unit=unit, default=default, description=text, minimum=minimum, maximum=maximum)
        for name, unit, default, text, minimum, maximum in table
    )


def make_variables(*table: tuple[str, str, float, float, str]) -> tuple[Variable, ...]:
    """Return variables from a table of name, unit, lower and upper bound, and description."""
    return tuple(
        Variable(name=name, unit=unit, lower=lower, upper=upper, description=text)
        for name, unit, lower, upper, text in table
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Grid:
    """Instants at which a problem evaluates its motion."""

    intervals: int  #: equal parts to which limits on changes apply
    samples_per_interval: int = 1  #: above 1 for more samples than these limits need
    #: Option of the problem's maker to multiply for a denser grid; None if the variables depend on the grid
    refined_by: Literal["intervals", "samples_per_interval"] | None = None

    def __post_init__(self) -> None:
        for name in ("intervals", "samples_per_interval"):
            count = getattr(self, name)
            if isinstance(count, bool) or not isinstance(count, int) or count < 1:
                raise InputError(f"{name} must be a whole number >= 1, got {count!r}")
        check_choice("refined_by", self.refined_by, (None, "intervals", "samples_per_interval"))

    @property
    def weights(self) -> Array:
        """Weights (N + 1,) of the samples in a mean over time by the trapezoidal rule, whose sum is one."""
        weights = np.ones(self.parts + 1)
        weights[[0, -1]] = 0.5
        return weights / self.parts

    @property
    def parts(self) -> int:
        """Number of equal parts between the samples."""
        return self.intervals * self.samples_per_interval

    @property
    def progress(self) -> MX:
        """(1, N + 1) shares of the phase's time at the samples, from 0 to 1."""
        return MX(DM(np.linspace(0.0, 1.0, self.parts + 1)).T)


@dataclass(frozen=True, slots=True, kw_only=True)
class Objective:
    """Name, unit and sense of the objective."""

    name: str
    unit: str
    sense: Literal["minimise", "maximise", "minimize", "maximize"] = "minimise"  #: read with an s in all spellings

    def __post_init__(self) -> None:
        check_choice(f"objective {self.name!r}: sense", self.sense, ("minimise", "maximise", "minimize", "maximize"))
        object.__setattr__(self, "sense", self.sense.replace("z", "s"))  # it is frozen

    @property
    def sign(self) -> float:
        """+1 if minimised, -1 if maximised: every solver minimises sign * objective."""
        return 1.0 if self.sense == "minimise" else -1.0


@dataclass(frozen=True, kw_only=True, eq=False)
class Constraint:
    """Rows lower <= value <= upper; a missing bound is None."""

    name: str  #: of the group, for example ``"torque_change"``
    #: One per row, naming joint or side and sample; empty for a single row without a label
    labels: tuple[str, ...] = ()
    unit: str  #: of value and bounds
    scale: float = 1.0  #: violation of this size counts as 1 in the total violation [unit]
    value: MX  #: (m, 1)
    #: (m, 1) or scalar, a function of parameters only; a number stands for ``MX(number)``
    lower: MX | None = None
    upper: MX | None = None  #: likewise
    #: Part of the motion that the rows refer to; None if unknown. Labels of rows at samples end with a comma and the sample.
    over: Over | None = None

    def __post_init__(self) -> None:
        owner = f"constraint {self.name!r}"
        check_choice(f"{owner}: over", self.over, (None, *get_args(Over)))
        _check_number(owner, "scale", self.scale)
        if not self.scale > 0.0:
            raise InputError(f"{owner}: scale must be > 0 (a violation of this size counts as 1), got {self.scale}")
        m = _count_rows(owner, "value", self.value)
        for end in ("lower", "upper"):
            bound = getattr(self, end)
            if isinstance(bound, (int, float)):
                bound = MX(bound)
                object.__setattr__(self, end, bound)  # it is frozen
            if bound is not None and (count := _count_rows(owner, end, bound)) not in (1, m):
                raise InputError(f"{owner}: {end} must have one row or as many as value, {m}, got {count}")
        if self.lower is None and self.upper is None:
            raise InputError(f"{owner}: lower, upper or both are required")
        _, lower, upper = self.columns
        if lower.is_constant() and upper.is_constant():
            low, high = (bound.to_DM().full().ravel() for bound in (lower, upper))
            wrong = np.flatnonzero((low > high) | (low == np.inf) | (high == -np.inf))
            if wrong.size:
                ends = f"lower {low[wrong[0]]:g} and upper {high[wrong[0]]:g}"
                raise InputError(f"{owner}: no number is between {ends}")
        if isinstance(self.labels, str) or len(self.labels) != (len(self.labels) and m) or (m != 1 and not self.labels):
            raise InputError(
                f"{owner}: value has {m} rows and labels has {len(self.labels)}; give one label per row"
                + (", or none" if m == 1 else "")
            )

    @property
    def row_names(self) -> tuple[str, ...]:
        """For example ``torque_change[LKneePitch, 3]``."""
        return tuple(f"{self.name}[{label}]" for label in self.labels) if self.labels else (self.name,)

    @property
    def columns(self) -> tuple[MX, MX, MX]:
        """Value, lower and upper as columns of equal length; a missing bound is infinite."""
        m = self.value.shape[0]

        def column(bound: MX | None, missing: float) -> MX:
            if bound is None:
                return MX(DM.ones(m) * missing)
            return bound if bound.shape[0] == m else ca.repmat(bound, m, 1)

        return self.value, column(self.lower, -math.inf), column(self.upper, math.inf)


def make_labels(rows: Sequence[str], columns: Sequence[int] | range) -> tuple[str, ...]:
    """Return row labels of a constraint on a (rows, columns) matrix in column-major order: ``"HK, 12"``."""
    return tuple(f"{row}, {k}" for k in columns for row in rows)


def _count_rows(owner: str, field: str, value: object) -> int:
    if not isinstance(value, MX):
        remedy = f"; write MX({value})" if isinstance(value, (int, float)) else ""
        got = f"{type(value).__name__} {format_value(value)}"
        raise InputError(f"{owner}: {field} must be a CasADi MX, got {got}{remedy}")
    if value.shape[1] != 1:
        raise InputError(f"{owner}: {field} must be a column, got shape {value.shape}; casadi.vec makes one")
    return int(value.shape[0])


@dataclass(frozen=True, kw_only=True, eq=False)
class Assembly:
    """A problem's mathematics under one interpretation of the non-smooth operations."""

    objective: MX  #: scalar, in the problem's own sense
    constraints: tuple[Constraint, ...]  #: groups of rows
    #: named performance figures (scalars); meaningful under ``Exact`` only
    metrics: Mapping[str, MX] = field(default_factory=dict)

    def __post_init__(self) -> None:
        for owner, value in (("objective", self.objective), *((f"metric {n!r}", v) for n, v in self.metrics.items())):
            if not isinstance(value, MX) or value.shape != (1, 1):
                shown = f"{type(value).__name__} {format_value(value)}"
                got = f"shape {value.shape}" if isinstance(value, MX) else shown
                raise InputError(f"{owner} must be a scalar MX, got {got}")
        for constraint in self.constraints:
            if not isinstance(constraint, Constraint):
                shown = f"{type(constraint).__name__} {format_value(constraint)}"
                raise InputError(f"constraints must be Constraint, got {shown}")

    def group(self, name: str) -> Constraint:
        """Return the constraint of a name; raises KeyError."""
        for constraint in self.constraints:
            if constraint.name == name:
                return constraint
        raise KeyError(name)


@dataclass(frozen=True, kw_only=True, eq=False)
class PointOf(Generic[Expression]):
    """A point of a problem, read by name: ``point["hip_height_m"]``."""

    x: Expression  #: (n, 1) decision variables
    p: Expression  #: (k, 1) parameters
    positions: Mapping[str, tuple[Literal["x", "p"], int]]  #: of each name in x or in p

    @classmethod
    def of(
        cls, x: Expression, p: Expression, variables: Sequence[str], parameters: Sequence[str]
    ) -> "PointOf[Expression]":
        """Return a point whose entries have these names, in this order."""
        positions: dict[str, tuple[Literal["x", "p"], int]] = {name: ("p", i) for i, name in enumerate(parameters)}
        return cls(x=x, p=p, positions=positions | {name: ("x", i) for i, name in enumerate(variables)})

    def __getitem__(self, name: str) -> Expression:
        """Return the value of a variable or a parameter; raises UnknownNameError."""
        if name not in self.positions:
            raise unknown("variable or parameter", name, tuple(self.positions))
        kind, index = self.positions[name]
        return self.x[index] if kind == "x" else self.p[index]

    def select(self, variables: Sequence[str]) -> "PointOf[Expression]":
        """Return the point with only these variables in x, in this order; parameters may become variables."""
        present = tuple(name for name, (kind, _) in self.positions.items() if kind == "x")
        if tuple(variables) == present:
            return self
        parameters = {name: place for name, place in self.positions.items() if place[0] == "p"}
        taken: dict[str, tuple[Literal["x", "p"], int]] = {name: ("x", i) for i, name in enumerate(variables)}
        return PointOf(x=ca.vertcat(*(self[name] for name in variables)), p=self.p, positions=parameters | taken)

    def with_values(self, values: Mapping[str, Expression]) -> "PointOf[Expression]":
        """Return the point with other values of some of its variables."""
        places = {
            index: values[name] for name, (kind, index) in self.positions.items() if kind == "x" and name in values
        }
        x = ca.vertcat(*(places.get(i, self.x[i]) for i in range(self.x.shape[0])))
        return PointOf(x=x, p=self.p, positions=self.positions)

    def extend(self, name: str, value: Expression) -> "PointOf[Expression]":
        """Return the point with one more variable at the end."""
        positions = {**self.positions, name: ("x", int(self.x.shape[0]))}
        return PointOf(x=ca.vertcat(self.x, value), p=self.p, positions=positions)


# Input of an assembly; one instant of a motion, mapped over the samples; numbers.
Point: TypeAlias = PointOf[MX]
InstantPoint: TypeAlias = PointOf[SX]
NumericPoint: TypeAlias = PointOf[Any]


@dataclass(frozen=True, kw_only=True, eq=False)
class RowsOverTime:
    """Rows of one phase of a motion as functions of time, which also defines them between samples."""

    name: str = ""  #: of the phase; empty if the motion has one phase only
    #: From a point, times (1, k) as fractions of the phase and an interpretation to the rows and metrics with samples at these
    #: times; ``Constraint.over`` tells how a row depends on them
    assemble: Callable[[Point, MX, Nonsmooth], Assembly]
    #: From the values of variables and parameters by name to the start and the end of the phase [s]
    times: Callable[[Mapping[str, float]], tuple[float, float]]
    intervals: int = 1  #: equal parts to which limits on changes apply
    #: Indexes that are means or integrals; with all samples at one time, the averaged value. Those of one name are added.
    means: tuple[str, ...] = ()
    kinks: tuple[float, ...] = ()  #: fractions of the phase at which a formula changes, such as a spline's knots
