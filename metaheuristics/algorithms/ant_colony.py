"""Ant colony optimisation on continuous variables, with an archive of good points as pheromone."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from metaheuristics.algorithms.points import Points
from metaheuristics.array import Array
from metaheuristics.constraint_handling import Rule
from metaheuristics.interface import PopulationSearch, Start
from metaheuristics.settings import check_count, check_number


@dataclass(frozen=True, kw_only=True, slots=True)
class AntColony:
    """ACO_R: ants sample Gaussians centred on the best points found so far.

    An ant picks one archived point, better ones more often, and samples each variable around it with a deviation
    proportional to the mean distance of the archived points from it. The best of archive and ants form the next
    archive. Samples beyond a bound are put on it. The rotation of axes that the source adds for non-separable
    problems is left out, and the archive fills up from the shared starting points instead of `archive` random ones.

    Attributes:
        population: Number of ants, and of starting points.
        archive: Number of points kept (k).
        locality: Reach of the preference for the best, as a share of the archive (q); small is greedy.
        spread: Deviation in mean distances (xi). It acts as evaporation does in a discrete colony (Socha, Dorigo):
            the higher, the less the search is bound to where it has been, and the slower it converges. An evaporation
            rate of 0.7, as in Bhardwaj et al., Table IV, is thus naturally `spread=0.7`.

    Source:
        Socha, Dorigo (2008), Ant colony optimization for continuous domains, section 3.
    """

    population: int = 30
    archive: int = 50
    locality: float = 0.1
    spread: float = 0.85
    name: ClassVar[str] = "aco"

    def __post_init__(self) -> None:
        check_count(self, "population", at_least=2)
        check_count(self, "archive", at_least=2)
        check_number(self, "locality", "spread", above=0.0)

    def start(self, start: Start) -> AntColonySearch:
        return AntColonySearch(self, start)


def kernel_probabilities(count: int, locality: float) -> Array:
    """Return the probabilities (k,) that an ant picks each point of an archive sorted best first.

    They fall as a half Gaussian of deviation q k over the rank, with k the count and q the locality.

    Source:
        Socha, Dorigo (2008), the weights omega_l and their normalisation; the common factor 1 / (q k sqrt(2 pi))
        cancels.
    """
    weights = np.exp(-0.5 * (np.arange(count) / (locality * count)) ** 2)
    probabilities: Array = weights / weights.sum()
    return probabilities


def deviations(archive: Array, picked: Array, spread: float) -> Array:
    """Return standard deviations (m, n): mean distance of the archive (k, n) from picked members (m, n), times the spread.

    Source:
        Socha, Dorigo (2008), sigma = xi sum_e |s_e - s_l| / (k - 1).
    """
    distance: Array = np.abs(archive - picked[:, None, :]).sum(axis=1)
    return spread / (len(archive) - 1) * distance


class AntColonySearch(PopulationSearch[AntColony]):
    """A run of `AntColony`; see `Search`."""

    def __init__(self, settings: AntColony, start: Start) -> None:
        super().__init__(settings, start)
        self._archive = Points.none(start.initial.shape[1])

    def tell(self, X: Array, f: Array, violation: Array, rule: Rule) -> None:
        settings, start = self._settings, self._start
        self._archive = self._archive.join(Points(X, f, violation)).best(settings.archive, rule)
        known = self._archive.X
        cumulative = np.cumsum(kernel_probabilities(len(known), settings.locality))
        draws = start.rng.random(settings.population) * cumulative[-1]
        picked = known[np.searchsorted(cumulative, draws, side="right")]
        step = deviations(known, picked, settings.spread) * start.rng.standard_normal(picked.shape)
        self._X = np.clip(picked + step, start.lower, start.upper)

    def stop(self) -> tuple[str, ...]:
        known = self._archive.X
        return ("archive collapsed to one point",) if len(known) and bool((known == known[0]).all()) else ()
