"""Protocols of objectives and algorithms for the loop of several objectives."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Protocol

import numpy as np

from metaheuristics.array import Array
from metaheuristics.errors import SearchError
from metaheuristics.interface import Bounded, Start


class ManyObjectives(Bounded, Protocol):
    """Objectives to be minimised within bounds, called on many points at once.

    It may separate its constraints by `inequalities` and `groups`, see `metaheuristics.interface.Constraints`.
    """

    @property
    def count(self) -> int:
        """Number of objectives, m."""

    def __call__(self, X: Array, /) -> tuple[Array, Array]:
        """Objectives (P, m), finite and all of comparable size, and total violations (P,) of points (P, n)."""


class FrontSearch(Protocol):
    """A run in progress: `ask`, evaluate, `tell`, and again; `front` at any time between."""

    def ask(self) -> Array:
        """Points (P, n) within the bounds: a generation, or one point where each is learned from at once."""

    def tell(self, X: Array, F: Array, violation: Array, /) -> None:
        """Learn from the points of the last `ask`: objectives (P, m), violations (P,), 1e30 where an evaluation failed."""

    def front(self) -> tuple[Array, Array]:
        """Return the nondominated feasible members (k, n) of the population and their objectives (k, m)."""


class FrontAlgorithm(Protocol):
    """Settings of an algorithm for several objectives, immutable."""

    @property
    def name(self) -> str:
        """Short name, as in `FRONT_ALGORITHMS`."""

    @property
    def population(self) -> int:
        """Number of starting points that it wants."""

    def start(self, start: Start, objectives: int, /) -> FrontSearch:
        """Begin a run for a number of objectives.

        Raises:
            SearchError: a setting that it cannot work with.
        """


def check_budgets(algorithm: FrontAlgorithm, evaluations: Sequence[int]) -> None:
    """Check the budgets at which snapshots are taken.

    Raises:
        SearchError: they do not rise, or the first one is less than a generation.
    """
    budgets = list(evaluations)
    if not budgets or budgets != sorted(set(budgets)) or budgets[0] < algorithm.population:
        raise SearchError(
            f"evaluations must rise and begin with at least the population of {algorithm.population}, got {budgets}"
        )


def feasible_front(X: Array, F: Array, violation: Array) -> tuple[Array, Array]:
    """Return the nondominated points among those without violation (P,), of points (P, n) with objectives (P, m)."""
    from pymoo.util.nds.non_dominated_sorting import NonDominatedSorting

    feasible = np.flatnonzero(violation == 0.0)
    best = NonDominatedSorting().do(F[feasible], only_non_dominated_front=True) if len(feasible) else []
    chosen = feasible[np.asarray(best, dtype=int)]
    return X[chosen], F[chosen]
