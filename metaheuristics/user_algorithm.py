"""User code as an algorithm: settings, a class or function that makes them, or a plain function."""

import inspect
import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, is_dataclass, replace
from threading import Event, Thread, get_ident
from typing import Any

import numpy as np

from metaheuristics.errors import SearchError
from metaheuristics.interface import Algorithm, Array, CallingSearch, Ended, Evaluate, Rule, Start, to_real_array
from metaheuristics.preparation import check_population

ARGUMENTS = ("f", "lower", "upper", "evaluations", "seed")
# Value of an infeasible point under feasibility rules for a function that expects one number: more than any objective.
INFEASIBLE = 1e9
FAILED = 1e30
GRACE_S = 1.0  # for a function to return after its run


def to_algorithm(user: Any, name: str, settings: Mapping[str, Any] | None = None) -> Algorithm:
    """Return the algorithm that an object is or makes.

    Args:
        user: an `Algorithm`; a class or function that makes one from keyword settings; or a plain function
            `minimise(f, lower, upper, evaluations, seed)`, see `PlainFunction`.
        name: its name in messages.
        settings: that differ from its defaults.

    Raises:
        SearchError: the object is of no such kind, does not take the settings, or its population is no whole number >= 1.
    """
    settings = dict(settings or {})
    algorithm: Any
    if hasattr(user, "start") and not isinstance(user, type):
        if settings and not (is_dataclass(user) and not isinstance(user, type)):
            raise SearchError(
                f"algorithm {name!r} takes no settings, got {', '.join(settings)}: it is not a data class"
            )
        algorithm = replace(user, **settings) if settings else user
    elif callable(user) and not isinstance(user, type) and takes_function_arguments(user, settings):
        algorithm = PlainFunction(function=user, name=name, settings=settings)
    elif callable(user):
        try:
            inspect.signature(user).bind(**settings)
        except (TypeError, ValueError) as error:
            wanted = f"a plain function takes ({', '.join(ARGUMENTS)}); a class or function of settings takes them by keyword"
            raise SearchError(f"{name!r} cannot be called as an algorithm: {error}; {wanted}") from error
        algorithm = user(**settings)
    else:
        algorithm = user
    if not callable(getattr(algorithm, "start", None)):
        raise SearchError(
            f"{name!r} must be an algorithm with `population` and `start`, or a plain function of ({', '.join(ARGUMENTS)}); "
            f"got {type(algorithm).__name__}"
        )
    check_population(algorithm, name)
    instance: Algorithm = algorithm
    return instance


@dataclass(frozen=True, kw_only=True)
class PlainFunction:
    """A function `minimise(f, lower, upper, evaluations, seed)` that minimises `f` by itself.

    The loop counts the calls of `f`, from any thread, keeps the best point, and ends the function within a call once a limit is
    reached; its return value is ignored. A function that continues nevertheless is left alone, as is one that calls no `f` until
    the time limit.

    `f(x)` of one point (n,) is a float, `f(X)` of many (P, n) an array (P,). It is one number for objective and constraints: the
    objective where a point is feasible, and 1e9 plus the violation elsewhere, so that its order is Deb's; under a static penalty
    it is objective plus weighted violation. 1e30 marks a failed evaluation.

    Raises:
        SearchError: the function does not take these arguments.
    """

    function: Callable[..., object]  #: to call
    name: str  #: in reports
    settings: Mapping[str, Any] = field(default_factory=dict)  #: further keyword arguments
    population: int = 1  #: as a function has no first generation

    def __post_init__(self) -> None:
        if not takes_function_arguments(self.function, self.settings):
            raise SearchError(
                f"function {self.name!r} must take ({', '.join(ARGUMENTS)})"
                + (f" and the settings {', '.join(self.settings)}" if self.settings else "")
                + f"; it takes {inspect.signature(self.function)}"
            )

    def start(self, start: Start) -> "_FunctionSearch":
        """Begin a run; see `Algorithm.start`."""
        return _FunctionSearch(self, start)


def takes_function_arguments(function: Callable[..., object], settings: Mapping[str, Any]) -> bool:
    """Return whether a function can be called as `PlainFunction` calls it."""
    try:
        inspect.signature(function).bind(*ARGUMENTS, **settings)
    except (TypeError, ValueError):
        return False
    return True


def combine(f: Array, violation: Array, rule: Rule) -> Array:
    """Return one number (P,) for objective and constraints that orders points as the rule does; see `PlainFunction`."""
    major, minor = rule.keys(f, violation)
    return np.where(np.isfinite(f), np.where(major > 0.0, INFEASIBLE + major, minor), FAILED)


class _FunctionSearch(CallingSearch):
    """A run of a function, in a thread of its own, which cannot outlast the run."""

    def __init__(self, settings: PlainFunction, start: Start) -> None:
        self._settings, self._start = settings, start
        self._over, self._left = Event(), Event()  # the run, and the function
        self._error: BaseException | None = None
        self._ended = False  # by the run

    def run(self, evaluate: Evaluate) -> str:
        thread = Thread(target=self._call, args=(evaluate,), name=self._settings.name, daemon=True)
        thread.start()
        if not self._over.wait(self._start.time_limit_s):
            return "time limit reached"
        self._left.wait(GRACE_S)
        if self._error is not None and not self._ended:
            raise self._error
        return "the function returned"

    def _call(self, evaluate: Evaluate) -> None:
        start, settings = self._start, self._settings
        lower, upper, seed = start.lower.copy(), start.upper.copy(), int(start.rng.integers(2**31))
        try:
            settings.function(self._make_f(evaluate), lower, upper, start.evaluations, seed, **settings.settings)
        except BaseException as error:
            self._error = error
        self._left.set()
        self._over.set()

    def _make_f(self, evaluate: Evaluate) -> Callable[[Any], Any]:
        shape, owner, point = self._start.lower.shape, get_ident(), evaluate.point

        def f(x: Any) -> Any:
            try:
                if point is not None and type(x) is np.ndarray and x.dtype == np.float64 and x.shape == shape:
                    value, violation = point(x)
                    return FAILED if math.isinf(value) else value if violation <= 0.0 else INFEASIBLE + violation
                points = self._read_points(x)
                cost = combine(*evaluate(np.array(points, ndmin=2)))
                return float(cost[0]) if points.ndim == 1 else cost
            except Ended:
                if self._ended and get_ident() == owner:  # it continues, perhaps for ever
                    self._left.set()
                    Event().wait()
                self._ended = True
                self._over.set()
                raise

        return f

    def _read_points(self, x: Any) -> Array:
        n = len(self._start.lower)
        try:
            points = to_real_array(x)
        except (TypeError, ValueError) as error:
            raise SearchError(f"f was called with something other than numbers: {error}") from error
        if points.ndim not in (1, 2) or points.shape[-1] != n or not points.size:
            raise SearchError(f"f takes one point of shape ({n},) or points of shape (P, {n}); got {points.shape}")
        return points
