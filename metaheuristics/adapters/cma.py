"""CMA-ES of the package cma (pycma), restarted with a growing population; also with an augmented Lagrangian."""

import warnings
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from metaheuristics.interface import Array, PopulationSearch, Rule, Start
from metaheuristics.preparation import UnitCube
from metaheuristics.settings import check_count, check_number, tunable


@dataclass(frozen=True, kw_only=True, slots=True)
class CmaEs:
    """Covariance matrix adaptation, with pycma's own settings but for those below.

    It sees only the order of the points by the constraint rule, which is all that CMA-ES uses of objective and
    violation. The shared starting points are its first generation; the first distribution is centred on their best.
    Once pycma would stop, it starts again from a random point with a larger population, until the budget ends.

    Source:
        Hansen, Ostermeier (2001), Completely derandomized self-adaptation in evolution strategies; Auger, Hansen (2005),
        A restart CMA evolution strategy with increasing population size.
    """

    #: Points in a generation; 10 is pycma's own choice for 8 and 9 variables
    population: int = tunable(10, 6, 60, "log")
    sigma: float = tunable(0.3, 0.05, 0.6, "log")  #: First standard deviation, as a share of each variable's range
    growth: float = tunable(2.0, 1.0, 3.0)  #: Factor on the population at every restart
    name: ClassVar[str] = "cma"

    def __post_init__(self) -> None:
        check_count(self, "population", at_least=4)
        check_number(self, "sigma", above=0.0)
        check_number(self, "growth", at_least=1.0)

    def start(self, start: Start) -> "CmaEsSearch":
        return CmaEsSearch(self, start)


class CmaEsSearch(PopulationSearch[CmaEs]):
    """A run of `CmaEs`; see `Search`.

    pycma works in the unit cube of the free variables. It does not take fewer than two, so there are idle ones if need be.
    """

    def __init__(self, settings: CmaEs, start: Start) -> None:
        super().__init__(settings, start)
        self._cube = UnitCube(start)
        self._size = float(settings.population)
        self._strategy: Any = None
        self._asked: list[Array] = []

    def tell(self, X: Array, f: Array, violation: Array, rule: Rule) -> None:
        if self._strategy is None:
            idle = np.full(max(0, 2 - self._cube.size), 0.5)
            self._strategy = self._begin(np.concatenate([self._cube.shares(X[rule.best(f, violation)]), idle]))
        else:
            self._strategy.tell(self._asked, self._costs(X, f, violation, rule))
            if self._strategy.stop():
                self._size *= self._settings.growth
                self._strategy = self._begin(self._start.rng.random(max(2, self._cube.size)))
        self._asked = self._strategy.ask()
        self._X = self._cube.points(np.array(self._asked)[:, : self._cube.size])

    def _costs(self, X: Array, f: Array, violation: Array, rule: Rule) -> list[float]:
        """Return the rank of each point in the rule's order: all that pycma learns of it."""
        order = rule.order(f, violation)
        ranks = np.empty(len(order))
        ranks[order] = np.arange(len(order))
        return ranks.tolist()

    def _criteria(self) -> dict[str, float]:
        """Pycma's criteria on objective values, which it does not see, are switched off; those on the distribution remain."""
        off = dict.fromkeys(("tolfun", "tolfunhist", "tolfunrel"), -1.0)
        return {**off, "tolflatfitness": np.inf, "tolstagnation": np.inf}

    def _begin(self, centre: Array) -> Any:
        from cma import CMAEvolutionStrategy

        options = {
            "bounds": [0.0, 1.0],
            "popsize": int(self._size),
            "randn": lambda *shape: self._start.rng.standard_normal(shape),
            "seed": np.nan,  # else it seeds NumPy's global generator
            **self._criteria(),
            "verbose": -9,
            "verb_log": 0,
        }
        return CMAEvolutionStrategy(centre, self._settings.sigma, options)


@dataclass(frozen=True, kw_only=True, slots=True)
class CmaLagrangian(CmaEs):
    """CMA-ES that minimises an augmented Lagrangian, whose multipliers pycma adapts; restarted with a growing population.

    Each constraint is its worst row; where the objective cannot separate them, the total violation is the only one. The
    constraint handling of the study decides only where the first distribution is centred.

    Source:
        Atamna, Auger, Hansen (2017), Linearly convergent evolution strategies via augmented Lagrangian constraint handling;
        Dufosse, Hansen (2021), Augmented Lagrangian, penalty techniques and surrogate modeling for constrained optimization
        with CMA-ES; as in `cma.ConstrainedFitnessAL`.
    """

    name: ClassVar[str] = "cma-al"

    def start(self, start: Start) -> "_CmaLagrangianSearch":
        return _CmaLagrangianSearch(self, start)


class _CmaLagrangianSearch(CmaEsSearch):
    def __init__(self, settings: CmaEs, start: Start) -> None:
        super().__init__(settings, start)
        self._fitness: Any = None
        self._current: tuple[float, Array] = (np.inf, np.empty(0))

    def _costs(self, X: Array, f: Array, violation: Array, rule: Rule) -> list[float]:
        """Return the augmented Lagrangian of each point, whose coefficients pycma then adapts; failed evaluations come last."""
        inequalities = self._start.inequalities(X, violation)
        worked = np.isfinite(f)
        values = np.zeros(len(f))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of coefficients that are not set yet
            for k in np.flatnonzero(worked):
                self._current = float(f[k]), inequalities[k]
                values[k] = self._fitness(self._asked[k])
            self._fitness.update(self._strategy)
        values[~worked] = values.max() + 1.0
        return values.tolist()

    def _begin(self, centre: Array) -> Any:
        from cma import ConstrainedFitnessAL

        self._fitness = ConstrainedFitnessAL(
            lambda x: self._current[0],
            lambda x: self._current[1],
            dimension=len(centre),
            which="best",
            logging=0,
            archives=False,
        )
        return super()._begin(centre)

    def _criteria(self) -> dict[str, float]:
        """Pycma's own, which see the values of the Lagrangian."""
        return {}
