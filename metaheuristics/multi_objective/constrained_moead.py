"""C-MOEA/D: decomposition into scalar problems, with constraints."""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from metaheuristics.interface import Array, Start
from metaheuristics.multi_objective.variation import Variation, make_directions, select_feasible_front
from metaheuristics.settings import check_count, check_installed, check_number


@dataclass(frozen=True, kw_only=True, slots=True)
class ConstrainedMoead:
    """C-MOEA/D: each member of the population solves one scalar problem, and learns from its neighbours.

    A scalar problem is a direction from the least objectives seen so far, feasible or not, and its value the distance along
    it plus a penalty for the distance from it. A child of two neighbours takes the place of neighbours that violate more, or
    as much at no better a value.

    Source:
        Jain, Deb (2014), An evolutionary many-objective optimization algorithm using reference-point-based nondominated
        sorting approach, part II, IEEE Transactions on Evolutionary Computation 18(4), 602-622; Zhang, Li (2007), MOEA/D.
        Implemented from PlatEMO, not from the paper; the defaults are PlatEMO's.
    """

    population: int = 100  #: members, a number of evenly spread directions; any number from 2 on for two objectives
    #: members that count as near, T, the member itself among them; None for a tenth of the population
    neighbours: int | None = None
    #: neighbours whose place a child may take, n_r; None for a hundredth of the population, at least one
    replaced: int | None = None
    #: probability that parents, and the places, are those of neighbours; else of the whole population
    near: float = 0.9
    penalty: float = 5.0  #: theta of penalty boundary intersection
    #: of simulated binary crossover; the larger, the nearer are children to their parents
    crossover_index: float = 20.0
    mutation_index: float = 20.0  #: of polynomial mutation, likewise
    name: ClassVar[str] = "CMOEAD"

    def __post_init__(self) -> None:
        check_count(self, "population", at_least=2)
        if self.neighbours is not None:
            check_count(self, "neighbours", at_least=2, at_most=self.population)
        if self.replaced is not None:
            check_count(self, "replaced", at_least=1, at_most=self.population)
        check_number(self, "near", at_least=0.0, at_most=1.0)
        check_number(self, "penalty", at_least=0.0)
        check_number(self, "crossover_index", "mutation_index", at_least=3.0, at_most=30.0)
        check_installed(self.name, "pymoo")

    def start(self, start: Start, objectives: int) -> "ConstrainedMoeadSearch":
        return ConstrainedMoeadSearch(self, start, objectives)


def find_places_to_take(
    old: Array, new: Array, violation: Array, child_violation: float, places: NDArray[np.intp], most: int
) -> NDArray[np.intp]:
    """Return the places that a child takes, at most so many, in the order in which they are offered (P,).

    The members there have old values (P,), each for its own scalar problem, and violations (P,); the child has new values (P,).

    Source:
        Jain, Deb (2014), C-MOEA/D, as in PlatEMO.
    """
    better = ((new <= old) & (violation == child_violation)) | (child_violation < violation)
    return places[np.flatnonzero(better)[:most]]


class ConstrainedMoeadSearch:
    """A run of `ConstrainedMoead`; see `FrontSearch`. Each child is evaluated and learned from before the next one is made."""

    def __init__(self, settings: ConstrainedMoead, start: Start, objectives: int) -> None:
        from pymoo.decomposition.pbi import PBI

        self._settings, self._start = settings, start
        self._weights = make_directions(settings.population, objectives)
        distance = np.linalg.norm(self._weights[:, None] - self._weights, axis=2)
        near = max(2, -(-settings.population // 10)) if settings.neighbours is None else settings.neighbours
        self._neighbours = np.argsort(distance, axis=1, kind="stable")[:, :near]
        self._most = -(-settings.population // 100) if settings.replaced is None else settings.replaced
        self._values: Any = PBI(theta=settings.penalty)
        self._vary = Variation(start, settings.crossover_index, settings.mutation_index)
        self._X = np.array(start.initial)
        self._F = np.empty((0, objectives))
        self._violation = np.empty(0)
        self._ideal = np.empty(0)
        self._turn = 0
        self._places: NDArray[np.intp] = np.arange(0)

    def ask(self) -> Array:
        if not len(self._F):
            return self._X
        rng = self._start.rng
        near = rng.random() < self._settings.near
        self._places = rng.permutation(self._neighbours[self._turn] if near else len(self._X))
        first, second = self._places[:2]
        return self._vary(self._X[[first]], self._X[[second]], one_child=True)

    def tell(self, X: Array, F: Array, violation: Array) -> None:
        if not len(self._F):
            self._F, self._violation, self._ideal = np.array(F), np.array(violation), F.min(axis=0)
            return
        self._ideal = np.minimum(self._ideal, F[0])
        weights, places = self._weights[self._places], self._places
        old = self._values.do(self._F[places], weights=weights, ideal_point=self._ideal, _type="one_to_one")
        new = self._values.do(F[0], weights=weights, ideal_point=self._ideal, _type="one_to_many")
        won = find_places_to_take(old, new, self._violation[places], float(violation[0]), places, self._most)
        self._X[won], self._F[won], self._violation[won] = X[0], F[0], violation[0]
        self._turn = (self._turn + 1) % len(self._X)

    def front(self) -> tuple[Array, Array]:
        return select_feasible_front(self._X, self._F, self._violation)
