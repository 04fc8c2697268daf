"""DCNSGA-III: NSGA-III whose constraints tighten as the run proceeds."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from metaheuristics.interface import UNKNOWN, Array, Start
from metaheuristics.multi_objective.variation import Variation, make_directions, select_feasible_front
from metaheuristics.settings import check_count, check_installed, check_number

LEAST = 1e-8  # boundary at which the last generation arrives, z


@dataclass(frozen=True, kw_only=True, slots=True)
class DynamicConstrainedNsga3:
    """DCNSGA-III: the mean violation is an objective more, and what counts as feasible tightens generation by generation.

    A point is within the boundary if no constraint is violated by more than epsilon, which falls from the greatest violation in
    the first generation to zero at the end of the budget. Where more points are within it than the population holds, they are
    sorted by all objectives and the violation, and thinned out along reference directions as in NSGA-III; else those of least
    violation stay.

    Source:
        Jiao, Zeng, Li, Yang, Ong (2021), Handling constrained many-objective optimization problems via problem
        transformation, IEEE Transactions on Cybernetics 51(10), 4834-4847. Implemented from its first
        author's code, not from the paper (RuwangJiao/DCNSGA-III, and the one in PlatEMO), whose defaults these are.
    """

    population: int = 100  #: members, a number of evenly spread directions; any number from 2 on for two objectives
    decrease: float = 5.0  #: speed at which the boundary falls (cp)
    #: of simulated binary crossover; the larger, the nearer are children to their parents
    crossover_index: float = 20.0
    mutation_index: float = 20.0  #: of polynomial mutation, likewise
    name: ClassVar[str] = "DCNSGA3"

    def __post_init__(self) -> None:
        check_count(self, "population", at_least=2)
        check_number(self, "decrease", above=0.0)
        check_number(self, "crossover_index", "mutation_index", at_least=3.0, at_most=30.0)
        check_installed(self.name, "pymoo")

    def start(self, start: Start, objectives: int) -> "_DynamicNsga3Search":
        return _DynamicNsga3Search(self, start, objectives)


def compute_boundary(first: Array, generation: int, generations: int, decrease: float) -> Array:
    """Return the violation (c,) allowed for each constraint, from `first` (c,) > 0 at generation 0 to 0 at the last one.

    The larger `decrease` (cp), the later it falls.

    Source:
        Jiao et al. (2021): E exp(-(k / B)^cp) - z with B = K / ln((E + z) / z)^(1 / cp), as their code has it.
    """
    fall = np.log((first + LEAST) / LEAST) * (generation / max(generations, 1)) ** decrease
    return np.asarray(np.maximum(0.0, first * np.exp(-fall) - LEAST))


class _DynamicNsga3Search:
    def __init__(self, settings: DynamicConstrainedNsga3, start: Start, objectives: int) -> None:
        self._settings, self._start = settings, start
        self._directions = make_directions(settings.population, objectives)
        self._vary = Variation(start, settings.crossover_index, settings.mutation_index)
        # The starting points are the first of the generations that fit into the budget.
        self._last = max(1, start.evaluations // settings.population - 1)
        self._generation = 0
        self._next = start.initial
        # X, objectives, total violations and violations of each constraint of the members
        self._members: tuple[Array, ...] = ()
        self._first = np.empty(0)

    def ask(self) -> Array:
        return self._next

    def tell(self, X: Array, F: Array, violation: Array) -> None:
        violations = np.maximum(0.0, self._start.inequalities(X, violation))
        told = (np.array(X), np.array(F), np.array(violation), violations)
        if not self._members:
            self._members = told
            largest = np.where(violations < UNKNOWN, violations, 0.0).max(axis=0)
            self._first = np.where(largest > 0.0, largest, 1.0)
        else:
            self._members = tuple(np.concatenate(pair) for pair in zip(self._members, told, strict=True))
            chosen = self._select(self._epsilon())
            self._members = tuple(part[chosen] for part in self._members)
        self._generation += 1
        self._next = self._make_children()

    def front(self) -> tuple[Array, Array]:
        return select_feasible_front(*self._members[:3])

    def _epsilon(self) -> Array:
        return compute_boundary(self._first, self._generation, self._last, self._settings.decrease)

    def _make_children(self) -> Array:
        """Return children of winners of binary tournaments on the violation beyond the boundary."""
        count, rng, (X, *_, violations) = self._settings.population, self._start.rng, self._members
        beyond_boundary = np.maximum(0.0, violations - self._epsilon()).sum(axis=1)
        drawn = rng.integers(len(X), size=(2 * -(-count // 2), 2))
        pool = np.where(beyond_boundary[drawn[:, 0]] <= beyond_boundary[drawn[:, 1]], drawn[:, 0], drawn[:, 1])
        half = len(pool) // 2
        return self._vary(X[pool[:half]], X[pool[half:]])[:count]

    def _select(self, epsilon: Array) -> NDArray[np.intp]:
        """Return the positions of the members that survive."""
        size, (_, F, _, violations) = self._settings.population, self._members
        mean = (violations / self._first).mean(axis=1)
        within = np.flatnonzero((violations <= epsilon).all(axis=1))
        if len(within) <= size:
            return np.argsort(mean, kind="stable")[:size]
        from pymoo.util.nds.non_dominated_sorting import NonDominatedSorting

        F = F[within]
        fronts = NonDominatedSorting().do(np.column_stack([F, mean[within]]), n_stop_if_ranked=size)
        sure = np.concatenate([*fronts[:-1], np.empty(0, dtype=int)]).astype(int)
        last = np.asarray(fronts[-1], dtype=int)
        if len(sure) + len(last) > size:
            last = last[self._spread(F, sure, last, size - len(sure))]
        chosen: NDArray[np.intp] = within[np.concatenate([sure, last])]
        return chosen

    def _spread(self, F: Array, sure: NDArray[np.intp], last: NDArray[np.intp], count: int) -> list[int]:
        """Select members of the last front by NSGA-III's niches; the ideal point is that of all."""
        from pymoo.algorithms.moo.nsga3 import (
            associate_to_niches,
            calc_niche_count,
            get_extreme_points_c,
            get_nadir_point,
            niching,
        )

        ideal, candidates = F.min(axis=0), F[np.concatenate([sure, last])]
        worst = candidates.max(axis=0)
        nadir = get_nadir_point(get_extreme_points_c(candidates, ideal), ideal, worst.copy(), worst, worst)
        niche, distance, _ = associate_to_niches(candidates, self._directions, ideal, nadir)
        crowd = calc_niche_count(len(self._directions), niche[: len(sure)])
        of_last = slice(len(sure), None)
        return list(niching(last, count, crowd, niche[of_last], distance[of_last], random_state=self._start.rng))
