"""A plain function, any library's optimiser within, as a search algorithm."""

from __future__ import annotations

import inspect
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from metaheuristics.array import Array, real_array
from metaheuristics.constraint_handling import Rule
from metaheuristics.errors import SearchError
from metaheuristics.interface import Start

ARGUMENTS = ("f", "lower", "upper", "evaluations", "seed")
# What a function that must be told one number sees of an infeasible point under feasibility rules: more than any objective.
INFEASIBLE = 1e9
FAILED = 1e30

# Evaluates points (P, n) as a generation; raises `Ended` once the run is over.
Evaluate = Callable[[Array], tuple[Array, Array, Rule]]


class Ended(BaseException):
    """The run is over; no `Exception`, so that no optimiser takes it for a failed evaluation."""


@dataclass(frozen=True, kw_only=True)
class PlainFunction:
    """A function `minimise(f, lower, upper, evaluations, seed)` that looks for the least value of `f` by itself.

    The loop counts the calls of `f`, keeps the best point, and ends the function within a call once a limit is reached; what
    it returns is not needed. `f(x)` of one point (n,) is a float, `f(X)` of many (P, n) an array (P,). It is one number for
    objective and constraints: the objective where a point is feasible, and 1e9 plus the violation elsewhere, so that its order
    is Deb's; under a static penalty it is objective plus weighted violation. 1e30 marks a failed evaluation.

    Attributes:
        function: to call.
        name: in reports.
        settings: further keyword arguments.
        population: of the first generation, which a function does not have.

    Raises:
        SearchError: the function does not take these arguments.
    """

    function: Callable[..., object]
    name: str
    settings: Mapping[str, Any] = field(default_factory=dict)
    population: int = 1

    def __post_init__(self) -> None:
        if not takes_function_arguments(self.function, self.settings):
            raise SearchError(
                f"function {self.name!r} must take ({', '.join(ARGUMENTS)})"
                + (f" and the settings {', '.join(self.settings)}" if self.settings else "")
                + f"; it takes {inspect.signature(self.function)}"
            )

    def start(self, start: Start) -> FunctionSearch:
        """Begin a run; see `Algorithm.start`."""
        return FunctionSearch(self, start)


def takes_function_arguments(function: Callable[..., object], settings: Mapping[str, Any]) -> bool:
    """Whether a function can be called as `PlainFunction` calls it."""
    try:
        inspect.signature(function).bind(*ARGUMENTS, **settings)
    except (TypeError, ValueError):
        return False
    return True


class CallingSearch(ABC):
    """Base of searches that are not asked but call; see `minimize`."""

    @abstractmethod
    def run(self, evaluate: Evaluate) -> str:
        """Call `evaluate` until it raises `Ended`; to return says why the search ended by itself."""


class FunctionSearch(CallingSearch):
    """A run of `PlainFunction`."""

    def __init__(self, settings: PlainFunction, start: Start) -> None:
        self._settings = settings
        self._start = start

    def run(self, evaluate: Evaluate) -> str:
        """Call the function; it returns, or `evaluate` raises `Ended`. Says why it ended if it returned."""
        n = len(self._start.lower)

        def f(x: Any) -> Any:
            try:
                points = real_array(x)
            except (TypeError, ValueError) as error:
                raise SearchError(f"f was called with something other than numbers: {error}") from error
            if points.ndim not in (1, 2) or points.shape[-1] != n or not points.size:
                raise SearchError(f"f takes one point of shape ({n},) or points of shape (P, {n}); got {points.shape}")
            values, violation, rule = evaluate(np.array(points, ndmin=2))
            major, minor = rule.keys(values, violation)
            told = np.where(np.isfinite(values), np.where(major > 0.0, INFEASIBLE + major, minor), FAILED)
            return float(told[0]) if points.ndim == 1 else told

        start, settings = self._start, self._settings
        lower, upper = start.lower.copy(), start.upper.copy()
        settings.function(f, lower, upper, start.evaluations, int(start.rng.integers(2**31)), **settings.settings)
        return "the function returned"
