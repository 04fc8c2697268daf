"""Algorithms for several objectives by name."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import partial
from types import MappingProxyType

from metaheuristics.multi_objective.constrained_moead import ConstrainedMoead
from metaheuristics.multi_objective.dynamic_nsga3 import DynamicConstrainedNsga3
from metaheuristics.multi_objective.interface import FrontAlgorithm
from metaheuristics.multi_objective.pymoo import MODULES, MultiObjective
from metaheuristics.registry import made

FRONT_ALGORITHMS: Mapping[str, Callable[..., FrontAlgorithm]] = MappingProxyType(
    {name: partial(MultiObjective, algorithm=name) for name in MODULES}
    | {factory.name: factory for factory in (ConstrainedMoead, DynamicConstrainedNsga3)}
)
"""All take operators of pymoo, which `pip install 'nlp-gait[algorithms]'` installs."""


def front_algorithm(name: str, /, **settings: object) -> FrontAlgorithm:
    """Make an algorithm for several objectives by name.

    Args:
        name: A key of `FRONT_ALGORITHMS`.
        settings: Settings that differ from the defaults.

    Raises:
        SearchError: Unknown name or setting, a value that is not allowed, or pymoo is not installed.
    """
    return made("algorithm for several objectives", name, FRONT_ALGORITHMS, settings)
