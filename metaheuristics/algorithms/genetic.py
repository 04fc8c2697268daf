"""Real-coded genetic algorithm, with its crossovers and mutations.

An operator is a frozen dataclass of settings that draws random numbers; its formula is a pure function of them.
"""

from collections.abc import Callable
from dataclasses import dataclass, field
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from metaheuristics.errors import bad_setting, check_count, check_number
from metaheuristics.interface import Array, Points, PopulationSearch, Rule, Start

_CLOSE = 1e-14  # parents nearer than this share of the range count as equal, as in Deb's code


Crossover = Callable[[Array, Array, Array, Array, np.random.Generator], tuple[Array, Array]]
"""Makes two children (M, n) within the bounds (n,) of each row of parents A and the same row of B, (M, n) each."""
Mutation = Callable[[Array, Array, Array, np.random.Generator], Array]
"""Changes points (P, n) at random, within the bounds (n,); returns a new array."""


def cross_simulated_binary(
    A: Array, B: Array, lower: Array, upper: Array, index: float, u: Array
) -> tuple[Array, Array]:
    """Return the lower and the upper child (M, n) in each variable of parents A and B (M, n), within the bounds (n,).

    Where the parents are equal, so are the children. A larger distribution index keeps children nearer to the parents. Random
    numbers u (M, n) are in [0, 1).

    Source:
        Deb, Agrawal (1995), Simulated binary crossover; bounded form as in Deb's NSGA-II code (crossover.c).
    """
    low, high = np.minimum(A, B), np.maximum(A, B)
    gap = high - low
    apart = gap > _CLOSE * (upper - lower)
    safe_gap = np.where(apart, gap, 1.0)

    def spread(room: Array) -> Array:
        alpha = 2.0 - (1.0 + 2.0 * room / safe_gap) ** -(index + 1.0)
        inner = u * alpha
        return np.where(inner <= 1.0, inner, 1.0 / (2.0 - inner)) ** (1.0 / (index + 1.0))

    middle = 0.5 * (low + high)
    first = np.clip(middle - 0.5 * spread(low - lower) * gap, lower, upper)
    second = np.clip(middle + 0.5 * spread(upper - high) * gap, lower, upper)
    return np.where(apart, first, low), np.where(apart, second, high)


def mutate_polynomially(X: Array, lower: Array, upper: Array, index: float, u: Array) -> Array:
    """Return points X (P, n) shifted by polynomially distributed steps within the bounds (n,).

    A larger distribution index makes smaller steps. Random numbers u (P, n) are in [0, 1); 0.5 makes no step.

    Source:
        Deb, Goyal (1996), A combined genetic adaptive search; bounded form as in Deb's NSGA-II code (mutation.c).
    """
    width = upper - lower
    power = index + 1.0
    down = u <= 0.5
    room = np.where(down, X - lower, upper - X) / np.where(width > 0.0, width, 1.0)
    half = np.where(down, u, 1.0 - u)
    step = 1.0 - (2.0 * half + (1.0 - 2.0 * half) * (1.0 - room) ** power) ** (1.0 / power)
    return np.clip(X + np.where(down, -step, step) * width, lower, upper)


@dataclass(frozen=True, kw_only=True, slots=True)
class SimulatedBinary:
    """Simulated binary crossover (SBX)."""

    index: float = 2.0  #: distribution index
    probability: float = 0.9  #: chance that a pair is crossed at all
    #: Chance that a variable of a crossed pair is; it also exchanges sides with chance 0.5
    variable_probability: float = 0.5

    def __post_init__(self) -> None:
        check_number(self, "index", at_least=0.0)
        check_number(self, "probability", "variable_probability", at_least=0.0, at_most=1.0)

    def __call__(self, A: Array, B: Array, lower: Array, upper: Array, rng: np.random.Generator) -> tuple[Array, Array]:
        u, choice, side = rng.random((3, *A.shape))
        low, high = cross_simulated_binary(A, B, lower, upper, self.index, u)
        crossed = (rng.random((len(A), 1)) < self.probability) & (choice < self.variable_probability)
        swap = side < 0.5
        return np.where(crossed, np.where(swap, low, high), A), np.where(crossed, np.where(swap, high, low), B)


@dataclass(frozen=True, kw_only=True, slots=True)
class SinglePoint:
    """Single-point crossover: from a random position on, two parents exchange their variables."""

    probability: float = 0.8  #: chance that a pair is crossed; with one variable there is nothing to exchange

    def __post_init__(self) -> None:
        check_number(self, "probability", at_least=0.0, at_most=1.0)

    def __call__(self, A: Array, B: Array, lower: Array, upper: Array, rng: np.random.Generator) -> tuple[Array, Array]:
        pairs, n = A.shape
        cut = 1 + np.floor(rng.random((pairs, 1)) * (n - 1))  # 1..n-1
        tail = (rng.random((pairs, 1)) < self.probability) & (np.arange(n) >= cut)
        return np.where(tail, B, A), np.where(tail, A, B)


