"""Small objectives with known optima, for the tests of `metaheuristics`."""

from collections.abc import Callable, Sequence

import numpy as np

from metaheuristics.interface import Array


class Function:
    """A batch objective made of a function."""

    def __init__(
        self, function: Callable[[Array], tuple[Array, Array]], lower: Sequence[float], upper: Sequence[float]
    ) -> None:
        """Take a function of X (P, n) that returns f (P,) and violation (P,), and the bounds."""
        self.function = function
        self.lower = np.array(lower, dtype=float)
        self.upper = np.array(upper, dtype=float)
        self.names = tuple(f"x{i}" for i in range(len(self.lower)))
        self.calls: list[int] = []

    def __call__(self, X: Array) -> tuple[Array, Array]:
        """Evaluate and note the number of rows."""
        self.calls.append(len(X))
        return self.function(X)


def sphere(n: int = 4) -> Function:
    """Sum of squares about 0.3; optimum 0."""
    return Function(lambda X: (((X - 0.3) ** 2).sum(axis=1), np.zeros(len(X))), [-5.0] * n, [5.0] * n)


def rosenbrock() -> Function:
    """Rosenbrock's valley in two variables; optimum 0 at (1, 1)."""

    def function(X: Array) -> tuple[Array, Array]:
        return 100.0 * (X[:, 1] - X[:, 0] ** 2) ** 2 + (1.0 - X[:, 0]) ** 2, np.zeros(len(X))

    return Function(function, [-2.0, -2.0], [2.0, 2.0])


def disc() -> Function:
    """Sum of the variables within the unit disc; optimum -sqrt(2) at -(1, 1) / sqrt(2), on the constraint."""

    def function(X: Array) -> tuple[Array, Array]:
        return X.sum(axis=1), np.maximum(0.0, (X**2).sum(axis=1) - 1.0)

    return Function(function, [-2.0, -2.0], [2.0, 2.0])


def infeasible() -> Function:
    """Violation of at least 1, reached at 0.3 in both variables, and an objective that pulls elsewhere."""

    def function(X: Array) -> tuple[Array, Array]:
        return X.sum(axis=1), 1.0 + np.abs(X - 0.3).sum(axis=1)

    return Function(function, [-2.0, -2.0], [2.0, 2.0])
