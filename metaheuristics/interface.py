"""Protocols of objectives and algorithms for the loop in `minimize.py`.

The loop owns everything that must be equal for all algorithms: the starting points, the count of evaluations, the
marking of failed evaluations, the constraint handling and the record. An algorithm only proposes points (`ask`) and
learns from them (`tell`), so an adapter to another package is a small class with these two methods.
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from dataclasses import dataclass
from typing import Generic, Protocol, TypeVar

import numpy as np

from metaheuristics.array import Array
from metaheuristics.constraint_handling import Rule

Settings = TypeVar("Settings")


class Bounded(Protocol):
    """Variables with bounds, which are read once, before the first call."""

    @property
    def names(self) -> tuple[str, ...]:
        """The n names of the variables."""

    @property
    def lower(self) -> Array:
        """(n,) lower bounds, finite."""

    @property
    def upper(self) -> Array:
        """(n,) upper bounds, finite and >= lower; equal bounds fix a variable."""


class BatchObjective(Bounded, Protocol):
    """An objective to be minimised within bounds, called on many points at once."""

    def __call__(self, X: Array, /) -> tuple[Array, Array]:
        """Return objective values (P,) and total violations (P,) of points (P, n) within the bounds; P varies.

        A violation is >= 0, and zero if and only if the point is feasible. NaN or infinity in either value marks the
        evaluation as failed. X is read-only.
        """


@dataclass(frozen=True, kw_only=True, eq=False, slots=True)
class Constraints:
    """Separate constraints of an objective that provides them; see `Start`.

    An objective provides them by the attributes `inequalities` and `groups`, as here.

    Attributes:
        inequalities: Values (P, m) of m rows at points (P, n) within the bounds; a row is satisfied where its value is
            <= 0. Called only for points that are also evaluated; does not count as an evaluation.
        groups: (m,) the constraint that each row belongs to; rows of one constraint are adjacent.
    """

    inequalities: Callable[[Array], Array]
    groups: tuple[str, ...]

    def worst(self, X: Array) -> Array:
        """Return the greatest value (P, c) within each constraint at points (P, n); 1e30 where it is not finite."""
        first = [k for k, name in enumerate(self.groups) if k == 0 or name != self.groups[k - 1]]
        values = np.nan_to_num(self.inequalities(X), nan=UNKNOWN, posinf=UNKNOWN, neginf=-UNKNOWN)
        return np.asarray(np.maximum.reduceat(values, first, axis=1))


UNKNOWN = 1e30  # value of a row without a finite value


@dataclass(frozen=True, kw_only=True, eq=False, slots=True)
class Start:
    """Inputs of an algorithm at the start of a run.

    Attributes:
        lower: (n,) lower bounds, read-only.
        upper: (n,) upper bounds, read-only.
        initial: (P, n) starting points, read-only; P is the population of the algorithm. The first `ask` returns them.
        evaluations: Budget of the run, a hint for algorithms that plan ahead.
        rng: The only source of randomness of the search.
        constraints: Separate constraints, for searches that use them; None where only the total violation is available.
        names: The n names of the variables.
    """

    lower: Array
    upper: Array
    initial: Array
    evaluations: int
    rng: np.random.Generator
    constraints: Constraints | None = None
    names: tuple[str, ...] = ()

    def inequalities(self, X: Array, violation: Array) -> Array:
        """Return each constraint's value (P, c) at points (P, n); without `constraints`, the violation (P,) as the only one."""
        if self.constraints is not None:
            return self.constraints.worst(X)
        return np.nan_to_num(violation, nan=UNKNOWN, posinf=UNKNOWN)[:, None]


class Search(Protocol):
    """A run in progress: `ask`, evaluate, `tell`, `stop`, and again."""

    def ask(self) -> Array:
        """Return points (P, n) within the bounds; P may vary. The search must not change the array afterwards."""

    def tell(self, X: Array, f: Array, violation: Array, rule: Rule, /) -> None:
        """Learn from the points of the last `ask`.

        Called with whole generations only: when the budget cuts one short, or a stopping criterion is met, the run
        ends without this call.

        Args:
            X: (P, n) points of the last `ask`.
            f: (P,) objective values; infinity where the evaluation failed, never NaN.
            violation: (P,) total constraint violations; infinity where the evaluation failed, never NaN.
            rule: The only way to compare points, valid for this generation: a rule may tighten as the run proceeds.
        """

    def stop(self) -> tuple[str, ...]:
        """Return reasons in words why the search cannot usefully continue; empty to continue."""


class PopulationSearch(Generic[Settings]):
    """Base of searches that store the points of the next `ask`, the starting points first; subclasses add `tell`."""

    def __init__(self, settings: Settings, start: Start) -> None:
        """Store the starting points."""
        self._settings = settings
        self._start = start
        self._X = start.initial

    def ask(self) -> Array:
        """Return the stored points (P, n)."""
        return self._X

    def stop(self) -> tuple[str, ...]:
        """Return no reason: the search continues until the budget ends."""
        return ()


class Algorithm(Protocol):
    """Settings of a search algorithm, immutable; each `start` begins an independent run.

    Settings that are not allowed raise SearchError, as does a package that is not installed.
    """

    @property
    def name(self) -> str:
        """Short name, as in the registry."""

    @property
    def population(self) -> int:
        """Number of starting points."""

    def start(self, start: Start, /) -> Search:
        """Begin a run with bounds, starting points, budget and generator."""


# Evaluates points (P, n) as a generation; raises `Ended` once the run is over.
Evaluate = Callable[[Array], tuple[Array, Array, Rule]]


class Ended(BaseException):
    """End of a run; not an `Exception`, so that no optimiser treats it as a failed evaluation."""


class CallingSearch(ABC):
    """Base of searches that call the objective instead of being asked; see `minimize`."""

    @abstractmethod
    def run(self, evaluate: Evaluate) -> str:
        """Call `evaluate` until it raises `Ended`; return the reason if the search ends by itself."""
