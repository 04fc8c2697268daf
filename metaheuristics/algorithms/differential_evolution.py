"""Differential evolution, as SciPy has it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from metaheuristics.errors import bad_setting, check_count, check_number
from metaheuristics.interface import Array, Points, PopulationSearch, Rule, Start

# Mutants (P, n) of the best member (n,), others drawn for each member r (5, P, n), and the weight F.
STRATEGIES: Mapping[str, Callable[[Array, Array, float], Array]] = {
    "best1bin": lambda best, r, F: best + F * (r[0] - r[1]),
    "rand1bin": lambda best, r, F: r[0] + F * (r[1] - r[2]),
}
OTHERS = 5  # SciPy draws as many for every strategy


@dataclass(frozen=True, kw_only=True, slots=True)
class DifferentialEvolution:
    """Each member of the population meets a trial, which takes its place unless the constraint rule finds the member better.

    A trial takes some variables from a mutant and the others from the member. Variables beyond a bound are drawn again within
    the bounds. Strategies, defaults and the order of random numbers are those of `scipy.optimize.differential_evolution`
    with deferred updating and without polishing, so that both make equal trials of equal members.

    Source:
        Storn, Price (1997), Differential evolution; SciPy's `differential_evolution`.
    """

    #: Members. SciPy's default is 15 for each variable; 50 is what the other algorithms here have
    population: int = 50
    #: Mutation from the best member or a random one, with binomial crossover, as SciPy names them
    strategy: str = "best1bin"
    #: Least weight of a difference; the weight is drawn again for each generation
    mutation_low: float = 0.5
    mutation_high: float = 1.0  #: Greatest weight of a difference
    recombination: float = 0.7  #: Probability of taking a variable from the mutant
    name: ClassVar[str] = "de"

    def __post_init__(self) -> None:
        if self.strategy not in STRATEGIES:
            raise bad_setting(self, "strategy", f"one of {', '.join(STRATEGIES)}")
        check_count(self, "population", at_least=OTHERS)
        check_number(self, "mutation_low", at_least=0.0, at_most=self.mutation_high)
        check_number(self, "mutation_high", above=0.0, at_most=1.99)
        check_number(self, "recombination", at_least=0.0, at_most=1.0)

    def start(self, start: Start) -> "_DifferentialEvolutionSearch":
        return _DifferentialEvolutionSearch(self, start)


class _DifferentialEvolutionSearch(PopulationSearch[DifferentialEvolution]):
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
        mutants = STRATEGIES[settings.strategy](members[0], others, weight)
        first = rng.integers(members.shape[1], size=len(members))
        taken = rng.uniform(size=members.shape) < settings.recombination
        taken[np.arange(len(members)), first] = True
        trials = np.where(taken, mutants, members)
        beyond = (trials < 0.0) | (trials > 1.0)
        trials[beyond] = rng.uniform(size=np.count_nonzero(beyond))
        return np.clip(middle + (trials - 0.5) * width, start.lower, start.upper)

    def _others(self, count: int) -> NDArray[np.intp]:
        """Members drawn for each of `count` members without itself, (count, 5), or (5, 4) of five."""
        order = np.arange(count)
        rows = []
        for member in range(count):
            self._start.rng.shuffle(order)
            drawn = order[: OTHERS + 1]
            rows.append(drawn[drawn != member][:OTHERS])
        return np.array(rows)
