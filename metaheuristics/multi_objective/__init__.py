"""Minimisation of several objectives at once, with operators of the package pymoo.

snapshots = minimize_many(objectives, make_front_algorithm("NSGA2"), evaluations=(1_000, 10_000), seed=1)
"""

from collections.abc import Callable, Mapping
from functools import partial

from metaheuristics.adapters.pymoo import FRONT_MODULES, MultiObjective
from metaheuristics.multi_objective.constrained_moead import ConstrainedMoead
from metaheuristics.multi_objective.dynamic_nsga3 import DynamicConstrainedNsga3
from metaheuristics.multi_objective.minimize_many import (
    FrontAlgorithm,
    ManyObjectives,
    Snapshot,
    check_budgets,
    minimize_many,
)
from metaheuristics.registry import make_by_name

FRONT_ALGORITHMS: Mapping[str, Callable[..., FrontAlgorithm]] = {
    **{name: partial(MultiObjective, algorithm=name) for name in FRONT_MODULES},
    "CMOEAD": ConstrainedMoead,
    "DCNSGA3": DynamicConstrainedNsga3,
}
"""Algorithms by name; all use operators of pymoo, which `pip install 'nlp-gait[algorithms]'` installs."""


def make_front_algorithm(name: str, /, **settings: object) -> FrontAlgorithm:
    """Make an algorithm for several objectives by its name in `FRONT_ALGORITHMS`; raises SearchError as `make_algorithm` does."""
    return make_by_name("algorithm for several objectives", name, FRONT_ALGORITHMS, settings)


__all__ = [
    "FRONT_ALGORITHMS",
    "FrontAlgorithm",
    "ManyObjectives",
    "Snapshot",
    "check_budgets",
    "make_front_algorithm",
    "minimize_many",
]
