"""Instances as problems of pymoo."""

from typing import Any

import numpy as np
from pymoo.core.problem import Problem

from nlp_gait.formulation import Array


class PymooProblem(Problem):
    """An ``Instance`` or a ``FrontInstance``, evaluated population by population.

    With ``rows``, G has every row; otherwise it has one, the total violation, which is the sum that pymoo itself computes.
    """

    def __init__(self, instance: Any, *, rows: bool = False) -> None:
        self.instance = instance
        self.rows = rows
        counts = {"n_obj": getattr(instance, "count", 1), "n_ieq_constr": len(instance.row_names) if rows else 1}
        super().__init__(n_var=len(instance.names), **counts, xl=instance.lower, xu=instance.upper)

    def name(self) -> str:
        """Return the id of the instance."""
        return self.instance.id

    def _evaluate(self, X: Array, out: dict[str, Any], *_: Any, **__: Any) -> None:
        f, violation = self.instance(X)
        out["F"] = np.reshape(f, (len(X), -1))
        out["G"] = self.instance.rows(X) if self.rows else violation[:, None]

    def _calc_pareto_front(self, *_: Any, **__: Any) -> Any:
        return [[self.instance.best_known]] if self.n_obj == 1 else self.instance.front

    def _calc_pareto_set(self, *_: Any, **__: Any) -> Any:
        return self.instance.best_x[None] if self.n_obj == 1 else self.instance.front_x
