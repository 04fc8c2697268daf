"""Instances as benchmark problems of OptunaHub, which are objectives of Optuna too."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING

import numpy as np
import optuna
from optunahub.benchmarks import BaseProblem

if TYPE_CHECKING:
    from nlp_gait.gaitbench.instance import Instance


class GaitBenchProblem(BaseProblem):
    """An instance whose constraint is the total violation."""

    def __init__(self, instance: Instance) -> None:
        """Take an instance."""
        self.instance = instance
        self._space = {
            name: optuna.distributions.FloatDistribution(low, high)
            for name, low, high in zip(instance.names, instance.lower.tolist(), instance.upper.tolist(), strict=True)
        }

    @property
    def search_space(self) -> dict[str, optuna.distributions.BaseDistribution]:
        """A range for each variable by name."""
        return dict(self._space)

    @property
    def directions(self) -> list[optuna.study.StudyDirection]:
        """One objective, to be minimised."""
        return [optuna.study.StudyDirection.MINIMIZE]

    def evaluate(self, params: Mapping[str, float]) -> float:
        """Objective at values by name."""
        return float(self.instance(self._point(params))[0][0])

    def evaluate_constraints(self, params: Mapping[str, float]) -> dict[str, float]:
        """Total violation: zero where the point is feasible."""
        return {"violation": float(self.instance(self._point(params))[1][0])}

    def _point(self, params: Mapping[str, float]) -> np.ndarray:
        return np.array([[params[name] for name in self.instance.names]])


def to_optuna(instance: Instance) -> GaitBenchProblem:
    """See ``Instance.to_optuna``."""
    return GaitBenchProblem(instance)
