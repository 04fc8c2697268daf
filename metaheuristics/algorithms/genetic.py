"""Real-coded genetic algorithm."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from metaheuristics.algorithms.genetic_operators import (
    Crossover,
    Flip,
    Mutation,
    Polynomial,
    SimulatedBinary,
    SinglePoint,
)
from metaheuristics.algorithms.points import Points
from metaheuristics.array import Array
from metaheuristics.constraint_handling import Rule
from metaheuristics.interface import PopulationSearch, Start
from metaheuristics.settings import bad_setting, check_count


@dataclass(frozen=True, kw_only=True, slots=True)
class GeneticAlgorithm:
    """Genetic algorithm on real vectors: tournament selection, crossover, mutation, survival.

    The constraint rule decides tournaments and survival.

    Attributes:
        population: Number of parents, and of children in a generation.
        tournament: Parents that compete for each place among those that mate.
        crossover: Operator on pairs.
        mutation: Operator on children.
        survival: "plus" keeps the best of parents and children, without copies (as pymoo's GA does); "generational"
            replaces the parents by the children, except for the elites.
        elites: Best parents that replace the worst children in "generational" survival.

    Source:
        Deb (2000), An efficient constraint handling method for genetic algorithms. Operators and indices (2 and 20)
        as in Gupta, Pratihar, Deb (2023), section 5; the paper is silent on survival and probabilities.
    """

    population: int = 50
    tournament: int = 2
    crossover: Crossover = field(default=SimulatedBinary())
    mutation: Mutation = field(default=Polynomial())
    survival: Literal["plus", "generational"] = "plus"
    elites: int = 1
    name: ClassVar[str] = "ga"

    def __post_init__(self) -> None:
        check_count(self, "population", at_least=2)
        check_count(self, "tournament", at_least=1, at_most=self.population)
        check_count(self, "elites", at_least=0, at_most=self.population - 1)
        if self.survival not in ("plus", "generational"):
            raise bad_setting(self, "survival", "'plus' or 'generational'")
        for name in ("crossover", "mutation"):
            if not callable(getattr(self, name)):
                raise bad_setting(self, name, "an operator of metaheuristics.algorithms.genetic_operators or alike")

    @classmethod
    def goswami2008(cls) -> GeneticAlgorithm:
        """Give the settings of the 12-link walking paper; 30 epochs after the first population are 930 evaluations.

        The paper names neither the size of a tournament nor survival nor elites; 2, generational and 1 are our choice.

        Source:
            Goswami, Vadakkepat, Phung (2008), Table II and section 5.4.
        """
        return cls(
            population=30,
            crossover=SinglePoint(probability=0.8),
            mutation=Flip(probability=0.1),
            survival="generational",
        )

    def start(self, start: Start) -> GeneticSearch:
        return GeneticSearch(self, start)


def tournaments(places: int, population: int, size: int, rng: np.random.Generator) -> NDArray[np.intp]:
    """Return the winners (places,) of tournaments among parents sorted best first, so that the lowest index wins.

    Competitors, `size` in each, are drawn by shuffling all parents repeatedly: each competes equally often, except for a
    remainder.
    """
    shuffles = -(-places * size // population)
    competitors = rng.random((shuffles, population)).argsort(axis=1).ravel()[: places * size]
    winners: NDArray[np.intp] = competitors.reshape(places, size).min(axis=1)
    return winners


class GeneticSearch(PopulationSearch[GeneticAlgorithm]):
    """A run of `GeneticAlgorithm`; see `Search`."""

    def __init__(self, settings: GeneticAlgorithm, start: Start) -> None:
        super().__init__(settings, start)
        self._parents = Points.none(start.initial.shape[1])

    def tell(self, X: Array, f: Array, violation: Array, rule: Rule) -> None:
        settings = self._settings
        children = Points(X, f, violation)
        if settings.survival == "plus":
            self._parents = self._parents.join(children).best_distinct(settings.population, rule)
        else:
            elites = self._parents.best(settings.elites, rule)
            rest = children.best(settings.population - len(elites.f), rule)
            self._parents = elites.join(rest).best(settings.population, rule)
        self._X = self._mate()

    def _mate(self) -> Array:
        """Make as many children as there are parents."""
        settings, start = self._settings, self._start
        pairs = -(-settings.population // 2)
        winners = tournaments(2 * pairs, len(self._parents.f), settings.tournament, start.rng)
        mating = self._parents.X[winners]
        crossed = settings.crossover(mating[0::2], mating[1::2], start.lower, start.upper, start.rng)
        children = np.concatenate(crossed)[: settings.population]
        return settings.mutation(children, start.lower, start.upper, start.rng)
