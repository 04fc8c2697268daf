"""Differential evolution: the classic one, and L-SHADE, which learns its parameters from successes and shrinks its population."""

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


def cross_over(members: Array, mutants: Array, first: NDArray[np.int64], draws: NDArray[np.bool_]) -> Array:
    """Return trials (P, n) that take the variables `first` (P,), and where draws (P, n) are True, from their mutants (P, n)."""
    taken = draws.copy()
    taken[np.arange(len(members)), first] = True
    return np.where(taken, mutants, members)


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
        draws = rng.uniform(size=members.shape) < settings.recombination
        trials = cross_over(members, mutants, first, draws)
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


LEAST_POPULATION = 4
SPREAD = 0.1  # of the drawn weights (Cauchy's scale) and crossover rates (normal deviation)


@dataclass(frozen=True, kw_only=True, slots=True)
class LShade:
    """L-SHADE: each member moves towards one of the best; weights and crossover rates are learned from successes.

    With the constraint handling `epsilon` it is L-SHADE with epsilon levels. Variables beyond a bound are put halfway between
    it and the member. The population shrinks linearly to 4 over the budget.

    Source:
        Tanabe, Fukunaga (2014), Improving the search performance of SHADE using linear population size reduction; epsilon
        levels after Takahama, Sakai (2006). The source has no constraints: an improvement that the violation decides counts there
        by how much the violation fell, and each kind of improvement has the weight of its largest.
    """

    #: members in the beginning; the source takes 18 for each variable, which is 162 for 9
    population: int = 162
    archive: float = 2.6  #: replaced members that stay known, as a multiple of the population
    best: float = 0.11  #: share of the population towards whose members the others move (p)
    memory: int = 6  #: entries of what has succeeded (H)
    name: ClassVar[str] = "lshade"

    def __post_init__(self) -> None:
        check_count(self, "population", at_least=LEAST_POPULATION)
        check_number(self, "archive", at_least=0.0)
        check_number(self, "best", above=0.0, at_most=1.0)
        check_count(self, "memory", at_least=1)

    def start(self, start: Start) -> "_LShadeSearch":
        return _LShadeSearch(self, start)


def compute_lehmer_mean(values: Array, weights: Array) -> float:
    """Weighted Lehmer mean, which prefers large values; 0 where all are.

    Source:
        Tanabe, Fukunaga (2014), eq. (10).
    """
    total = float(np.sum(weights * values))
    return float(np.sum(weights * values**2)) / total if total > 0.0 else 0.0


def compute_gains(before: tuple[Array, Array], after: tuple[Array, Array]) -> Array:
    """Return by how much points (k,) are better after than before, as weights in 0..1, from violations and objectives (k,).

    That is the fall of the violation, or where it is equal of the objective, each kind in units of its greatest one.
    """
    decided = after[0] < before[0]
    weights = np.zeros(len(decided))
    for chosen, key in ((decided, 0), (~decided, 1)):
        fall = before[key][chosen] - after[key][chosen]
        fall = np.where(np.isfinite(fall), fall, np.max(fall, initial=0.0, where=np.isfinite(fall)))
        largest = fall.max(initial=0.0)
        weights[chosen] = fall / largest if largest > 0.0 else 1.0
    return weights


