"""What the loop in `minimize.py` needs of an objective and of an algorithm.

The loop owns everything that must be equal for all algorithms: the starting points, the count of evaluations, the
marking of failed evaluations, the constraint handling and the record. An algorithm only proposes points (`ask`) and
learns from them (`tell`), so an adapter to another package is a small class with these two methods.
"""

from __future__ import annotations

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
        """Evaluate points.

        Args:
            X: (P, n) points within the bounds, read-only. P varies from call to call.

        Returns:
            (P,) objective values, and (P,) total constraint violations: >= 0, and zero if and only if the point is
            feasible. A NaN or an infinite value in either marks the evaluation of that point as failed.
        """


@dataclass(frozen=True, kw_only=True, eq=False, slots=True)
class Constraints:
    """The constraints of an objective one by one, where it can tell them apart; see `Start`.

    An objective has them if it has the attributes `excess` and `groups`, as here.

    Attributes:
        excess: Of points (P, n) within the bounds, by how much each of m rows is exceeded, (P, m): a row is met where it is
            <= 0. It is asked for points that are evaluated anyhow, and counts no evaluation.
        groups: (m,) the constraint that each row belongs to; rows of one constraint stand together.
    """

    excess: Callable[[Array], Array]
    groups: tuple[str, ...]

    def worst(self, X: Array) -> Array:
        """(P, c) the greatest excess within each constraint, of points (P, n); 1e30 where it has no finite value."""
        first = [k for k, name in enumerate(self.groups) if k == 0 or name != self.groups[k - 1]]
        excess = np.nan_to_num(self.excess(X), nan=UNKNOWN, posinf=UNKNOWN, neginf=-UNKNOWN)
        return np.asarray(np.maximum.reduceat(excess, first, axis=1))


UNKNOWN = 1e30  # excess of a row that has no finite value


@dataclass(frozen=True, kw_only=True, eq=False, slots=True)
class Start:
    """All that an algorithm is given at the start of a run.

    Attributes:
        lower: (n,) lower bounds, read-only.
        upper: (n,) upper bounds, read-only.
        initial: (P, n) starting points, read-only; P is the population of the algorithm. The first `ask` returns them.
        evaluations: Budget of the run, a hint for algorithms that plan ahead.
        rng: The only source of randomness of the search.
        constraints: One by one, for searches that learn from each; None where only their total violation is known.
    """

    lower: Array
    upper: Array
    initial: Array
    evaluations: int
    rng: np.random.Generator
    constraints: Constraints | None = None

    def excess(self, X: Array, violation: Array) -> Array:
        """(P, c) excess of each constraint at points (P, n); without `constraints`, the violation (P,) as the only one."""
        if self.constraints is not None:
            return self.constraints.worst(X)
        return np.nan_to_num(violation, nan=UNKNOWN, posinf=UNKNOWN)[:, None]


class Search(Protocol):
    """A run in progress: `ask`, evaluate, `tell`, `stop`, and again."""

    def ask(self) -> Array:
        """Propose points.

        Returns:
            (P, n) points within the bounds. The search must not change the array afterwards; P may vary.
        """

    def tell(self, X: Array, f: Array, violation: Array, rule: Rule, /) -> None:
        """Learn from the points asked last.

        The loop tells whole generations only: when the budget cuts one short, or any stopping criterion holds, the
        run ends without telling, as nothing would be asked afterwards.

        Args:
            X: (P, n) points of the last `ask`.
            f: (P,) objective values; infinity where the evaluation failed, never NaN.
            violation: (P,) total constraint violations; infinity where the evaluation failed, never NaN.
            rule: The only way to compare points, valid for this generation: a rule may tighten as the run proceeds.
        """

    def stop(self) -> tuple[str, ...]:
        """Say why the search cannot usefully go on.

        Returns:
            Reasons in words; empty to go on.
        """


class PopulationSearch(Generic[Settings]):
    """Base of searches that hold the points to ask for, the starting points first; `tell` is theirs."""

    def __init__(self, settings: Settings, start: Start) -> None:
        """Hold the starting points."""
        self._settings = settings
        self._start = start
        self._X = start.initial

    def ask(self) -> Array:
        """Return the points held, (P, n)."""
        return self._X

    def stop(self) -> tuple[str, ...]:
        """Return no reason: the search goes on until the budget ends."""
        return ()


class Algorithm(Protocol):
    """Settings of a search algorithm, immutable; each `start` begins an independent run."""

    @property
    def name(self) -> str:
        """Short name, as in the registry."""

    @property
    def population(self) -> int:
        """Number of starting points that it wants."""

    def start(self, start: Start, /) -> Search:
        """Begin a run.

        Args:
            start: Bounds, starting points, budget and generator.

        Returns:
            The search, ready to be asked.
        """
