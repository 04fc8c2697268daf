"""Several objectives at once: a problem whose front is known, equal seeds, budgets, and what is refused."""

from __future__ import annotations

import numpy as np
import pytest

from metaheuristics import SearchError
from metaheuristics.interface import Array, Constraints
from metaheuristics.multi_objective import FRONT_ALGORITHMS, make_front_algorithm, minimize_many
from metaheuristics.multi_objective.constrained_moead import find_places_to_take
from metaheuristics.multi_objective.dynamic_nsga3 import compute_boundary


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


@pytest.mark.slow
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


def test_a_later_budget_does_not_change_an_earlier_snapshot() -> None:
    algorithm = make_front_algorithm("NSGA2", population=20)
    alone = minimize_many(TwoParabolas(), algorithm, evaluations=(200,), seed=0)[0]
    first = minimize_many(TwoParabolas(), algorithm, evaluations=(200, 400), seed=0)[0]
    np.testing.assert_array_equal(alone.X, first.X)


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


def test_an_unknown_algorithm_is_refused() -> None:
    with pytest.raises(SearchError, match="did you mean 'CMOEAD'"):
        make_front_algorithm("MOEAD")


@pytest.mark.parametrize("name", ["CMOEAD", "DCNSGA3"])
@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"population": 1}, "population must be a whole number >= 2, got 1"),
        ({"crossover_index": 40.0}, "crossover_index must be a finite number >= 3.0 and <= 30.0, got 40.0"),
        ({"nearest": 3}, "has no setting 'nearest'"),
    ],
)
def test_a_bad_setting_is_refused_in_one_sentence(name: str, settings: dict[str, float], said: str) -> None:
    with pytest.raises(SearchError, match=said):
        make_front_algorithm(name, **settings)


@pytest.mark.parametrize("name", ["CMOEAD", "DCNSGA3"])
def test_a_population_without_an_even_spread_of_directions_is_refused(name: str) -> None:
    class Three(TwoParabolas):
        count = 3

    with pytest.raises(SearchError, match="got 20; the nearest ones are 15 and 21"):
        minimize_many(Three(), make_front_algorithm(name, population=20), evaluations=(100,))


def test_nothing_to_vary_is_refused() -> None:
    class Fixed(TwoParabolas):
        upper = TwoParabolas.lower

    with pytest.raises(SearchError, match="all variables are fixed"):
        minimize_many(Fixed(), make_front_algorithm("CMOEAD", population=20), evaluations=(100,))


class Circle:
    """C2-DTLZ2 of two objectives: the front is what the constraint leaves of the unit circle."""

    names = tuple(f"x{k}" for k in range(5))
    lower, upper = np.zeros(5), np.ones(5)
    count = 2
    groups = ("disc",)

    def __init__(self) -> None:
        from pymoo.problems import get_problem

        self.problem = get_problem("c2dtlz2", n_var=5, n_obj=2)

    def __call__(self, X: Array) -> tuple[Array, Array]:
        F, G = self.problem.evaluate(X, return_values_of=["F", "G"])
        return F, np.maximum(0.0, G).sum(axis=1)

    def inequalities(self, X: Array) -> Array:
        return np.asarray(self.problem.evaluate(X, return_values_of=["G"]))


@pytest.mark.slow
@pytest.mark.parametrize("name", ["CMOEAD", "DCNSGA3"])
def test_the_front_of_a_published_problem_is_found(name: str) -> None:
    """Over seeds 0 to 4 no point lies farther than 0.011 from the circle; NSGA-II does no better."""
    circle = Circle()
    (found,) = minimize_many(circle, make_front_algorithm(name, population=40), evaluations=(1600,), seed=1)
    assert len(found.F) > 10
    assert np.max(np.abs(np.hypot(*found.F.T) - 1.0)) < 0.03
    assert np.all(circle(found.X)[1] == 0.0)


def test_a_look_counts_feasible_evaluations_and_time() -> None:
    (look,) = minimize_many(TwoParabolas(), make_front_algorithm("DCNSGA3", population=20), evaluations=(200,), seed=0)
    assert 0 < look.feasible < look.evaluations == 200
    assert look.first_feasible is not None and look.first_feasible <= 20
    assert 0.0 <= look.objective_time_s <= look.time_s


def test_places_go_to_a_child_that_violates_less_or_is_no_worse() -> None:
    """By hand: places 7 and 5 violate more, place 3 equally at a better value, place 2 equally at an equal one."""
    places = np.array([7, 3, 2, 5])
    old, new = np.array([0.1, 0.1, 0.5, 0.0]), np.array([0.5, 0.5, 0.5, 9.0])
    violation = np.array([2.0, 1.0, 1.0, 3.0])
    assert find_places_to_take(old, new, violation, 1.0, places, 4).tolist() == [7, 2, 5]
    assert find_places_to_take(old, new, violation, 1.0, places, 1).tolist() == [7]
    assert find_places_to_take(old, new, violation, 2.5, places, 4).tolist() == [5]


def test_the_boundary_falls_from_the_first_violation_to_zero() -> None:
    first = np.array([1.0, 400.0])
    np.testing.assert_allclose(compute_boundary(first, 0, 10, 5.0), first, atol=2e-8)
    np.testing.assert_array_equal(compute_boundary(first, 10, 10, 5.0), 0.0)
    # By hand for cp = 1: halfway the logarithm has fallen by half, so 1 has become 1e-4.
    np.testing.assert_allclose(compute_boundary(np.array([1.0]), 5, 10, 1.0), 1e-4, rtol=1e-3)


def test_separate_constraints_are_given_by_their_worst_row() -> None:
    """The value of a group is that of its worst row; a row without a finite value is the greatest."""
    rows = np.array([[-1.0, 2.0, 0.5], [np.nan, -3.0, -0.5]])
    constraints = Constraints(inequalities=lambda X: rows, groups=("a", "a", "b"))
    np.testing.assert_array_equal(constraints.worst(np.zeros((2, 1))), [[2.0, 0.5], [1e30, -0.5]])
