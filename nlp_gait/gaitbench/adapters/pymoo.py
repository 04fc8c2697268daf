"""Instances as problems of pymoo."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pymoo.core.problem import Problem

from nlp_gait.formulation import Array

if TYPE_CHECKING:
    from nlp_gait.gaitbench.instance import Instance


class PymooProblem(Problem):
    """An instance, evaluated population by population.

    With ``rows``, G has every row; otherwise it has one, the total violation, which is the sum that pymoo itself computes.
    """

    def __init__(self, instance: Instance, *, rows: bool = False) -> None:
        self.instance = instance
        self.rows = rows
        count = len(instance.row_names) if rows else 1
        super().__init__(n_var=len(instance.names), n_obj=1, n_ieq_constr=count, xl=instance.lower, xu=instance.upper)

    def name(self) -> str:
        """Return the id of the instance."""
        return self.instance.id

    def _evaluate(self, X: Array, out: dict[str, Any], *_: Any, **__: Any) -> None:
        f, violation = self.instance(X)
        out["F"] = f[:, None]
        out["G"] = self.instance.rows(X) if self.rows else violation[:, None]

    def _calc_pareto_front(self, *_: Any, **__: Any) -> Any:
        return [[self.instance.best_known]]

    def _calc_pareto_set(self, *_: Any, **__: Any) -> Any:
        return self.instance.best_x[None]
