"""L-SHADE, Sobol points, CMA-ES with an augmented Lagrangian, SciPy's solvers from many starts, Bayesian optimisation."""

from __future__ import annotations

import numpy as np
import pytest

from metaheuristics import SearchError, list_installed_algorithms, make_algorithm, minimize
from metaheuristics.algorithms.differential_evolution import compute_gains, compute_lehmer_mean
from metaheuristics.interface import FEASIBILITY, Array, Start
from tests.metaheuristics.problems import Function, disc, sphere

BY_THEMSELVES = ("scipy:SLSQP", "scipy:COBYQA", "bayes")
OPTIMUM = -np.sqrt(2.0)


class Disc(Function):
    """The disc of `disc()`, whose constraint tells by how much it is met; a second one, of two rows, never binds."""

    groups = ("disc", "far", "far")

    def __init__(self) -> None:
        super().__init__(disc().function, [-2.0, -2.0], [2.0, 2.0])

    def inequalities(self, X: Array) -> Array:
        return np.stack([(X**2).sum(axis=1) - 1.0, X[:, 0] - 9.0, -9.0 - X[:, 1]], axis=1)


@pytest.mark.parametrize("name", BY_THEMSELVES)
def test_equal_seeds_give_identical_runs_within_budget_and_bounds(name: str) -> None:
    def run(seed: int) -> tuple[float, Array, list[int]]:
        problem = Disc()

        def callback(X: Array, f: Array, violation: Array) -> None:
            assert ((problem.lower <= X) & (X <= problem.upper)).all()

        result = minimize(problem, make_algorithm(name), evaluations=26, seed=seed, callback=callback)
        assert result.evaluations == sum(problem.calls) == 26
        return result.objective, result.x, problem.calls

    first, again, other = run(3), run(3), run(4)
    assert first[0] == again[0] and np.array_equal(first[1], again[1]) and first[2] == again[2]
    assert not np.array_equal(first[1], other[1])


@pytest.mark.parametrize(
    ("name", "evaluations", "within"),
    [
        ("scipy:SLSQP", 120, 1e-6),
        ("scipy:COBYQA", 300, 1e-6),
        ("cma-al", 600, 1e-4),
        pytest.param("bayes", 40, 0.02, marks=pytest.mark.slow),
    ],
)
def test_an_optimum_on_a_constraint_is_found_from_inside(name: str, evaluations: int, within: float) -> None:
    result = minimize(Disc(), make_algorithm(name), evaluations=evaluations, seed=0)
    assert result.feasible
    assert OPTIMUM <= result.objective < OPTIMUM + within


@pytest.mark.parametrize("name", ["scipy:SLSQP", "scipy:COBYQA"])
def test_a_local_solver_begins_again_until_the_budget_ends(name: str) -> None:
    """A sphere has one minimum, which takes a start some ten evaluations."""
    points: list[Array] = []
    result = minimize(
        sphere(2), make_algorithm(name), evaluations=300, seed=0, callback=lambda X, f, violation: points.append(X)
    )
    assert result.objective < 1e-6
    late = np.concatenate(points)[-200:]
    assert np.ptp(late[:, 0]) > 1.0  # elsewhere again


@pytest.mark.parametrize("name", BY_THEMSELVES)
def test_failed_evaluations_and_fixed_variables_end_nothing(name: str) -> None:
    def half(X: Array) -> tuple[Array, Array]:
        return np.where(X[:, 0] < 0.0, np.nan, ((X - 0.3) ** 2).sum(axis=1)), np.zeros(len(X))

    problem = Function(half, [-1.0, 0.1, -1.0], [1.0, 0.1, 1.0])
    result = minimize(problem, make_algorithm(name), evaluations=40, seed=1)
    assert result.failed_evaluations > 0 and result.feasible and result.x[1] == 0.1
    nothing = minimize(Function(half, [0.5, 0.1], [0.5, 0.1]), make_algorithm(name), evaluations=40)
    assert nothing.reasons == ("all variables are fixed",)


