"""Gait problems: variables, parameters, and one assembly of the objective and the constraints.

A problem contains mathematics and knows no solver: ``backends/`` turns it into an NLP or into compiled code, both from the same
``assemble``. Everything that a user may want to change without rebuilding is a parameter: limits, weights, and the bounds of
every variable, which are the parameters ``<variable>.lower`` and ``<variable>.upper``.
"""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property, lru_cache, partial
from typing import Any, Concatenate, Literal, ParamSpec, TypeAlias, TypeVar

import numpy as np
from casadi import DM, MX

from nlp_gait.errors import InputError, UnknownNameError, check_choice, format_value, unknown
from nlp_gait.formulation import assembly as parts
from nlp_gait.formulation.added_limits import add_limits
from nlp_gait.formulation.assembly import (
    Assembly,
    NumericPoint,
    Objective,
    Parameter,
    Point,
    Variable,
    is_number,
    to_floats,
)
from nlp_gait.formulation.display import Display
from nlp_gait.formulation.locking import Cache, lock_casadi
from nlp_gait.formulation.signals import Array, Signals
from nlp_gait.symbolic.nonsmooth import Nonsmooth

P = ParamSpec("P")
T = TypeVar("T")
LARGEST = 1e100  # of a parameter: squares of larger ones overflow
# Changes what a problem assembles.
Change = Callable[[Assembly, Point, Nonsmooth], Assembly]
# Maker of a problem, and all its options.
Origin: TypeAlias = "tuple[Callable[..., GaitProblem], Mapping[str, Any]]"
# Start point (n,) from the parameters by name.
Start = Callable[[Mapping[str, float], np.random.Generator], Array]
# A point is on a bound if it misses it by at most this share of the variable's default range.
ROUNDING = 1e-6
LONGEST_LINE = 98  # of a problem that is printed, without its brackets
MOST_ROWS = 40  # of a table
LIMITS_OPTION = "limits"  # of makers whose problems have phases


@dataclass(frozen=True, kw_only=True, eq=False)
class SolverHints:
    """What solvers may use; it changes no problem."""

    #: Start point (n,) for gradient methods from the parameters by name and a generator; None for a uniform one
    start: Start | None = None
    #: Of the Lagrangian, exact or approximated where that was measured to be better
    hessian: Literal["exact", "limited-memory"] = "exact"
    #: A rounding error may decide a jump, so that the result depends on libm's rounding. Compiled code then rounds as the
    #: virtual machine does, on every lane count, and is slower.
    amplifies_rounding: bool = False
    starts: int = 20  #: default number of starts; fewer where all lead to the same point, or each takes long
    #: False for a problem that only gradient methods can solve, with thousands of variables tied by equations
    searchable: bool = True

    def __post_init__(self) -> None:
        check_choice("hessian", self.hessian, ("exact", "limited-memory"))


