"""CMA-ES with pycma's augmented Lagrangian in place of a rule that compares points."""

from __future__ import annotations

import warnings
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np

from metaheuristics.adapters.cma import CmaEs, CmaEsSearch
from metaheuristics.array import Array
from metaheuristics.constraint_handling import Rule
from metaheuristics.interface import Start


@dataclass(frozen=True, kw_only=True, slots=True)
class CmaLagrangian(CmaEs):
    """CMA-ES that minimises an augmented Lagrangian, whose multipliers pycma adapts; restarted with a growing population.

    Each constraint is its worst row; where the objective cannot tell them apart, the total violation is the only one. The
    constraint handling of the study decides only where the first distribution is centred.

    Source:
        Atamna, Auger, Hansen (2017), Linearly convergent evolution strategies via augmented Lagrangian constraint handling;
        Dufosse, Hansen (2021), Augmented Lagrangian, penalty techniques and surrogate modeling for constrained optimization
        with CMA-ES; as in `cma.ConstrainedFitnessAL`.
    """

    name: ClassVar[str] = "cma-al"

    def start(self, start: Start) -> CmaLagrangianSearch:
        """Begin a run; see `Algorithm.start`."""
        return CmaLagrangianSearch(self, start)


class CmaLagrangianSearch(CmaEsSearch):
    """A run of `CmaLagrangian`; see `Search`."""

    def __init__(self, settings: CmaEs, start: Start) -> None:
        """Ask for the starting points first."""
        super().__init__(settings, start)
        self._fitness: Any = None
        self._told: tuple[float, Array] = (np.inf, np.empty(0))

    def _ranked(self, X: Array, f: Array, violation: Array, rule: Rule) -> list[float]:
        """What pycma is told: the augmented Lagrangian, whose coefficients it then adapts; failed evaluations come last."""
        excess = self._start.excess(X, violation)
        worked = np.isfinite(f)
        values = np.zeros(len(f))
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of coefficients that are not set yet
            for k in np.flatnonzero(worked):
                self._told = float(f[k]), excess[k]
                values[k] = self._fitness(self._asked[k])
            self._fitness.update(self._strategy)
        values[~worked] = values.max() + 1.0
        return values.tolist()

    def _begin(self, centre: Array) -> Any:
        from cma import ConstrainedFitnessAL

        self._fitness = ConstrainedFitnessAL(
            lambda x: self._told[0],
            lambda x: self._told[1],
            dimension=len(centre),
            which="best",
            logging=0,
            archives=False,
        )
        return super()._begin(centre)

    def _criteria(self) -> dict[str, float]:
        """Pycma's own, which see the values of the Lagrangian."""
        return {}
