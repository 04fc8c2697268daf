"""How new points are made, directions spread and fronts found, by pymoo's operators."""

from itertools import count
from math import comb

import numpy as np

from metaheuristics.errors import SearchError
from metaheuristics.interface import Array, Start
from metaheuristics.preparation import fill_fixed


class Variation:
    """Simulated binary crossover of pairs, then polynomial mutation of each variable with probability 1 / n."""

    def __init__(self, start: Start, crossover_index: float, mutation_index: float) -> None:
        from pymoo.core.problem import Problem
        from pymoo.operators.crossover.sbx import SBX
        from pymoo.operators.mutation.pm import PM

        self._start = start
        self._free = np.flatnonzero(start.upper > start.lower)
        lower, upper = start.lower[self._free], start.upper[self._free]
        self._problem = Problem(n_var=len(lower), n_obj=1, xl=lower, xu=upper)
        self._cross, self._mutate = SBX(prob=1.0, eta=crossover_index), PM(prob=1.0, eta=mutation_index)

    def __call__(self, first: Array, second: Array, one_child: bool = False) -> Array:
        """Return the children (2 P, n) of pairs (P, n), first children before second ones; or the first ones alone (P, n)."""
        from pymoo.core.population import Population

        parents = Population.new("X", np.concatenate([first, second])[:, self._free])
        pairs = np.arange(2 * len(first)).reshape(2, -1).T
        children = self._cross.do(self._problem, parents, pairs, random_state=self._start.rng)
        if one_child:
            children = children[: len(first)]
        children = self._mutate.do(self._problem, children, random_state=self._start.rng)
        return fill_fixed(children.get("X").astype(float), self._start.lower, self._start.upper)


def make_directions(number: int, objectives: int) -> Array:
    """Evenly spread reference directions (number, objectives), after Das and Dennis.

    Raises:
        SearchError: There is no even spread of so many.
    """
    from pymoo.util.ref_dirs import get_reference_directions

    parts = next(parts for parts in count(1) if _spread(parts, objectives) >= number)
    if _spread(parts, objectives) != number:
        raise SearchError(
            f"population must be a number of evenly spread directions for {objectives} objectives, got {number}; the "
            f"nearest ones are {_spread(parts - 1, objectives)} and {_spread(parts, objectives)}"
        )
    spread: Array = get_reference_directions("das-dennis", objectives, n_partitions=parts)
    return spread


def _spread(parts: int, objectives: int) -> int:
    """Number of directions whose coordinates are whole numbers of equal parts."""
    return comb(parts + objectives - 1, objectives - 1)


def select_feasible_front(X: Array, F: Array, violation: Array) -> tuple[Array, Array]:
    """Return the nondominated points among those without violation (P,), of points (P, n) with objectives (P, m)."""
    from pymoo.util.nds.non_dominated_sorting import NonDominatedSorting

    feasible = np.flatnonzero(violation == 0.0)
    best = NonDominatedSorting().do(F[feasible], only_non_dominated_front=True) if len(feasible) else []
    chosen = feasible[np.asarray(best, dtype=int)]
    return X[chosen], F[chosen]
