"""Instances with two objectives as problems of pymoo and pygmo; both packages order points by objectives and total violation."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nlp_gait.formulation import Array

if TYPE_CHECKING:
    from nlp_gait.gaitbench.fronts import FrontInstance

INFEASIBLE = 1e6  # of both objectives, beyond the worst ones of feasible points, which are of the size of 1


def to_pymoo(instance: FrontInstance) -> Any:
    """Return a vectorised problem of pymoo with one constraint, the total violation, and the true front."""
    from pymoo.core.problem import Problem

    class PymooFrontProblem(Problem):
        def __init__(self) -> None:
            super().__init__(n_var=len(instance.names), n_obj=2, n_ieq_constr=1, xl=instance.lower, xu=instance.upper)

        def name(self) -> str:
            return instance.id

        def _evaluate(self, X: Array, out: dict[str, Any], *_: Any, **__: Any) -> None:
            out["F"], violation = instance(X)
            out["G"] = violation[:, None]

        def _calc_pareto_front(self, *_: Any, **__: Any) -> Any:
            return instance.front

        def _calc_pareto_set(self, *_: Any, **__: Any) -> Any:
            return instance.front_x

    return PymooFrontProblem()


def to_pygmo(instance: FrontInstance) -> Any:
    """Return a problem of pygmo; its algorithms for several objectives take no constraints, so a violation adds to both."""
    import pygmo

    return pygmo.problem(_PygmoFrontProblem(instance))


class _PygmoFrontProblem:
    def __init__(self, instance: FrontInstance) -> None:
        self.instance = instance

    def fitness(self, x: Array) -> Array:
        """Return both objectives (2,) at x (n,)."""
        return self.batch_fitness(x)

    def batch_fitness(self, xs: Array) -> Array:
        """Return both objectives (2 P,) of P concatenated points; infeasible ones are worse than any feasible point."""
        F, violation = self.instance(np.reshape(xs, (-1, len(self.instance.names))))
        return np.where(violation[:, None] > 0.0, INFEASIBLE + violation[:, None], F).ravel()

    def has_batch_fitness(self) -> bool:
        return True

    def get_bounds(self) -> tuple[Array, Array]:
        return self.instance.lower, self.instance.upper

    def get_nobj(self) -> int:
        return 2

    def get_name(self) -> str:
        return f"GaitBench {self.instance.id}"
