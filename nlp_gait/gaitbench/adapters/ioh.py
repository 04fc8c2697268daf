"""Instances as problems of ioh (IOHexperimenter)."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

if TYPE_CHECKING:
    from nlp_gait.gaitbench.instance import Instance

# A violation of 1 costs this many times the best known objective: ioh adds it to what its algorithms see.
PENALTY = 1e3


def to_ioh(instance: Instance) -> Any:
    """See ``Instance.to_ioh``."""
    import ioh

    n = len(instance.names)

    def objective(x: Sequence[float]) -> float:
        return float(instance(np.array(x, dtype=float)[None])[0][0])

    def violation(x: Sequence[float]) -> float:
        return float(instance(np.array(x, dtype=float)[None])[1][0])

    total = ioh.RealConstraint(
        violation,
        weight=PENALTY * (abs(instance.best_known) or 1.0),
        enforced=ioh.ConstraintEnforcement.SOFT,
        name="violation",
    )
    problem = ioh.wrap_problem(
        objective,
        name=f"GaitBench-{instance.id}",
        problem_class=ioh.ProblemClass.REAL,
        dimension=n,
        lb=float(instance.lower.min()),
        ub=float(instance.upper.max()),
        calculate_objective=lambda _, __: ioh.RealSolution(instance.best_x.tolist(), instance.best_known),
        constraints=[total],
    )
    problem.bounds.lb, problem.bounds.ub = instance.lower.tolist(), instance.upper.tolist()
    return problem
