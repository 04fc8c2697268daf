"""Minimisation of several objectives at once, with operators of the package pymoo.

snapshots = minimize_many(objectives, front_algorithm("NSGA2"), evaluations=(1_000, 10_000), seed=1)
"""

from metaheuristics.multi_objective.minimize_many import (
    FrontAlgorithm,
    ManyObjectives,
    Snapshot,
    check_budgets,
    minimize_many,
)
from metaheuristics.registry import FRONT_ALGORITHMS, front_algorithm

__all__ = [
    "FRONT_ALGORITHMS",
    "FrontAlgorithm",
    "ManyObjectives",
    "Snapshot",
    "check_budgets",
    "front_algorithm",
    "minimize_many",
]