@dataclass(frozen=True, kw_only=True, eq=False, repr=False)
class GaitProblem:
    """A gait problem, or any other one, with the current values of its parameters.

    Copies made by ``with_values`` share everything that was built from the mathematics; ``derive`` changes the mathematics. A
    problem may be used by several threads. It is pickled as its maker's name, options and values.
    """

    name: str  #: for example ``"nao-ssp"``
    title: str  #: one line
    variables: tuple[Variable, ...]  #: in the order of x
    own_parameters: tuple[Parameter, ...] = ()  #: limits and weights, without the variables' bounds
    objective: Objective  #: name, unit, sense
    #: Builds objective and constraints from symbols and an interpretation
    assemble: Callable[[Point, Nonsmooth], Assembly]
    #: What the mathematics was built with (robot, intervals, ...); written by ``formulation.registry.maker``
    options: Mapping[str, str | int | float | bool] = field(default_factory=dict)
    values: Mapping[str, float] = field(default_factory=dict)  #: parameters that differ from their defaults
    #: Parameters that the problem has with another option, as ``{"speed_m_s": "objective=power"}``
    with_other_options: Mapping[str, str] = field(default_factory=dict)
    #: Makes the same problem with a number of times as many samples; None if there is no finer grid
    refine: Callable[[int], GaitProblem] | None = None
    grid: parts.Grid | None = None  #: samples, or None if the problem has none
    #: The motion's rows as functions of time, one entry per phase; empty if they are defined on samples only
    rows_over_time: tuple[parts.RowsOverTime, ...] = ()
    #: Data of a least power for which the prover has formulas (``nlp_gait/proofs/nao``); None if it has none
    least_power: object | None = None
    display: Display = Display()  #: what shows its gaits
    hints: SolverHints = SolverHints()  #: for solvers
    mathematics: int = 1  #: version of the formulas, raised by hand where they change on purpose
    loaded_as: str = ""  #: argument of ``load``, if that is not the name but user code
    #: SHA-256 of the user's files that it was made of: "code" for all of a user's file, otherwise by the option that names one
    files: Mapping[str, str] = field(default_factory=dict)
    # No arguments: only copies made by ``with_values`` and ``with_origin`` share them.
    _cache: Cache = field(default_factory=Cache, init=False, repr=False)
    _origin: Origin | None = field(default=None, init=False, repr=False)

    def __post_init__(self) -> None:
        counts = Counter([*self.names, *(parameter.name for parameter in self.parameters)])
        duplicates = [name for name, count in counts.items() if count > 1]
        if duplicates:
            names = ", ".join(duplicates)
            raise InputError(
                f"problem {self.name!r}: two variables or parameters are named {names}; rename one of them"
            )

    def __repr__(self) -> str:
        goal, n = self.objective, len(self.variables)
        counts = f"{n} variable{'s' * (n > 1)}, {len(self.own_parameters)} parameters"
        text = f"{self.load_name}: {goal.sense} {goal.name} [{goal.unit}] over {counts}"
        return f"<{text if len(text) <= LONGEST_LINE else text[: LONGEST_LINE - 3] + '...'}>"

    def describe(self) -> str:
        """Return tables of the variables, parameters and options, as text; ``print(problem.describe())``."""
        variables = [(v.name, f"{low:g}", f"{high:g}", v.unit, v.description) for v, low, high in
                     zip(self.variables, self.lower.tolist(), self.upper.tolist(), strict=True)]  # fmt: skip
        parameters = [(q.name, f"{self.value(q.name):g}", q.unit, q.description) for q in self.own_parameters]
        blocks = [f"{self.load_name}: {self.title}", repr(self)[1:-1].partition(": ")[2]]
        for header, rows in (
            (("variable", "lower", "upper", "unit", ""), variables),
            (("parameter", "value", "unit", ""), parameters),
            (("option", "value"), [(name, str(value)) for name, value in self.options.items()]),
        ):
            blocks += [_format_table(header, rows)] if rows else []
        return "\n\n".join(blocks)

    @property
    def moves(self) -> bool:
        """Whether it is a motion over time, of which limits and figures make sense: a gait."""
        return self.grid is not None or bool(self.rows_over_time) or self.display.motion is not None

    @property
    def searchable(self) -> bool:
        """Whether searches can solve it, see ``SolverHints``."""
        return self.hints.searchable

    @property
    def load_name(self) -> str:
        """Argument of ``load``, written into files of results."""
        return self.loaded_as or self.name

    @property
    def has_origin(self) -> bool:
        """Whether ``load`` makes the same problem from its load name and options."""
        plain = (str, int, float, bool)
        return self._origin is not None and all(isinstance(value, plain) for value in self._origin[1].values())

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the variables, in the order of x."""
        return tuple(variable.name for variable in self.variables)

    @cached_property
    def parameters(self) -> tuple[Parameter, ...]:
        """All parameters, the variables' bounds included, in the order of p."""
        lower, upper = ((v.bound("lower") for v in self.variables), (v.bound("upper") for v in self.variables))
        return (*self.own_parameters, *lower, *upper)

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
        """(n,) width of each variable's default range, with which solvers scale it."""
        return _frozen([v.upper - v.lower for v in self.variables])

    def value(self, name: str) -> float:
        """Return the current value of a parameter."""
        return self.parameter_values[self._parameter(name).name]

    def with_values(self, /, **values: float) -> GaitProblem:
        """Return the same problem with other parameter values; nothing is rebuilt. Pass names with a dot as ``**{...}``.

        Raises UnknownNameError, and InputError for a value outside the parameter's limits, or inverted bounds.
        """
        for name, value in values.items():
            parameter = self._parameter(name)
            if not is_number(value):
                got = format_value(value)
                raise InputError(f"parameter {name!r} must be a finite number [{parameter.unit}], got {got}")
            if abs(float(value)) > LARGEST:
                raise InputError(f"parameter {name!r} must be within +-{LARGEST:g} {parameter.unit}, got {value}")
            if not parameter.minimum <= value <= parameter.maximum:
                limits = f"[{parameter.minimum}, {parameter.maximum}] {parameter.unit}"
                raise InputError(f"parameter {name!r} must be within {limits}, got {value}")
        merged = {**self.values, **{name: float(value) for name, value in values.items()}}
        changed = self._copy(self._origin, values=merged)
        for name, low in changed.parameter_values.items():
            stem = name.removesuffix(".lower")
            if stem != name and low > (high := changed.parameter_values[f"{stem}.upper"]):
                raise InputError(
                    f"bounds of {stem!r} are inverted: lower {low:g} is above upper {high:g}; "
                    f"set {name} and {stem}.upper so that lower <= upper"
                )
        return changed

    def with_limits(self, *, single_support: Iterable[Any] = (), double_support: Iterable[Any] = ()) -> GaitProblem:
        """Return the problem built again with more limits of its phases, see ``nlp_gait.limits``; parameter values are kept.

        Raises InputError for a problem without phases, or an object that is not a limit.
        """
        make, options = self._origin or (None, {})
        if make is None or LIMITS_OPTION not in options:
            raise InputError(f"problem {self.name!r} takes no limits; those of NAO and of humanoids do")
        limits = add_limits(options[LIMITS_OPTION], single_support, double_support)
        return make(**{**options, LIMITS_OPTION: limits}).with_values(**self.values)

    def fix(self, /, **values: float) -> GaitProblem:
        """Return the same problem with some variables fixed at a value within their bounds."""
        bounds: dict[str, float] = {}
        for name, value in values.items():
            i = self.variable_index(name)
            if not (is_number(value) and self.lower[i] <= value <= self.upper[i]):
                raise InputError(
                    f"variable {name!r} cannot be fixed at {format_value(value)}: its bounds are "
                    f"[{self.lower[i]:g}, {self.upper[i]:g}] {self.variables[i].unit}; "
                    f"widen them with --set {name}.lower=... or --set {name}.upper=..."
                )
            bounds |= {f"{name}.lower": value, f"{name}.upper": value}
        return self.with_values(**bounds)

    def place(self, coordinates: Mapping[str, float]) -> GaitProblem:
        """Return the same problem at a point of a grid: parameters, variables and other bounded quantities have a value."""
        fixed = {name: value for name, value in coordinates.items() if name in self.names}
        values: dict[str, float] = {}
        for name in coordinates.keys() - fixed:
            bounds = {f"{name}.lower", f"{name}.upper"}  # of a quantity that follows from the variables
            values |= dict.fromkeys(bounds if bounds <= self.parameter_values.keys() else {name}, coordinates[name])
        return self.with_values(**values).fix(**fixed)

    def dense(self, factor: int) -> GaitProblem | None:
        """Return the same problem with ``factor`` times as many intervals; None if it cannot be refined."""
        if (refine := self.refine) is None:
            return None
        return self._cache.get((refine, factor), lambda: refine(factor)).with_values(**self.values)

    def derive(
        self,
        *,
        name: str = "",
        title: str = "",
        objective: Objective | None = None,
        variables: Sequence[Variable] = (),
        parameters: Sequence[Parameter] = (),
        change: Change | None = None,
    ) -> GaitProblem:
        """Return a problem with other mathematics; time histories, start points and denser grids are adapted.

        ``change`` makes the new assembly from this problem's, the point of all variables and parameters, and the interpretation
        of non-smooth operations; ``objective`` is its name, unit and sense if that is replaced. Variables and parameters are
        added after the present ones; an empty name or title keeps the present one.
        """

        def assemble(point: Point, ops: Nonsmooth) -> Assembly:
            assembly = self.assemble(point.select(self.names), ops)
            return assembly if change is None else change(assembly, point, ops)

        def start(parameters: Mapping[str, float], rng: np.random.Generator) -> Array:
            draw = self.hints.start or partial(draw_uniform, self.names)
            values = draw(parameters, rng)
            return np.concatenate([values, draw_uniform([variable.name for variable in variables], parameters, rng)])

        def refine(factor: int) -> GaitProblem:
            finer = self.dense(factor)
            assert finer is not None  # for the type checker
            return finer.derive(
                name=name, title=title, objective=objective, variables=variables, parameters=parameters, change=change
            )

        motion = self.display.motion
        return replace(
            self,
            name=name or self.name,
            title=title or self.title,
            objective=objective or self.objective,
            variables=(*self.variables, *variables),
            own_parameters=(*self.own_parameters, *parameters),
            assemble=assemble,
            refine=None if self.refine is None else refine,
            rows_over_time=self.rows_over_time if change is None and not variables else (),
            least_power=self.least_power if change is None and not variables else None,
            display=replace(
                self.display, motion=None if motion is None else lambda point: motion(point.select(self.names))
            ),
            hints=replace(self.hints, start=start if self.hints.start is not None or variables else None),
            loaded_as="" if name else self.loaded_as,
        )

    @lock_casadi
    def signals(self, x: Sequence[float] | Array | Mapping[str, float]) -> Signals:
        """Return time histories at x (n,) and the current parameter values; InputError for a wrong x, or if there are none."""
        if self.display.motion is None:
            raise InputError(f"problem {self.name!r} has no time histories")
        return self.display.motion(self.at(x))

    @lock_casadi
    def at(self, x: Sequence[float] | Array | Mapping[str, float]) -> NumericPoint:
        """Return the point x (n,) with the current parameter values, in numbers."""
        return NumericPoint.of(DM(self.check_x(x)), DM(self.p), self.names, [q.name for q in self.parameters])

    @cached_property
    def parameter_values(self) -> dict[str, float]:
        """Current values by name."""
        return dict(zip((q.name for q in self.parameters), self.p.tolist(), strict=True))

    @lock_casadi
    def start_point(self, rng: np.random.Generator) -> Array:
        """Return a start point (n,) for a gradient method, within the bounds."""
        if self.hints.start is not None:
            return np.clip(self.hints.start(self.parameter_values, rng), self.lower, self.upper)
        return rng.uniform(self.lower, self.upper)

    def variable_index(self, name: str) -> int:
        """Return the position of a variable in x; raises UnknownNameError."""
        if not isinstance(name, str) or name not in self.names:
            raise unknown(f"variable of {self.name}", name, self.names)
        return self.names.index(name)

    def check_x(self, x: Sequence[float] | Array | Mapping[str, float]) -> Array:
        """Return floats (n,) from values in order or by name; InputError if one is missing, unknown or not finite."""
        if isinstance(x, Mapping):
            missing = [name for name in self.names if name not in x]
            if missing or len(x) > len(self.names):
                extra = [name for name in x if name not in self.names]
                raise InputError(
                    f"x of {self.name} must name every variable once; missing: {', '.join(missing) or 'none'}, "
                    f"unknown: {', '.join(map(str, extra)) or 'none'}"
                )
            x = [x[name] for name in self.names]
        array = to_floats(f"x of {self.name}", x)
        if array.shape != (len(self.names),):
            wanted = f"{len(self.names)} values ({', '.join(self.names)})"
            raise InputError(f"x of {self.name} must have {wanted}, got shape {array.shape}")
        for name, value in zip(self.names, array, strict=True):
            if not math.isfinite(value):
                raise InputError(f"x of {self.name}: {name} must be finite, got {value}")
        return array

    def check_within(self, x: Sequence[float] | Array | Mapping[str, float]) -> Array:
        """Return ``check_x`` clipped to bounds that it misses by rounding; raises InputError as that, and outside the bounds."""
        array = self.check_x(x)
        violation = np.maximum(self.lower - array, array - self.upper)
        outside = np.flatnonzero((violation > ROUNDING * self.scale) & (self.lower < self.upper))
        if outside.size:
            i = outside[0]
            raise InputError(
                f"x0 of {self.name}: {self.names[i]} is {array[i]:g}, outside its bounds [{self.lower[i]:g}, "
                f"{self.upper[i]:g}] {self.variables[i].unit} by {violation[i]:.2g}; start within them, or widen them"
            )
        return np.clip(array, self.lower, self.upper)

    def by_name(self, x: Array) -> dict[str, float]:
        """Return values of x by variable name."""
        return dict(zip(self.names, (float(v) for v in x), strict=True))

    @lock_casadi
    def symbols(self) -> Point:
        """Return new symbols for x and p."""
        parameters = [q.name for q in self.parameters]
        return Point.of(MX.sym("x", len(self.names)), MX.sym("p", len(parameters)), self.names, parameters)

    def with_origin(self, make: Callable[..., GaitProblem], options: Mapping[str, Any]) -> GaitProblem:
        """Return the same problem, pickled as ``make`` with these options."""
        return self._copy((make, dict(options)))

    def _copy(self, origin: Origin | None, **changes: Any) -> GaitProblem:
        """Return a copy with the same mathematics, so that it shares what is built from it."""
        copy = replace(self, **changes)
        object.__setattr__(copy, "_cache", self._cache)
        object.__setattr__(copy, "_origin", origin)
        return copy

    def __copy__(self) -> GaitProblem:  # it cannot be changed
        return self

    def __deepcopy__(self, memo: object) -> GaitProblem:
        return self

    def __reduce__(self) -> tuple[Callable[..., GaitProblem], tuple[Any, ...]]:
        make, options = self._origin or (None, {})
        if make is None or "<locals>" in getattr(make, "__qualname__", ""):
            raise InputError(
                f"problem {self.name!r} cannot be pickled: only unchanged problems of a module-level @maker function can; "
                "make it in the other process, or write a maker"
            )
        return _unpickle, (make, options, dict(self.values), repr(self.display.robot))

    def build_once(self, build: Callable[Concatenate[GaitProblem, P], T], *arguments: P.args, **named: P.kwargs) -> T:
        """Return ``build(self, ...)``, computed once for all copies that differ in parameter values only.

        ``build`` is a function of a module or class; it reads the mathematics, not the parameter values. Arguments are hashable.
        """
        key = (build, arguments, tuple(sorted(named.items())))
        return self._cache.get(key, lambda: build(self, *arguments, **named))

    def _parameter(self, name: str) -> Parameter:
        if isinstance(name, str):
            for parameter in self.parameters:
                if parameter.name == name:
                    return parameter
            if name in self.options:
                raise UnknownNameError(
                    f"{name!r} is an option of {self.name}, not a parameter: another value is another problem; "
                    f"load it with --set {name}=VALUE, or load({self.name!r}, {name}=VALUE)"
                )
            if name in self.with_other_options:
                option = self.with_other_options[name]
                raise UnknownNameError(
                    f"{name!r} is no parameter of {self.name} with these options; add --set {option}"
                )
        raise unknown(f"parameter of {self.name}", name, [q.name for q in self.parameters])


