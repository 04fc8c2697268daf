"""Instances as problems of pygmo."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from nlp_gait.formulation import Array

if TYPE_CHECKING:
    from nlp_gait.gaitbench.instance import Instance


class UserDefinedProblem:
    """What pygmo calls: the objective, then every row as an inequality, with dense gradients."""

    def __init__(self, instance: Instance) -> None:
        """Take an instance."""
        self.instance = instance

    def fitness(self, x: Array) -> Array:
        """(1 + m,) objective and rows at x (n,)."""
        return self.batch_fitness(x)

    def batch_fitness(self, xs: Array) -> Array:
        """(P (1 + m),) of points one behind the other."""
        X = np.reshape(xs, (-1, len(self.instance.names)))
        f, _ = self.instance(X)
        return np.hstack([f[:, None], self.instance.rows(X)]).ravel()

    def has_batch_fitness(self) -> bool:
        """True."""
        return True

    def gradient(self, x: Array) -> Array:
        """((1 + m) n,) derivatives, row by row."""
        return np.vstack([self.instance.gradient(x), self.instance.jacobian(x)]).ravel()

    def get_bounds(self) -> tuple[Array, Array]:
        """(n,) lower and (n,) upper bounds."""
        return self.instance.lower, self.instance.upper

    def get_nic(self) -> int:
        """Count of inequalities, m."""
        return len(self.instance.row_names)

    def get_name(self) -> str:
        """Id of the instance."""
        return f"GaitBench {self.instance.id}"

    def get_extra_info(self) -> str:
        """What it is, and the best known objective."""
        return (
            f"\t{self.instance.definition.what}\n\tbest known: {self.instance.best_known!r}, {self.instance.evidence}"
        )


def to_pygmo(instance: Instance) -> Any:
    """See ``Instance.to_pygmo``."""
    import pygmo

    return pygmo.problem(UserDefinedProblem(instance))