@dataclass(frozen=True, kw_only=True, slots=True)
class Polynomial:
    """Polynomial mutation."""

    index: float = 20.0  #: distribution index
    probability: float | None = None  #: chance that a variable mutates; None for 1 / n

    def __post_init__(self) -> None:
        check_number(self, "index", at_least=0.0)
        if self.probability is not None:
            check_number(self, "probability", at_least=0.0, at_most=1.0)

    def __call__(self, X: Array, lower: Array, upper: Array, rng: np.random.Generator) -> Array:
        u, choice = rng.random((2, *X.shape))
        probability = 1.0 / X.shape[1] if self.probability is None else self.probability
        return np.where(choice < probability, mutate_polynomially(X, lower, upper, self.index, u), X)


@dataclass(frozen=True, kw_only=True, slots=True)
class Flip:
    """Mutation that mirrors a variable at the middle of its range.

    Source:
        Goswami, Vadakkepat, Phung (2008), section 5.4: s -> (0.05 + 0.13) - s.
    """

    probability: float = 0.1  #: chance that a variable mutates

    def __post_init__(self) -> None:
        check_number(self, "probability", at_least=0.0, at_most=1.0)

    def __call__(self, X: Array, lower: Array, upper: Array, rng: np.random.Generator) -> Array:
        flipped = np.clip(lower + upper - X, lower, upper)  # the clip only removes rounding
        return np.where(rng.random(X.shape) < self.probability, flipped, X)


@dataclass(frozen=True, kw_only=True, slots=True)
class GeneticAlgorithm:
    """Genetic algorithm on real vectors: tournament selection, crossover, mutation, survival.

    The constraint rule decides tournaments and survival.

    Source:
        Deb (2000), An efficient constraint handling method for genetic algorithms. Operators and indices (2 and 20)
        as in Gupta, Pratihar, Deb (2023), section 5; the paper is silent on survival and probabilities.
    """

    population: int = 50  #: Number of parents, and of children in a generation
    tournament: int = 2  #: Parents that compete for each place among those that mate
    crossover: Crossover = field(default=SimulatedBinary())  #: Operator on pairs
    mutation: Mutation = field(default=Polynomial())  #: Operator on children
    #: "plus" keeps the best of parents and children, without copies (as pymoo's GA does); "generational" replaces the parents
    #: by the children, except for the elites
    survival: Literal["plus", "generational"] = "plus"
    elites: int = 1  #: Best parents that replace the worst children in "generational" survival
    name: ClassVar[str] = "ga"

    def __post_init__(self) -> None:
        check_count(self, "population", at_least=2)
        check_count(self, "tournament", at_least=1, at_most=self.population)
        check_count(self, "elites", at_least=0, at_most=self.population - 1)
        if self.survival not in ("plus", "generational"):
            raise bad_setting(self, "survival", "'plus' or 'generational'")
        for name in ("crossover", "mutation"):
            if not callable(getattr(self, name)):
                raise bad_setting(self, name, "an operator of metaheuristics.algorithms.genetic or alike")

    def start(self, start: Start) -> "_GeneticSearch":
        return _GeneticSearch(self, start)


@dataclass(frozen=True, kw_only=True, slots=True)
class GoswamiGeneticAlgorithm(GeneticAlgorithm):
    """Genetic algorithm of the 12-joint walk's paper; its 30 epochs after the first population are 930 evaluations.

    The paper names neither the size of a tournament nor survival nor elites; 2, generational and 1 are our choice.

    Source:
        Goswami, Vadakkepat, Phung (2008), Table II and section 5.4.
    """

    population: int = 30  #: Number of parents, and of children in a generation
    crossover: Crossover = field(default=SinglePoint(probability=0.8))  #: Operator on pairs
    mutation: Mutation = field(default=Flip(probability=0.1))  #: Operator on children
    #: "generational" replaces the parents by the children, except for the elites; "plus" keeps the best of both
    survival: Literal["plus", "generational"] = "generational"
    name: ClassVar[str] = "ga-goswami"


def hold_tournaments(places: int, population: int, size: int, rng: np.random.Generator) -> NDArray[np.intp]:
    """Return the winners (places,) of tournaments among parents sorted best first, so that the lowest index wins.

    Competitors, `size` in each, are drawn by shuffling all parents repeatedly: each competes equally often, except for a
    remainder.
    """
    shuffles = -(-places * size // population)
    competitors = rng.random((shuffles, population)).argsort(axis=1).ravel()[: places * size]
    winners: NDArray[np.intp] = competitors.reshape(places, size).min(axis=1)
    return winners


class _GeneticSearch(PopulationSearch[GeneticAlgorithm]):
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
            survivors = children.best(settings.population - len(elites.f), rule)
            self._parents = elites.join(survivors).best(settings.population, rule)
        self._X = self._mate()

    def _mate(self) -> Array:
        """Make as many children as there are parents."""
        settings, start = self._settings, self._start
        pairs = -(-settings.population // 2)
        winners = hold_tournaments(2 * pairs, len(self._parents.f), settings.tournament, start.rng)
        mating = self._parents.X[winners]
        crossed = settings.crossover(mating[0::2], mating[1::2], start.lower, start.upper, start.rng)
        children = np.concatenate(crossed)[: settings.population]
        return settings.mutation(children, start.lower, start.upper, start.rng)
