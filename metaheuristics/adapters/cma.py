"""CMA-ES of the package cma (pycma), restarted with a growing population."""

from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from metaheuristics.errors import check_count, check_number
from metaheuristics.interface import Array, PopulationSearch, Rule, Start
from metaheuristics.preparation import UnitCube


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
    population: int = 10
    sigma: float = 0.3  #: First standard deviation, as a share of each variable's range
    growth: float = 2.0  #: Factor on the population at every restart
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
            ranks = np.empty(len(f))
            ranks[rule.order(f, violation)] = np.arange(len(f))  # all that pycma learns of the points
            self._strategy.tell(self._asked, ranks.tolist())
            if self._strategy.stop():
                self._size *= self._settings.growth
                self._strategy = self._begin(self._start.rng.random(max(2, self._cube.size)))
        self._asked = self._strategy.ask()
        self._X = self._cube.points(np.array(self._asked)[:, : self._cube.size])

    def _begin(self, centre: Array) -> Any:
        from cma import CMAEvolutionStrategy

        options = {
            "bounds": [0.0, 1.0],
            "popsize": int(self._size),
            "randn": lambda *shape: self._start.rng.standard_normal(shape),
            "seed": np.nan,  # otherwise it seeds NumPy's global generator
            # criteria on objective values, which pycma does not see, are switched off; those on the distribution remain
            **dict.fromkeys(("tolfun", "tolfunhist", "tolfunrel"), -1.0),
            **dict.fromkeys(("tolflatfitness", "tolstagnation"), np.inf),
            "verbose": -9,
            "verb_log": 0,
        }
        return CMAEvolutionStrategy(centre, self._settings.sigma, options)
