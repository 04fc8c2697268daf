"""Instances as problems of pymoo."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pymoo.core.problem import Problem

from nlp_gait.formulation import Array

if TYPE_CHECKING:
    from nlp_gait.gaitbench.instance import Instance


class GaitBenchProblem(Problem):
    """An instance, evaluated population by population.

    Attributes:
        instance: what is evaluated.
        rows: G has every row; otherwise one, the total violation, which is the sum that pymoo itself makes of them.
    """

    def __init__(self, instance: Instance, *, rows: bool) -> None:
        """Take bounds and counts from the instance."""
        self.instance = instance
        self.rows = rows
        constraints = len(instance.row_names) if rows else 1
        super().__init__(
            n_var=len(instance.names), n_obj=1, n_ieq_constr=constraints, xl=instance.lower, xu=instance.upper
        )

    def name(self) -> str:
        """Id of the instance."""
        return self.instance.id

    def _evaluate(self, X: Array, out: dict[str, Any], *_: Any, **__: Any) -> None:
        f, violation = self.instance(X)
        out["F"] = f[:, None]
        out["G"] = self.instance.rows(X) if self.rows else violation[:, None]

    def _calc_pareto_front(self, *_: Any, **__: Any) -> Any:
        return [[self.instance.best_known]]

    def _calc_pareto_set(self, *_: Any, **__: Any) -> Any:
        return self.instance.best_x[None]


def to_pymoo(instance: Instance, *, rows: bool) -> GaitBenchProblem:
    """See ``Instance.to_pymoo``."""
    return GaitBenchProblem(instance, rows=rows)
