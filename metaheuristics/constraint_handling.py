"""Constraint handling: how two points with objective f and violation v compare.

Every rule here orders points lexicographically by two keys computed from f and v: the violation and the objective as the
rule sees them. That makes it a total preorder, gives pairwise comparison and sorting from one definition, reduces a new
rule to a key function, and lets packages that put feasible points first by themselves follow any rule.

A failed evaluation has f = v = infinity (see `mark_failed`) and so comes last under every rule.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import ClassVar, Protocol

import numpy as np
from numpy.typing import NDArray

from metaheuristics.array import Array
from metaheuristics.settings import check_number


def mark_failed(f: Array, violation: Array) -> tuple[Array, Array, NDArray[np.bool_]]:
    """Return copies of f and violation (P,) with infinity where either is NaN or infinite, and the (P,) mask of these."""
    failed = ~(np.isfinite(f) & np.isfinite(violation))
    return np.where(failed, np.inf, f), np.where(failed, np.inf, violation), failed


@dataclass(frozen=True, kw_only=True, eq=False, slots=True)
class Rule:
    """A total preorder of points; smaller keys are better, the first key decides before the second.

    Attributes:
        keys: Maps f and violation, any equal shape and free of NaN, to the two keys of the same shape: effective violation,
            >= 0, and effective objective.
    """

    keys: Callable[[Array, Array], tuple[Array, Array]]

    def better(self, f1: Array, violation1: Array, f2: Array, violation2: Array) -> NDArray[np.bool_]:
        """Compare pairs by objectives and violations (P,) each; return (P,) True where the first is strictly better."""
        major1, minor1 = self.keys(f1, violation1)
        major2, minor2 = self.keys(f2, violation2)
        better: NDArray[np.bool_] = (major1 < major2) | ((major1 == major2) & (minor1 < minor2))
        return better

    def order(self, f: Array, violation: Array) -> NDArray[np.intp]:
        """Return the (P,) indices that sort points, best first; equals keep their order."""
        major, minor = self.keys(f, violation)
        return np.lexsort((minor, major))

    def best(self, f: Array, violation: Array) -> int:
        """Return the index of the best point, the first of equals."""
        return int(self.order(f, violation)[0])


class ConstraintHandling(Protocol):
    """Settings of a constraint handling, immutable, SearchError where not allowed; gives the rule for each moment of a run."""

    @property
    def name(self) -> str:
        """Name in reports."""

    def rule(self, progress: float, initial_violation: Array) -> Rule:
        """Return the current rule.

        Args:
            progress: Share of the evaluation budget used, 0 to 1.
            initial_violation: (P,) violations of the first generation; infinity where failed.
        """


FEASIBILITY = Rule(keys=lambda f, violation: (violation, f))
"""Feasible points by objective, before infeasible ones by violation: also how every run picks its reported best."""


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
    """Compare f + weight * violation, as many papers do; the result depends on the weight.

    Attributes:
        weight: Objective units per unit of violation, > 0. There is no default, as none suits every problem.
    """

    weight: float
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

    Attributes:
        share: Epsilon starts at the violation below which this share of the first generation lies (theta).
        exponent: Speed of the fall (cp).
        control: Fraction of the budget at which epsilon reaches zero (Tc / T).

    Source:
        Takahama, Sakai (2006), Constrained optimization by the epsilon constrained differential evolution with
        gradient-based mutation and feasible elites: epsilon level comparison and its control.
    """

    share: float = 0.2
    exponent: float = 5.0
    control: float = 0.8
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
