"""Instances as experiment functions of nevergrad."""

from __future__ import annotations

from typing import TYPE_CHECKING

import nevergrad as ng
from nevergrad.functions import ExperimentFunction

if TYPE_CHECKING:
    from nlp_gait.gaitbench.instance import Instance


def to_nevergrad(instance: Instance) -> ExperimentFunction:
    """Return an experiment function with a method ``violation`` for ``optimizer.minimize``."""
    middle = (instance.lower + instance.upper) / 2
    array = ng.p.Array(init=middle, lower=instance.lower, upper=instance.upper)
    function = ExperimentFunction(instance.objective, array.set_name(instance.id))
    function.violation = instance.violation
    return function
