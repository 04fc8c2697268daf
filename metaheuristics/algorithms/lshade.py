"""L-SHADE: differential evolution that learns its parameters from successes, with a population that shrinks."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from metaheuristics.algorithms.differential_evolution import cross_over
from metaheuristics.algorithms.points import Points
from metaheuristics.array import Array
from metaheuristics.constraint_handling import Rule
from metaheuristics.interface import PopulationSearch, Start
from metaheuristics.settings import check_count, check_number

LEAST_POPULATION = 4
SPREAD = 0.1  # of the drawn weights (Cauchy's scale) and crossover rates (normal deviation)


@dataclass(frozen=True, kw_only=True, slots=True)
class LShade:
    """L-SHADE: each member moves towards one of the best; weights and crossover rates are learned from successes.

    With the constraint handling `epsilon` it is L-SHADE with epsilon levels. Variables beyond a bound are put halfway between
    it and the member. The population shrinks linearly to 4 over the budget.

    Attributes:
        population: members in the beginning; the source takes 18 for each variable, which is 162 for 9.
        archive: replaced members that stay known, as a multiple of the population.
        best: share of the population towards whose members the others move (p).
        memory: entries of what has succeeded (H).

    Source:
        Tanabe, Fukunaga (2014), Improving the search performance of SHADE using linear population size reduction; epsilon
        levels after Takahama, Sakai (2006). The source has no constraints: a improved that the violation decides counts there
        by how much the violation fell, and each kind of improved has the weight of its largest.
    """

    population: int = 162
    archive: float = 2.6
    best: float = 0.11
    memory: int = 6
    name: ClassVar[str] = "lshade"

    def __post_init__(self) -> None:
        check_count(self, "population", at_least=LEAST_POPULATION)
        check_number(self, "archive", at_least=0.0)
        check_number(self, "best", above=0.0, at_most=1.0)
        check_count(self, "memory", at_least=1)

    def start(self, start: Start) -> LShadeSearch:
        return LShadeSearch(self, start)


def lehmer_mean(values: Array, weights: Array) -> float:
    """Weighted Lehmer mean, which prefers large values; 0 where all are.

    Source:
        Tanabe, Fukunaga (2014), eq. (10).
    """
    total = float(np.sum(weights * values))
    return float(np.sum(weights * values**2)) / total if total > 0.0 else 0.0


def gains(before: tuple[Array, Array], after: tuple[Array, Array]) -> Array:
    """Return by how much points (k,) are better after than before, as weights in 0..1, from violations and objectives (k,).

    That is the fall of the violation, or where it is equal of the objective, each kind in units of its greatest one.
    """
    decided = after[0] < before[0]
    found = np.zeros(len(decided))
    for chosen, key in ((decided, 0), (~decided, 1)):
        fall = before[key][chosen] - after[key][chosen]
        fall = np.where(np.isfinite(fall), fall, np.max(fall, initial=0.0, where=np.isfinite(fall)))
        largest = fall.max(initial=0.0)
        found[chosen] = fall / largest if largest > 0.0 else 1.0
    return found


class LShadeSearch(PopulationSearch[LShade]):
    """A run of `LShade`; see `Search`."""

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
            self._learn(self._F[improved], self._CR[improved], gains(before, after))
            self._archive = self._cut(np.concatenate([self._archive, members.X[improved]]))
        return members.replace_rows(~worse, trials)

    def _learn(self, F: Array, CR: Array, weights: Array) -> None:
        # Algorithm 1 of the source.
        self._weights[self._place] = lehmer_mean(F, weights)
        if self._rates[self._place] is not None:
            self._rates[self._place] = lehmer_mean(CR, weights) if CR.max() > 0.0 else None
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
        first, second = _two_others(count, count + len(self._archive), rng)
        others = np.concatenate([X, self._archive])
        F = self._F[:, None]
        mutants = X + F * (towards - X) + F * (X[first] - others[second])
        mutants = np.where(mutants < start.lower, (start.lower + X) / 2, mutants)
        mutants = np.where(mutants > start.upper, (start.upper + X) / 2, mutants)
        draws = rng.random((count, n)) < self._CR[:, None]
        trials = cross_over(X, mutants, rng.integers(n, size=len(X)), draws, exponential=False)
        return np.clip(trials, start.lower, start.upper)


def _draw_weights(centres: Array, rng: np.random.Generator) -> Array:
    """Draw from Cauchy's distribution again until the values are above 0; cap them at 1."""
    drawn = centres + SPREAD * rng.standard_cauchy(len(centres))
    while (low := drawn <= 0.0).any():
        drawn[low] = centres[low] + SPREAD * rng.standard_cauchy(int(low.sum()))
    return np.minimum(drawn, 1.0)


def _two_others(count: int, all: int, rng: np.random.Generator) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """For each of some members another one, and one more of all that are known; the three differ."""
    own = np.arange(count)
    first = (own + 1 + rng.integers(count - 1, size=count)) % count
    second = rng.integers(all, size=count)
    while (same := (second == own) | (second == first)).any():
        second[same] = rng.integers(all, size=int(same.sum()))
    return first, second
