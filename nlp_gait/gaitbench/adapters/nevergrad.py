"""Instances as experiment functions of nevergrad."""

from __future__ import annotations

from typing import TYPE_CHECKING

import nevergrad as ng
import numpy as np
from nevergrad.functions import ExperimentFunction

from nlp_gait.formulation import Array

if TYPE_CHECKING:
    from nlp_gait.gaitbench.instance import Instance


class GaitBenchFunction(ExperimentFunction):
    """An instance; give ``constraint_violation=[function.violation]`` to ``optimizer.minimize``.

    Attributes:
        instance: what is evaluated.
    """

    def __init__(self, instance: Instance) -> None:
        """Take bounds and names from the instance."""
        self.instance = instance
        middle = (instance.lower + instance.upper) / 2
        array = ng.p.Array(init=middle, lower=instance.lower, upper=instance.upper)
        super().__init__(self._objective, array.set_name(instance.id))

    def violation(self, x: Array) -> float:
        """Total violation at x (n,): zero where the point is feasible."""
        return float(self.instance(np.asarray(x, dtype=float)[None])[1][0])

    def _objective(self, x: Array) -> float:
        return float(self.instance(np.asarray(x, dtype=float)[None])[0][0])


def to_nevergrad(instance: Instance) -> GaitBenchFunction:
    """See ``Instance.to_nevergrad``."""
    return GaitBenchFunction(instance)
