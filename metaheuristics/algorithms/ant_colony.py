"""Ant colony optimisation: on continuous variables, with an archive of good points as pheromone, and on a grid of levels."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from metaheuristics.errors import check_count, check_number
from metaheuristics.interface import Array, Points, PopulationSearch, Rule, Start


@dataclass(frozen=True, kw_only=True, slots=True)
class AntColony:
    """ACO_R: ants sample Gaussians centred on the best points found so far.

    An ant picks one archived point, better ones more often, and samples each variable around it with a deviation
    proportional to the mean distance of the archived points from it. The best of archive and ants form the next
    archive. Samples beyond a bound are put on it. The rotation of axes that the source adds for non-separable
    problems is left out, and the archive fills up from the shared starting points instead of `archive` random ones.

    Source:
        Socha, Dorigo (2008), Ant colony optimization for continuous domains, section 3.
    """

    population: int = 30  #: Number of ants, and of starting points
    archive: int = 50  #: Number of points kept (k)
    #: Reach of the preference for the best, as a share of the archive (q); small is greedy
    locality: float = 0.1
    #: Deviation in mean distances (xi). It acts as evaporation does in a discrete colony (Socha, Dorigo): the higher, the less
    #: the search is bound to where it has been, and the slower it converges. An evaporation rate of 0.7, as in Bhardwaj et al.,
    #: Table IV, is thus naturally `spread=0.7`
    spread: float = 0.85
    name: ClassVar[str] = "aco"

    def __post_init__(self) -> None:
        check_count(self, "population", at_least=2)
        check_count(self, "archive", at_least=2)
        check_number(self, "locality", "spread", above=0.0)

    def start(self, start: Start) -> "_AntColonySearch":
        return _AntColonySearch(self, start)


def compute_probabilities(count: int, locality: float) -> Array:
    """Return the probabilities (k,) that an ant picks each point of an archive sorted best first.

    They fall as a half Gaussian of deviation q k over the rank, with k the count and q the locality.

    Source:
        Socha, Dorigo (2008), the weights omega_l and their normalisation; the common factor 1 / (q k sqrt(2 pi))
        cancels.
    """
    weights = np.exp(-0.5 * (np.arange(count) / (locality * count)) ** 2)
    probabilities: Array = weights / weights.sum()
    return probabilities


def compute_deviations(archive: Array, picked: Array, spread: float) -> Array:
    """Return standard deviations (m, n): mean distance of the archive (k, n) from picked members (m, n), times the spread.

    Source:
        Socha, Dorigo (2008), sigma = xi sum_e |s_e - s_l| / (k - 1).
    """
    distance: Array = np.abs(archive - picked[:, None, :]).sum(axis=1)
    return spread / (len(archive) - 1) * distance


class _AntColonySearch(PopulationSearch[AntColony]):
    def __init__(self, settings: AntColony, start: Start) -> None:
        super().__init__(settings, start)
        self._archive = Points.none(start.initial.shape[1])

    def tell(self, X: Array, f: Array, violation: Array, rule: Rule) -> None:
        settings, start = self._settings, self._start
        self._archive = self._archive.join(Points(X, f, violation)).best(settings.archive, rule)
        archived = self._archive.X
        cumulative = np.cumsum(compute_probabilities(len(archived), settings.locality))
        draws = start.rng.random(settings.population) * cumulative[-1]
        picked = archived[np.searchsorted(cumulative, draws, side="right")]
        step = compute_deviations(archived, picked, settings.spread) * start.rng.standard_normal(picked.shape)
        self._X = np.clip(picked + step, start.lower, start.upper)

    def stop(self) -> tuple[str, ...]:
        archived = self._archive.X
        return ("archive collapsed to one point",) if len(archived) and bool((archived == archived[0]).all()) else ()


@dataclass(frozen=True, kw_only=True, slots=True)
class AntColonyGrid:
    """Discrete ant colony: each ant picks a level of each variable in proportion to its pheromone.

    Pheromone evaporates, then the best point so far and the best ants of the generation deposit by rank. The amounts
    are scaled so that the pheromone of a variable stays a probability. A small share of all choices is uniform, which
    bounds pheromone from below and keeps the search alive at high evaporation. The answer is no finer than the grid.

    Source:
        Bullnheimer, Hartl, Strauss (1999), A new rank based version of the ant system (deposits); Blum, Dorigo (2004),
        The hyper-cube framework (scaling); Stuetzle, Hoos (2000), MAX-MIN ant system (lower bound).
    """

    #: Number of ants, and of starting points (which lie anywhere and deposit on the nearest level)
    population: int = 30
    levels: int = 101  #: Number of levels of each variable, bounds included
    #: Share of pheromone lost in a generation. 0.7 is the value of Bhardwaj et al., Table IV
    evaporation: float = 0.7
    depositors: int = 6  #: Points that deposit: the best so far and the best ants of the generation
    exploration: float = 0.1  #: Share of choices made regardless of pheromone
    name: ClassVar[str] = "aco-grid"

    def __post_init__(self) -> None:
        check_count(self, "population", at_least=1)
        check_count(self, "levels", at_least=2)
        check_number(self, "evaporation", above=0.0, at_most=1.0)
        check_count(self, "depositors", at_least=1, at_most=self.population + 1)
        check_number(self, "exploration", at_least=0.0, at_most=1.0)

    def start(self, start: Start) -> "_AntColonyGridSearch":
        return _AntColonyGridSearch(self, start)


def renew(pheromone: Array, chosen: NDArray[np.intp], weights: Array, evaporation: float) -> Array:
    """Return pheromone (n, L) after evaporation and deposits; each row remains a probability over L levels.

    Deposits on the levels (D, n) that some points chose, by weights (D,) >= 0 that are not all zero, replace the share that
    evaporates.

    Source:
        Blum, Dorigo (2004), update rule of the hyper-cube framework.
    """
    renewed = (1.0 - evaporation) * pheromone
    share = evaporation * weights / weights.sum()
    np.add.at(renewed, (np.arange(len(pheromone)), chosen), share[:, None])
    return renewed


def pick(probability: Array, u: Array) -> NDArray[np.intp]:
    """Return the levels (P, n), 0..L-1, that random numbers u (P, n) in [0, 1) pick by weights (n, L)."""
    cumulative = np.cumsum(probability, axis=1)
    passed = cumulative <= (u * cumulative[:, -1])[:, :, None]
    levels: NDArray[np.intp] = passed.sum(axis=2)  # below L, for u times the total is rounded to less than the total
    return levels


class _AntColonyGridSearch(PopulationSearch[AntColonyGrid]):
    def __init__(self, settings: AntColonyGrid, start: Start) -> None:
        super().__init__(settings, start)
        self._best = Points.none(start.initial.shape[1])
        self._pheromone = np.full((start.initial.shape[1], settings.levels), 1.0 / settings.levels)
        self._spacing = (start.upper - start.lower) / (settings.levels - 1)

    def tell(self, X: Array, f: Array, violation: Array, rule: Rule) -> None:
        settings, start = self._settings, self._start
        ants = Points(X, f, violation).best(settings.depositors, rule)
        self._best = self._best.join(ants).best(1, rule)
        depositors = self._best.join(ants.take(slice(settings.depositors - 1)))
        ranks = settings.depositors - np.arange(len(depositors.f))
        weights = np.where(np.isfinite(depositors.f), ranks, 0.0)  # failed evaluations leave no trace
        if weights.any():
            spacing = np.where(self._spacing > 0.0, self._spacing, 1.0)
            chosen = np.rint((depositors.X - start.lower) / spacing).astype(np.intp)
            self._pheromone = renew(self._pheromone, chosen, weights, settings.evaporation)
        probability = (1.0 - settings.exploration) * self._pheromone + settings.exploration / settings.levels
        levels = pick(probability, start.rng.random((settings.population, X.shape[1])))
        self._X = np.clip(start.lower + levels * self._spacing, start.lower, start.upper)
