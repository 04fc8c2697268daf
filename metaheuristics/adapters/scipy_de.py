"""Differential evolution of SciPy."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from metaheuristics.constraint_handling import Rule
from metaheuristics.interface import Array, Start
from metaheuristics.points import Points
from metaheuristics.settings import bad_setting, check_count, check_number

STRATEGIES = (
    "best1bin",
    "best1exp",
    "best2bin",
    "best2exp",
    "currenttobest1bin",
    "currenttobest1exp",
    "rand1bin",
    "rand1exp",
    "rand2bin",
    "rand2exp",
    "randtobest1bin",
    "randtobest1exp",
)


@dataclass(frozen=True, kw_only=True, slots=True)
class DifferentialEvolution:
    """SciPy's variation with this package's selection, so that every constraint handling applies.

    SciPy proposes a trial for each member of the population; the trial takes the member's place unless the constraint
    rule finds the member better. All settings but the population, and polishing, which is left out, are SciPy's defaults.

    Attributes:
        population: Members. SciPy's default is 15 for each variable; 50 is what the other algorithms here have.
        strategy: How trials are made, as SciPy names it.
        mutation_low: Least weight of a difference; the weight is drawn anew for each generation.
        mutation_high: Greatest weight of a difference.
        recombination: Probability of taking a variable from the mutant.

    Raises:
        SearchError: A setting is not allowed.

    Source:
        Storn, Price (1997), Differential evolution; `scipy.optimize.differential_evolution`.
    """

    population: int = 50
    strategy: str = "best1bin"
    mutation_low: float = 0.5
    mutation_high: float = 1.0
    recombination: float = 0.7
    name: ClassVar[str] = "de"

    def __post_init__(self) -> None:
        check_count(self, "population", at_least=5)
        if self.strategy not in STRATEGIES:
            raise bad_setting(self, "strategy", f"one of {', '.join(STRATEGIES)}")
        check_number(self, "mutation_low", at_least=0.0, at_most=self.mutation_high)
        check_number(self, "mutation_high", above=0.0, at_most=1.99)
        check_number(self, "recombination", at_least=0.0, at_most=1.0)

    def start(self, start: Start) -> DifferentialEvolutionSearch:
        """Begin a run; see `Algorithm.start`."""
        return DifferentialEvolutionSearch(self, start)


class _Proposed(Exception):
    """Carries SciPy's trials out of the call that would evaluate them."""

    def __init__(self, trials: Array) -> None:
        super().__init__()
        self.trials = trials


class DifferentialEvolutionSearch:
    """A run of `DifferentialEvolution`; see `Search`."""

    def __init__(self, settings: DifferentialEvolution, start: Start) -> None:
        """Ask for the starting points first, as trials without members."""
        self._settings = settings
        self._start = start
        self._X = start.initial
        self._members: Points | None = None

    def ask(self) -> Array:
        """Return the trials, (P, n)."""
        return self._X

    def tell(self, X: Array, f: Array, violation: Array, rule: Rule) -> None:
        """Select, and have SciPy propose; see `Search.tell`."""
        trials = Points(X, f, violation)
        if self._members is not None:
            members = self._members
            kept = rule.better(members.f, members.violation, f, violation)
            trials = Points(
                np.where(kept[:, None], members.X, X),
                np.where(kept, members.f, f),
                np.where(kept, members.violation, violation),
            )
        # Best first: SciPy would move the best there, and trials must keep the places of their members.
        self._members = trials.best(len(trials.f), rule)
        self._X = self._proposals(self._members.X)

    def stop(self) -> tuple[str, ...]:
        """Return no reason; a collapsed population goes on until the budget ends."""
        return ()

    def _proposals(self, members: Array) -> Array:
        """SciPy's trials (P, n) for members (P, n) that are sorted best first.

        One generation is begun: the first call asks for the members' values, of which SciPy uses the order alone; the
        second would evaluate the trials.
        """
        from scipy.optimize import differential_evolution

        settings, start = self._settings, self._start
        known = np.arange(len(members), dtype=float)
        calls = 0

        def objective(columns: Array) -> Array:
            nonlocal calls
            calls += 1
            if calls > 1:
                raise _Proposed(columns.T)
            return known

        try:
            differential_evolution(
                objective,
                np.column_stack([start.lower, start.upper]),
                init=members,
                strategy=settings.strategy,
                mutation=(settings.mutation_low, settings.mutation_high),
                recombination=settings.recombination,
                maxiter=1,
                tol=0.0,
                polish=False,
                updating="deferred",
                vectorized=True,
                seed=start.rng,
            )
        except _Proposed as proposed:
            return np.clip(proposed.trials, start.lower, start.upper)
        return members