class _LShadeSearch(PopulationSearch[LShade]):
    def __init__(self, settings: LShade, start: Start) -> None:
        super().__init__(settings, start)
        self._members = Points.none(start.initial.shape[1])
        self._archive = np.empty((0, start.initial.shape[1]))
        self._used = 0
        self._weights = np.full(settings.memory, 0.5)
        self._rates: list[float | None] = [0.5] * settings.memory  # None: zero for good
        self._place = 0
        self._F, self._CR = np.empty(0), np.empty(0)

    def tell(self, X: Array, f: Array, violation: Array, rule: Rule) -> None:
        trials = Points(X, f, violation)
        self._used += len(X)
        self._members = self._select(trials, rule) if len(self._members.f) else trials
        self._shrink(rule)
        self._X = self._make_trials(rule)

    def _select(self, trials: Points, rule: Rule) -> Points:
        """Return members, or trials where the rule does not find the member better; learn from improvements."""
        members = self._members
        worse = rule.better(members.f, members.violation, trials.f, trials.violation)
        improved = rule.better(trials.f, trials.violation, members.f, members.violation)
        if improved.any():
            keys = (rule.keys(points.f[improved], points.violation[improved]) for points in (members, trials))
            before, after = keys
            self._learn(self._F[improved], self._CR[improved], compute_gains(before, after))
            self._archive = self._cut(np.concatenate([self._archive, members.X[improved]]))
        return members.replace_rows(~worse, trials)

    def _learn(self, F: Array, CR: Array, weights: Array) -> None:
        # Algorithm 1 of the source.
        self._weights[self._place] = compute_lehmer_mean(F, weights)
        if self._rates[self._place] is not None:
            self._rates[self._place] = compute_lehmer_mean(CR, weights) if CR.max() > 0.0 else None
        self._place = (self._place + 1) % self._settings.memory

    def _shrink(self, rule: Rule) -> None:
        first, budget = self._settings.population, self._start.evaluations
        size = round(first + (LEAST_POPULATION - first) * min(1.0, self._used / budget))
        size = max(LEAST_POPULATION, size)
        if size < len(self._members.f):
            self._members = self._members.best(size, rule)
            self._archive = self._cut(self._archive)

    def _cut(self, archive: Array) -> Array:
        """At most so many of the archive as it may hold, chosen at random."""
        most = round(self._settings.archive * len(self._members.f))
        return archive if len(archive) <= most else archive[self._start.rng.permutation(len(archive))[:most]]

    def _make_trials(self, rule: Rule) -> Array:
        start, rng, X = self._start, self._start.rng, self._members.X
        count, n = X.shape
        entry = rng.integers(self._settings.memory, size=count)
        rates = np.array([np.nan if rate is None else rate for rate in self._rates])[entry]
        self._CR = np.where(np.isnan(rates), 0.0, np.clip(rng.normal(np.nan_to_num(rates), SPREAD), 0.0, 1.0))
        self._F = _draw_weights(self._weights[entry], rng)
        best = rule.order(self._members.f, self._members.violation)[: max(2, round(self._settings.best * count))]
        towards = X[best[rng.integers(len(best), size=count)]]
        first, second = _draw_two_others(count, count + len(self._archive), rng)
        others = np.concatenate([X, self._archive])
        F = self._F[:, None]
        mutants = X + F * (towards - X) + F * (X[first] - others[second])
        mutants = np.where(mutants < start.lower, (start.lower + X) / 2, mutants)
        mutants = np.where(mutants > start.upper, (start.upper + X) / 2, mutants)
        draws = rng.random((count, n)) < self._CR[:, None]
        trials = cross_over(X, mutants, rng.integers(n, size=len(X)), draws)
        return np.clip(trials, start.lower, start.upper)


def _draw_weights(centres: Array, rng: np.random.Generator) -> Array:
    """Draw from Cauchy's distribution again until the values are above 0; cap them at 1."""
    drawn = centres + SPREAD * rng.standard_cauchy(len(centres))
    while (low := drawn <= 0.0).any():
        drawn[low] = centres[low] + SPREAD * rng.standard_cauchy(int(low.sum()))
    return np.minimum(drawn, 1.0)


def _draw_two_others(count: int, all: int, rng: np.random.Generator) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """For each of some members another one, and one more of all that are known; the three differ."""
    targets = np.arange(count)
    first = (targets + 1 + rng.integers(count - 1, size=count)) % count
    second = rng.integers(all, size=count)
    while (same := (second == targets) | (second == first)).any():
        second[same] = rng.integers(all, size=int(same.sum()))
    return first, second