def _unpickle(
    make: Callable[..., GaitProblem], options: Mapping[str, Any], values: Mapping[str, float], robot: str
) -> GaitProblem:
    return _make_again(make, tuple(sorted(options.items())), robot).with_values(**values)


@lock_casadi
@lru_cache(maxsize=16)  # so that copies of one problem share what is built
def _make_again(make: Callable[..., GaitProblem], options: tuple[tuple[str, Any], ...], robot: str) -> GaitProblem:
    problem = make(**dict(options))
    if repr(problem.display.robot) != robot:
        raise InputError(f"problem {problem.name!r}: the file of its robot has changed since the problem was pickled")
    return problem


def draw_uniform(names: Sequence[str], parameters: Mapping[str, float], rng: np.random.Generator) -> Array:
    """Draw values (n,) of variables uniformly within the bounds that the parameters have."""
    return rng.uniform(*(np.array([parameters[f"{name}.{end}"] for name in names]) for end in ("lower", "upper")))


def _frozen(values: Sequence[float]) -> Array:
    array = np.array(values, dtype=float)
    array.setflags(write=False)
    return array


def _format_table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Return aligned columns of the first rows."""
    lines = [header, *rows[:MOST_ROWS]]
    widths = [max(len(line[i]) for line in lines) for i in range(len(header))]
    text = ["  ".join(cell.ljust(width) for cell, width in zip(line, widths, strict=True)).rstrip() for line in lines]
    more = [f"and {len(rows) - MOST_ROWS:,} more"] if len(rows) > MOST_ROWS else []
    return "\n".join([*text, *more])
