"""Instances as benchmark problems of OptunaHub, which are objectives of Optuna too."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import optuna
from optunahub.benchmarks import BaseProblem

if TYPE_CHECKING:
    from nlp_gait.gaitbench.instance import Instance


class OptunaProblem(BaseProblem):
    """An instance whose constraint is the total violation."""

    def __init__(self, instance: Instance) -> None:
        self.instance = instance
        self._space = {
            name: optuna.distributions.FloatDistribution(low, high)
            for name, low, high in zip(instance.names, instance.lower.tolist(), instance.upper.tolist(), strict=True)
        }

    @property
    def search_space(self) -> dict[str, optuna.distributions.BaseDistribution]:
        """Range of each variable by name."""
        return dict(self._space)

    @property
    def directions(self) -> list[optuna.study.StudyDirection]:
        """One objective, to be minimised."""
        return [optuna.study.StudyDirection.MINIMIZE]

    def evaluate(self, params: Mapping[str, float]) -> float:
        """Return the objective at values by name."""
        return self.instance.objective([params[name] for name in self.instance.names])

    def evaluate_constraints(self, params: Mapping[str, float]) -> dict[str, float]:
        """Return the total violation: zero where the point is feasible."""
        return {"violation": self.instance.violation([params[name] for name in self.instance.names])}
