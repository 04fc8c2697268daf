"""Formulas of the algorithms against cases computed by hand."""

from collections.abc import Sequence

import numpy as np
import pytest

from metaheuristics.algorithms.ant_colony import AntColony, compute_deviations, compute_probabilities, pick, renew
from metaheuristics.algorithms.genetic import (
    Flip,
    GeneticAlgorithm,
    SinglePoint,
    cross_simulated_binary,
    hold_tournaments,
    mutate_polynomially,
)
from metaheuristics.algorithms.particle_swarm import ParticleSwarm
from metaheuristics.interface import FEASIBILITY, Points, Start

WIDE = 1e9  # bounds so far away that they do not bend a distribution


def test_swarm_follows_the_source_particle_by_particle() -> None:
    lower, upper, n = [-1.0, 0.0], [1.0, 0.5], 2
    initial = np.array([[0.9, 0.1], [-0.5, 0.5], [0.0, 0.2]])
    rng, twin = np.random.default_rng(5), np.random.default_rng(5)
    search = ParticleSwarm(population=3).start(
        Start(lower=np.array(lower), upper=np.array(upper), initial=initial, evaluations=30, rng=rng)
    )

    def cost(x: Sequence[float]) -> float:
        return (x[0] - 2.0) ** 2 + (x[1] + 1.0) ** 2  # optimum outside: particles run into the bounds

    x, v = initial.tolist(), [[0.0] * n for _ in initial]
    own, w, turned = [list(row) for row in x], 1.0, 0
    for _ in range(10):
        X = search.ask()
        np.testing.assert_allclose(X, x, rtol=1e-12)
        search.tell(X, np.array([cost(row) for row in x]), np.zeros(3), FEASIBILITY)
        own = [list(new) if cost(new) < cost(old) else old for old, new in zip(own, x, strict=True)]
        leader = min(own, key=cost)
        r1, r2 = twin.random((2, 3, n))
        for i in range(3):
            for j in range(n):
                limit = 0.1 * (upper[j] - lower[j])
                v[i][j] = w * v[i][j] + 1.5 * r1[i, j] * (own[i][j] - x[i][j]) + 2.0 * r2[i, j] * (leader[j] - x[i][j])
                v[i][j] = min(max(v[i][j], -limit), limit)
                x[i][j] += v[i][j]
                if x[i][j] < lower[j] or x[i][j] > upper[j]:
                    v[i][j] *= -1.0
                    turned += 1
                x[i][j] = min(max(x[i][j], lower[j]), upper[j])
        w *= 0.99
    assert turned > 0


@pytest.mark.parametrize(("u", "spread"), [(0.5, 1.0), (0.0, 0.0), (0.25, 0.5 ** (1 / 3)), (0.75, 2 ** (1 / 3))])
def test_sbx_far_from_bounds(u: float, spread: float) -> None:
    # Index 2: spread = (2u)^(1/3) up to u = 1/2, then (1 / (2 (1 - u)))^(1/3); children 3 -+ spread * 1.
    low, high = cross_simulated_binary(
        np.array([[4.0]]), np.array([[2.0]]), np.array([-WIDE]), np.array([WIDE]), 2.0, np.array([[u]])
    )
    np.testing.assert_allclose([low[0, 0], high[0, 0]], [3.0 - spread, 3.0 + spread], rtol=1e-12)


def test_sbx_near_a_bound() -> None:
    # Parents 1 and 3 within 0..3, index 2, u = 0.75.
    # Low side: beta = 1 + 2 * 1 / 2 = 2, alpha = 2 - 1/8 = 1.875, u alpha = 1.40625 > 1:
    # spread (1 / 0.59375)^(1/3). High side: beta = 1, alpha = 1, u alpha = 0.75: spread 0.75^(1/3).
    low, high = cross_simulated_binary(
        np.array([[1.0]]), np.array([[3.0]]), np.array([0.0]), np.array([3.0]), 2.0, np.array([[0.75]])
    )
    np.testing.assert_allclose(low, 2.0 - (1 / 0.59375) ** (1 / 3))
    np.testing.assert_allclose(high, 2.0 + 0.75 ** (1 / 3))


def test_polynomial_mutation() -> None:
    # Index 1, x = 0.5 in 0..1: u = 0.125 gives 1 - sqrt(0.25 + 0.75 * 0.25) = 1 - sqrt(0.4375) downwards; u = 0.875
    # the same upwards; u = 0.5 nothing; u = 0 the lower bound. In 0..2 about 1 the steps double.
    u = np.array([[0.125, 0.875, 0.5, 0.0, 0.125]])
    X = np.array([[0.5, 0.5, 0.5, 0.5, 1.0]])
    mutant = mutate_polynomially(X, np.zeros(5), np.array([1.0, 1.0, 1.0, 1.0, 2.0]), 1.0, u)
    step = 1.0 - np.sqrt(0.4375)
    np.testing.assert_allclose(mutant, [[0.5 - step, 0.5 + step, 0.5, 0.0, 1.0 - 2.0 * step]], atol=1e-15)


