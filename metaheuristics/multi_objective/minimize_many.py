"""Several objectives: protocols of objectives and algorithms, and the loop, which takes snapshots on the way."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from time import process_time
from typing import Any, Protocol

import numpy as np

from metaheuristics.errors import SearchError
from metaheuristics.interface import UNKNOWN, Array, Bounded, Start
from metaheuristics.preparation import prepare_start, seed_sequence


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
    """Settings of an algorithm for several objectives, immutable; SearchError as for `metaheuristics.interface.Algorithm`."""

    @property
    def name(self) -> str:
        """Short name, as in `FRONT_ALGORITHMS`."""

    @property
    def population(self) -> int:
        """Number of starting points that it wants."""

    def start(self, start: Start, objectives: int, /) -> FrontSearch:
        """Begin a run for a number of objectives; SearchError for a setting that it cannot work with."""


def check_budgets(algorithm: FrontAlgorithm, evaluations: Sequence[int]) -> None:
    """Raise SearchError unless the budgets of snapshots rise and the first holds a generation."""
    budgets = list(evaluations)
    if not budgets or budgets != sorted(set(budgets)) or budgets[0] < algorithm.population:
        raise SearchError(
            f"evaluations must rise and begin with at least the population of {algorithm.population}, got {budgets}"
        )


@dataclass(frozen=True, kw_only=True, eq=False, slots=True)
class Snapshot:
    """Feasible points of a run that no other point of its population betters in all objectives."""

    evaluations: int  #: used until then
    feasible: int  #: of these, without violation
    first_feasible: int | None  #: the first of these, counted from 1; None until there is one
    time_s: float  #: processor time until then [s]
    objective_time_s: float  #: part of it spent in the objectives [s]
    X: Array  #: (k, n) points; none as long as the population has no feasible one
    F: Array  #: (k, m) objectives


def minimize_many(
    objectives: ManyObjectives,
    algorithm: FrontAlgorithm,
    *,
    evaluations: Sequence[int] = (10_000,),
    seed: int = 0,
    progress: Callable[[int], None] = lambda used: None,
) -> tuple[Snapshot, ...]:
    """Run an algorithm once and take a snapshot at each budget.

    For an algorithm that does not know its budget each snapshot equals a run of that budget; DCNSGA3 plans for the last one.

    Args:
        objectives: what to minimise.
        algorithm: settings.
        evaluations: budgets, rising; each at least the population. Of the last generation before each only whole ones count.
        seed: of starting points and search; equal seeds start alike whatever the algorithm.
        progress: called with the evaluations used after each generation.

    Returns:
        A snapshot for each budget.

    Raises:
        SearchError: an argument is not allowed, all variables are fixed, or an objective is not finite.
    """
    check_budgets(algorithm, evaluations)
    budgets = list(evaluations)
    start = prepare_start(objectives, algorithm.population, budgets[-1], seed_sequence(seed))
    if not (start.upper > start.lower).any():
        raise SearchError("all variables are fixed, so there is no front; widen the bounds of one")
    began, in_objectives = process_time(), 0.0
    search = algorithm.start(start, objectives.count)

    snapshots: list[Snapshot] = []
    used = feasible = 0
    first: int | None = None
    while True:
        X = search.ask()
        while budgets and used + len(X) > budgets[0]:
            points, values = search.front()
            counts: dict[str, Any] = {"evaluations": used, "feasible": feasible, "first_feasible": first}
            counts |= {"time_s": process_time() - began, "objective_time_s": in_objectives}
            snapshots.append(Snapshot(**counts, X=points, F=values))
            budgets.pop(0)
        if not budgets:
            return tuple(snapshots)
        called = process_time()
        F, violation = objectives(X)
        in_objectives += process_time() - called
        if not np.all(np.isfinite(F)):
            raise SearchError("an objective is not finite; give a large finite number where it has no value")
        # A violation that is not finite counts as the worst.
        violation = np.nan_to_num(violation, nan=UNKNOWN, posinf=UNKNOWN)
        good = np.flatnonzero(violation == 0.0)
        if first is None and len(good):
            first = used + int(good[0]) + 1
        feasible += len(good)
        search.tell(X, F, violation)
        used += len(X)
        progress(used)
