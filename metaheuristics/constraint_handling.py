"""Constraint handling: how two points with objective f and violation v compare, see `Rule`."""

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from metaheuristics.errors import check_number
from metaheuristics.interface import FEASIBILITY, Array, Rule


@dataclass(frozen=True, kw_only=True, slots=True)
class Deb:
    """Deb's feasibility rules: no parameter, the default.

    A feasible point beats an infeasible one, two feasible ones compare by objective, two infeasible ones by violation.
    Infeasible points of equal violation, on which the paper is silent, compare by objective.

    Source:
        Deb (2000), An efficient constraint handling method for genetic algorithms, section 3.
    """

    name: ClassVar[str] = "Deb's feasibility rules"

    def rule(self, progress: float, initial_violation: Array) -> Rule:
        return FEASIBILITY


@dataclass(frozen=True, kw_only=True, slots=True)
class StaticPenalty:
    """Compare f + weight * violation, as many papers do; the result depends on the weight."""

    weight: float  #: objective units per unit of violation, > 0; there is no default, as none suits every problem
    name: ClassVar[str] = "static penalty"

    def __post_init__(self) -> None:
        check_number(self, "weight", above=0.0)

    def rule(self, progress: float, initial_violation: Array) -> Rule:
        return Rule(keys=lambda f, violation: (np.zeros_like(f), f + self.weight * violation))


@dataclass(frozen=True, kw_only=True, slots=True)
class EpsilonLevel:
    """Treat violations up to epsilon as none, and let epsilon fall to zero as the run proceeds.

    Helps where the feasible set is thin or the optimum is reached from outside. From the control fraction on it is
    equal to `Deb`.

    Source:
        Takahama, Sakai (2006), Constrained optimization by the epsilon constrained differential evolution with
        gradient-based mutation and feasible elites: epsilon level comparison and its control.
    """

    share: float = 0.2  #: epsilon starts at the violation below which this share of the first generation lies (theta)
    exponent: float = 5.0  #: speed of the fall (cp)
    control: float = 0.8  #: fraction of the budget at which epsilon reaches zero (Tc / T)
    name: ClassVar[str] = "epsilon level"

    def __post_init__(self) -> None:
        check_number(self, "share", at_least=0.0, at_most=1.0)
        check_number(self, "exponent", above=0.0)
        check_number(self, "control", above=0.0, at_most=1.0)

    def rule(self, progress: float, initial_violation: Array) -> Rule:
        epsilon = self.epsilon(progress, initial_violation)
        return Rule(keys=lambda f, violation: (np.where(violation <= epsilon, 0.0, violation), f))

    def epsilon(self, progress: float, initial_violation: Array) -> float:
        """Return the violation that counts as none; 0 if every initial evaluation failed. See `rule`."""
        finite = np.sort(initial_violation[np.isfinite(initial_violation)])
        if progress >= self.control or not finite.size:
            return 0.0
        start = finite[min(int(self.share * finite.size), finite.size - 1)]
        return float(start * (1.0 - progress / self.control) ** self.exponent)