def test_single_point_crossover_exchanges_a_tail() -> None:
    rng = np.random.default_rng(0)
    A, B = np.zeros((300, 4)), np.ones((300, 4))
    first, second = SinglePoint(probability=1.0)(A, B, A[0], B[0], rng)
    np.testing.assert_array_equal(first + second, 1.0)
    assert {tuple(row) for row in first.tolist()} == {(0, 1, 1, 1), (0, 0, 1, 1), (0, 0, 0, 1)}
    np.testing.assert_array_equal(SinglePoint(probability=0.0)(A, B, A[0], B[0], rng)[0], A)


def test_flip_mutation_of_the_paper() -> None:
    lower, upper = np.array([0.05]), np.array([0.13])
    flipped = Flip(probability=1.0)(np.array([[0.07]]), lower, upper, np.random.default_rng(0))
    np.testing.assert_allclose(flipped, [[0.11]])  # Goswami et al. (2008), section 5.4: (0.05 + 0.13) - 0.07


def test_binary_tournaments_draw_every_parent_twice() -> None:
    winners = np.bincount(hold_tournaments(50, 50, 2, np.random.default_rng(0)), minlength=50)
    assert winners.sum() == 50 and winners[0] == 2 and winners[-1] == 0 and winners.max() == 2


def test_copies_survive_only_if_nothing_else_is_left() -> None:
    points = Points(np.array([[1.0], [1.0], [2.0], [3.0]]), np.array([1.0, 1.0, 2.0, 3.0]), np.zeros(4))
    assert points.best_distinct(3, FEASIBILITY).X.ravel().tolist() == [1.0, 2.0, 3.0]
    assert points.best_distinct(4, FEASIBILITY).X.ravel().tolist() == [1.0, 2.0, 3.0, 1.0]


@pytest.mark.parametrize(
    ("settings_of_survival", "keeps_the_parent"),
    [({}, True), ({"survival": "generational"}, True), ({"survival": "generational", "elites": 0}, False)],
)
def test_who_survives_worse_children(settings_of_survival: dict[str, str | int], keeps_the_parent: bool) -> None:
    # Tournaments of all, without crossover and mutation: every child is a copy of the best survivor.
    genetic = GeneticAlgorithm(
        population=4,
        tournament=4,
        crossover=SinglePoint(probability=0.0),
        mutation=Flip(probability=0.0),
        **settings_of_survival,  # type: ignore[arg-type]
    )
    first, second = np.array([[0.1], [0.2], [0.3], [0.4]]), np.array([[0.5], [0.6], [0.7], [0.8]])
    rng = np.random.default_rng(0)
    search = genetic.start(Start(lower=np.zeros(1), upper=np.ones(1), initial=first, evaluations=12, rng=rng))
    search.tell(search.ask(), np.array([3.0, 1.0, 2.0, 4.0]), np.zeros(4), FEASIBILITY)
    assert search.ask().ravel().tolist() == [0.2] * 4
    search.tell(second, np.array([8.0, 7.0, 5.0, 6.0]), np.zeros(4), FEASIBILITY)
    assert search.ask().ravel().tolist() == [0.2 if keeps_the_parent else 0.7] * 4


def test_a_collapsed_archive_ends_the_search() -> None:
    initial = np.full((3, 2), 0.5)
    rng = np.random.default_rng(0)
    search = AntColony(population=3).start(
        Start(lower=np.zeros(2), upper=np.ones(2), initial=initial, evaluations=9, rng=rng)
    )
    assert search.stop() == ()
    search.tell(search.ask(), np.zeros(3), np.zeros(3), FEASIBILITY)
    assert search.stop() == ("archive collapsed to one point",)


def test_archive_probabilities() -> None:
    # q k = 0.5 * 4 = 2: weights exp(0), exp(-1/8), exp(-4/8), exp(-9/8).
    weights = np.exp([0.0, -0.125, -0.5, -1.125])
    np.testing.assert_allclose(compute_probabilities(4, 0.5), weights / weights.sum())
    np.testing.assert_allclose(compute_probabilities(50, 1e-4), np.eye(50)[0])  # the greedy q of the source


def test_archive_deviations() -> None:
    archive = np.array([[0.0, 1.0], [1.0, 1.0], [5.0, 1.0]])
    # From 1: (1 + 0 + 4) / 2 * 0.8 = 2; from 5: (5 + 4 + 0) / 2 * 0.8 = 3.6.
    np.testing.assert_allclose(compute_deviations(archive, archive[[1, 2]], 0.8), [[2.0, 0.0], [3.6, 0.0]])


def test_pheromone_renewal() -> None:
    pheromone = np.array([[0.5, 0.5, 0.0], [0.2, 0.2, 0.6]])
    renewed = renew(pheromone, np.array([[0, 2], [0, 1]]), np.array([3.0, 1.0]), 0.7)
    np.testing.assert_allclose(renewed, [[0.15 + 0.7, 0.15, 0.0], [0.06, 0.06 + 0.175, 0.18 + 0.525]])
    np.testing.assert_allclose(renewed.sum(axis=1), 1.0)


def test_levels_are_picked_by_cumulative_weight() -> None:
    probability = np.array([[0.25, 0.0, 0.75], [1.0, 1.0, 2.0]])
    u = np.array([[0.0, 0.0], [0.24, 0.26], [0.25, 0.5], [np.nextafter(1.0, 0.0)] * 2])
    assert pick(probability, u).tolist() == [[0, 0], [0, 1], [2, 2], [2, 2]]
