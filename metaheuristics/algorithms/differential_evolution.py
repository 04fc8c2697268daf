"""Differential evolution."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from metaheuristics.algorithms.points import Points
from metaheuristics.array import Array
from metaheuristics.constraint_handling import Rule
from metaheuristics.interface import PopulationSearch, Start
from metaheuristics.settings import bad_setting, check_count, check_number

# Mutants (P, n) of the members x (P, n), the best member (n,), others drawn for each member r (5, P, n), and the weight F.
MUTATIONS: Mapping[str, Callable[[Array, Array, Array, float], Array]] = {
    "best1": lambda x, best, r, F: best + F * (r[0] - r[1]),
    "best2": lambda x, best, r, F: best + F * (r[0] + r[1] - r[2] - r[3]),
    "currenttobest1": lambda x, best, r, F: x + F * (best - x + r[0] - r[1]),
    "rand1": lambda x, best, r, F: r[0] + F * (r[1] - r[2]),
    "rand2": lambda x, best, r, F: r[0] + F * (r[1] + r[2] - r[3] - r[4]),
    "randtobest1": lambda x, best, r, F: r[0] + F * (best - r[0]) + F * (r[1] - r[2]),
}
STRATEGIES = tuple(f"{mutation}{crossover}" for mutation in MUTATIONS for crossover in ("bin", "exp"))
MOST_OTHERS = 5


@dataclass(frozen=True, kw_only=True, slots=True)
class DifferentialEvolution:
    """Each member of the population meets a trial, which takes its place unless the constraint rule finds the member better.

    A trial takes some variables from a mutant and the others from the member. Variables beyond a bound are drawn again within
    the bounds. Strategies, defaults and the order of random numbers are those of `scipy.optimize.differential_evolution`
    with deferred updating and without polishing, so that both make equal trials of equal members.

    Attributes:
        population: Members. SciPy's default is 15 for each variable; 50 is what the other algorithms here have.
        strategy: Mutation and crossover, binomial or exponential, as SciPy names them.
        mutation_low: Least weight of a difference; the weight is drawn again for each generation.
        mutation_high: Greatest weight of a difference.
        recombination: Probability of taking a variable from the mutant.

    Source:
        Storn, Price (1997), Differential evolution; SciPy's `differential_evolution`.
    """

    population: int = 50
    strategy: str = "best1bin"
    mutation_low: float = 0.5
    mutation_high: float = 1.0
    recombination: float = 0.7
    name: ClassVar[str] = "de"

    def __post_init__(self) -> None:
        if self.strategy not in STRATEGIES:
            raise bad_setting(self, "strategy", f"one of {', '.join(STRATEGIES)}")
        check_count(self, "population", at_least=MOST_OTHERS + self.strategy.startswith("rand2"))
        check_number(self, "mutation_low", at_least=0.0, at_most=self.mutation_high)
        check_number(self, "mutation_high", above=0.0, at_most=1.99)
        check_number(self, "recombination", at_least=0.0, at_most=1.0)

    def start(self, start: Start) -> DifferentialEvolutionSearch:
        return DifferentialEvolutionSearch(self, start)


def cross_over(
    members: Array, mutants: Array, first: NDArray[np.int64], draws: NDArray[np.bool_], exponential: bool
) -> Array:
    """Return trials (P, n) that take the variables `first` (P,) from their mutants (P, n), and others of their members at random.

    Draws (P, n) are True where a variable is to be crossed. An exponential crossover takes variables in a row, cyclically from
    the first one, until one is not to be crossed.
    """
    taken = draws.copy()
    if exponential:
        taken[:, 0] = True
        places = (first[:, None] + np.arange(members.shape[1])) % members.shape[1]
        np.put_along_axis(taken, places, np.logical_and.accumulate(taken, axis=1), axis=1)
    else:
        taken[np.arange(len(members)), first] = True
    return np.where(taken, mutants, members)


class DifferentialEvolutionSearch(PopulationSearch[DifferentialEvolution]):
    """A run of `DifferentialEvolution`; see `Search`."""

    def __init__(self, settings: DifferentialEvolution, start: Start) -> None:
        super().__init__(settings, start)
        self._members: Points | None = None

    def tell(self, X: Array, f: Array, violation: Array, rule: Rule) -> None:
        trials = Points(X, f, violation)
        if self._members is not None:
            members = self._members
            trials = trials.replace_rows(rule.better(members.f, members.violation, f, violation), members)
        # Best first, and trials keep the places of their members.
        self._members = trials.best(len(trials.f), rule)
        self._X = self._trials(self._members.X)

    def _trials(self, X: Array) -> Array:
        """Trials (P, n) for members (P, n) that are sorted best first."""
        settings, start, rng = self._settings, self._start, self._start.rng
        middle, width = 0.5 * (start.lower + start.upper), start.upper - start.lower
        scale = np.divide(1.0, width, out=np.zeros_like(width), where=width > 0.0)
        members = np.clip((X - middle) * scale + 0.5, 0.0, 1.0)  # in the unit cube

        weight = rng.uniform(settings.mutation_low, settings.mutation_high)
        others = members[self._others(len(members)).T]
        mutants = MUTATIONS[settings.strategy[:-3]](members, members[0], others, weight)
        first = rng.integers(members.shape[1], size=len(members))
        draws = rng.uniform(size=members.shape) < settings.recombination
        trials = cross_over(members, mutants, first, draws, settings.strategy.endswith("exp"))
        beyond = (trials < 0.0) | (trials > 1.0)
        trials[beyond] = rng.uniform(size=np.count_nonzero(beyond))
        return np.clip(middle + (trials - 0.5) * width, start.lower, start.upper)

    def _others(self, count: int) -> NDArray[np.intp]:
        """Members drawn for each of `count` members without itself, (count, 5), or (5, 4) of five."""
        order = np.arange(count)
        rows = []
        for member in range(count):
            self._start.rng.shuffle(order)
            drawn = order[: MOST_OTHERS + 1]
            rows.append(drawn[drawn != member][:MOST_OTHERS])
        return np.array(rows)