@pytest.mark.parametrize(
    ("name", "settings", "said"),
    [
        ("lshade", {"population": 3}, "LShade: population must be a whole number >= 4, got 3"),
        ("lshade", {"best": 0.0}, "best must be a finite number > 0.0 and <= 1.0, got 0.0"),
        ("lshade", {"archive": -1.0}, "archive must be a finite number >= 0.0, got -1.0"),
        ("sobol", {"batch": 0}, "batch must be a whole number >= 1, got 0"),
        ("cma-al", {"growth": 0.5}, "CmaLagrangian: growth must be a finite number >= 1.0, got 0.5"),
        ("scipy:SLSQP", {"margin": -1.0}, "SlsqpStarts: margin must be a finite number >= 0.0, got -1.0"),
        ("bayes", {"population": 501}, "population must be a whole number >= 3 and <= 500, got 501"),
    ],
)
def test_a_bad_setting_is_refused_in_one_sentence(name: str, settings: dict[str, float], said: str) -> None:
    with pytest.raises(SearchError, match=said):
        make_algorithm(name, **settings)


def test_a_package_that_is_missing_is_named_and_left_out_of_all(monkeypatch: pytest.MonkeyPatch) -> None:
    for package in ("cma", "egobox", "pymoo"):
        pytest.importorskip(package)
    assert {"lshade", "cma-al", "bayes", "scipy:COBYQA", "pymoo:GA"} <= set(list_installed_algorithms())
    monkeypatch.setattr("metaheuristics.settings.find_spec", lambda name: None)
    assert "lshade" in list_installed_algorithms() and not {"bayes", "cma-al"} & set(list_installed_algorithms())
    with pytest.raises(SearchError, match=r"'bayes' needs the package egobox.*pip install 'nlp-gait\[bayes\]'"):
        make_algorithm("bayes")


def test_bayesian_optimisation_stops_where_fitting_takes_too_long() -> None:
    start = _start(20, 2)
    search = make_algorithm("bayes").start(start)
    assert search.stop() == ()
    X = start.rng.random((500, 2))
    search.tell(X, np.full(500, 1.0), np.zeros(500), FEASIBILITY)  # a flat objective is not fitted
    assert search.stop() == ("fitting to more than 500 points takes too long",)


def test_sobol_points_are_those_of_scipy_and_fill_each_axis_evenly() -> None:
    seen: list[Array] = []
    problem = Function(lambda X: (X.sum(axis=1), np.zeros(len(X))), [0.0, 0.0, 5.0], [1.0, 1.0, 5.0])
    minimize(problem, make_algorithm("sobol"), evaluations=1 + 64, callback=lambda X, f, violation: seen.append(X))
    points = np.concatenate(seen)[1:]
    assert np.all(points[:, 2] == 5.0)
    for axis in (0, 1):  # one in each of 64 equal parts: a net in base 2
        assert sorted((points[:, axis] * 64).astype(int)) == list(range(64))


def test_the_population_of_lshade_shrinks_to_four() -> None:
    problem = sphere(2)
    minimize(problem, make_algorithm("lshade", population=40), evaluations=1000)
    assert problem.calls[0] == 40 and problem.calls[-2] <= 5
    assert all(after <= before for before, after in zip(problem.calls, problem.calls[1:], strict=False))


def test_means_and_gains_of_lshade_by_hand() -> None:
    assert compute_lehmer_mean(np.array([0.2, 0.6]), np.array([1.0, 3.0])) == pytest.approx(
        (0.04 + 3 * 0.36) / (0.2 + 1.8)
    )
    assert compute_lehmer_mean(np.zeros(2), np.ones(2)) == 0.0
    before = np.array([4.0, 2.0, 0.0, 0.0]), np.array([1.0, 1.0, 10.0, 10.0])
    after = np.array([0.0, 1.0, 0.0, 0.0]), np.array([9.0, 9.0, 5.0, 8.0])
    np.testing.assert_allclose(compute_gains(before, after), [1.0, 0.25, 1.0, 0.4])


def _start(population: int, n: int) -> Start:
    rng: np.random.Generator = np.random.default_rng(0)
    lower, upper = np.zeros(n), np.ones(n)
    return Start(lower=lower, upper=upper, initial=rng.random((population, n)), evaluations=1000, rng=rng)
