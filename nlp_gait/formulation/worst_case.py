"""Robust problems: the constraints of all scenarios (robots, grounds) and the objective of the worst one."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from functools import reduce

from nlp_gait.errors import InputError
from nlp_gait.formulation.assembly import Assembly, Point
from nlp_gait.formulation.gait_problem import GaitProblem
from nlp_gait.symbolic.nonsmooth import Nonsmooth


def make_worst_case(scenarios: Sequence[GaitProblem]) -> GaitProblem:
    """Return the problem of one x that satisfies all scenarios and minimises the objective of the worst one.

    Limits, bounds and parameter values are those of the first scenario.

    Raises:
        InputError: no scenarios, different variables or parameters, or an objective that is maximised.
    """
    if not scenarios:
        raise InputError("a worst case requires at least one scenario")
    first = scenarios[0]
    for other in scenarios:
        if other.names != first.names or [q.name for q in other.parameters] != [q.name for q in first.parameters]:
            raise InputError(f"all scenarios of {first.name!r} must have the same variables and parameters")
        if other.objective.sense != "minimise":
            raise InputError(
                f"a worst case requires an objective that is minimised; {first.objective.name} is maximised"
            )

    def change(assembly: Assembly, point: Point, ops: Nonsmooth) -> Assembly:
        parts = [assembly, *(scenario.assemble(point, ops) for scenario in scenarios[1:])]
        constraints = tuple(
            replace(constraint, name=f"{constraint.name}@{k}" if k else constraint.name)
            for k, part in enumerate(parts)
            for constraint in part.constraints
        )
        # As the minimum of the negatives: its lifted variable is an epigraph variable for any objectives.
        worst = -reduce(ops.min, [-part.objective for part in parts])
        indexes = {f"{name}@{k}" if k else name: v for k, part in enumerate(parts) for name, v in part.indexes.items()}
        return Assembly(objective=worst, constraints=constraints, indexes=indexes)

    worst = first.derive(title=f"{first.title}, worst of {len(scenarios)} scenarios", change=change)
    return replace(worst, refine=None)  # refining the first scenario only would be another problem
