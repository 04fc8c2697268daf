"""Several objectives at once: a problem whose front is known, equal seeds, budgets, and what is refused."""

import numpy as np
import pytest

from metaheuristics import SearchError
from metaheuristics.interface import Array
from metaheuristics.multi_objective import FRONT_ALGORITHMS, make_front_algorithm, minimize_many


class TwoParabolas:
    """Squared distances from (0, 0) and (1, 0), feasible for y >= 0.1: the front is x in [0, 1] at y = 0.1. z is fixed."""

    names = ("x", "y", "z")
    lower = np.array([-1.0, -1.0, 2.0])
    upper = np.array([2.0, 2.0, 2.0])
    count = 2

    def __call__(self, X: Array) -> tuple[Array, Array]:
        assert np.all(X[:, 2] == 2.0)
        x, y = X[:, 0], X[:, 1]
        return np.stack([x**2 + y**2, (x - 1) ** 2 + y**2], axis=1), np.maximum(0.0, 0.1 - y)


@pytest.mark.parametrize("name", FRONT_ALGORITHMS)
def test_fronts_are_feasible_near_the_true_one_and_repeat_with_their_seed(name: str) -> None:
    algorithm = make_front_algorithm(name, population=20)
    first, second = minimize_many(TwoParabolas(), algorithm, evaluations=(20, 800), seed=3)
    assert (first.evaluations, second.evaluations) == (20, 800)
    x, y = second.X[:, 0], second.X[:, 1]
    assert len(x) > 5
    assert np.all(y >= 0.1)
    assert np.median(y) < 0.2
    assert np.min(x) < 0.2 and np.max(x) > 0.8
    again = minimize_many(TwoParabolas(), algorithm, evaluations=(20, 800), seed=3)[1]
    np.testing.assert_array_equal(second.X, again.X)
    np.testing.assert_array_equal(second.F, again.F)


def test_without_a_feasible_point_the_front_is_empty() -> None:
    class Infeasible(TwoParabolas):
        def __call__(self, X: Array) -> tuple[Array, Array]:
            return super().__call__(X)[0], np.full(len(X), 1.0)

    (only,) = minimize_many(Infeasible(), make_front_algorithm("NSGA2", population=10), evaluations=(30,))
    assert only.X.shape == (0, 3)
    assert only.F.shape == (0, 2)


@pytest.mark.parametrize("budgets", [(), (5,), (400, 200)])
def test_budgets_that_cannot_be_are_refused(budgets: tuple[int, ...]) -> None:
    with pytest.raises(SearchError, match="evaluations must rise"):
        minimize_many(TwoParabolas(), make_front_algorithm("NSGA2", population=20), evaluations=budgets)
