"""The loop: budget, pairing, stopping, interruption, checks of arguments and answers."""

import pickle

import numpy as np
import pytest

from metaheuristics import AntColony, GeneticAlgorithm, Interrupted, ParticleSwarm, SearchError, minimize
from metaheuristics.interface import Algorithm, Array
from tests.metaheuristics.problems import Function, disc, sphere

SWARM = ParticleSwarm(population=10)


def first_generation(algorithm: Algorithm, seed: int) -> Array:
    """Starting points of a run."""
    generations: list[Array] = []
    minimize(
        disc(), algorithm, evaluations=algorithm.population, seed=seed, callback=lambda X, f, v: generations.append(X)
    )
    return generations[0]


def test_starting_points_depend_on_the_seed_alone() -> None:
    swarm, genetic = first_generation(ParticleSwarm(), 7), first_generation(GeneticAlgorithm(), 7)
    np.testing.assert_array_equal(swarm, genetic)
    np.testing.assert_array_equal(first_generation(AntColony(population=30), 7), swarm[:30])
    assert not np.array_equal(first_generation(ParticleSwarm(), 8), swarm)
    assert np.unique(swarm).size == swarm.size
    assert (swarm.min(axis=0) < -1.5).all() and (swarm.max(axis=0) > 1.5).all()


def test_given_points_replace_the_first_rows() -> None:
    given = np.array([[0.5, 0.25], [0.0, 1.0]])
    generations: list[Array] = []
    minimize(disc(), SWARM, evaluations=10, seed=7, initial=given, callback=lambda X, f, v: generations.append(X))
    np.testing.assert_array_equal(generations[0][:2], given)
    np.testing.assert_array_equal(generations[0][2:], first_generation(SWARM, 7)[2:])


def test_interruption_carries_the_complete_generations() -> None:
    problem = disc()
    evaluate = problem.function

    def function(X: Array) -> tuple[Array, Array]:
        if len(problem.calls) == 4:
            raise KeyboardInterrupt
        return evaluate(X)

    problem.function = function
    with pytest.raises(KeyboardInterrupt) as caught:
        minimize(problem, SWARM, seed=3)
    assert isinstance(caught.value, Interrupted)
    partial = pickle.loads(pickle.dumps(caught.value)).result
    whole = minimize(disc(), SWARM, seed=3, evaluations=30)
    assert partial.reasons == ("interrupted",) and partial.evaluations == 30
    np.testing.assert_array_equal(partial.x, whole.x)
    assert "30 evaluations" in str(caught.value)


def test_the_objective_cannot_write_into_its_points() -> None:
    def function(X: Array) -> tuple[Array, Array]:
        X[:] = 0.0
        return X[:, 0], X[:, 0]

    with pytest.raises(ValueError, match="read-only"):
        minimize(Function(function, [0.0], [1.0]), SWARM)


@pytest.mark.parametrize(
    ("lower", "upper", "message"),
    [
        ([0.0, 1.0], [1.0, 0.0], r"'x1'.*lower <= upper.*1\.0 and 0\.0"),
        ([0.0, 0.0], [1.0], r"shape.*\(2,\).*\(1,\)"),
    ],
)
def test_bad_bounds(lower: list[float], upper: list[float], message: str) -> None:
    with pytest.raises(SearchError, match=message):
        minimize(Function(lambda X: (X[:, 0], X[:, 0]), lower, upper), SWARM)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"evaluations": 9}, "population of 'pso', 10, got 9: raise"),
        ({"seed": -1}, "seed must be a whole number >= 0"),
        ({"initial": np.zeros(2)}, r"initial: .* shape \(P, 2\).*got shape \(2,\)"),
        ({"initial": np.full((1, 2), 9.0)}, r"initial: 9\.0 for variable 0 of point 0, outside the bounds"),
    ],
)
def test_bad_arguments(arguments: dict[str, object], message: str) -> None:
    with pytest.raises(SearchError, match=message):
        minimize(sphere(2), SWARM, **arguments)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (np.zeros(10), "returned ndarray: return a tuple"),
        ((np.zeros((10, 1)), np.zeros(10)), r"got shapes \(10, 1\) and \(10,\)"),
        ((np.zeros(10), ["0.0"] * 10), "real numbers"),
        ((np.zeros(10), np.full(10, -1e-9)), "violation must be >= 0.*row 0 has -1e-09"),
    ],
)
def test_bad_answers(answer: tuple[Array, Array], message: str) -> None:
    with pytest.raises(SearchError, match=message):
        minimize(Function(lambda X: answer, [0.0], [1.0]), SWARM)


def test_time_limit() -> None:
    result = minimize(disc(), SWARM, time_limit_s=1e-9)
    assert result.reasons == ("time limit reached",) and result.generations == 1
