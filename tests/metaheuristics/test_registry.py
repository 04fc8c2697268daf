"""Algorithms of other packages, and differential evolution; settings that are refused, and how it is said."""

import sys
import warnings
from collections.abc import Callable
from functools import partial

import numpy as np
import pytest
from scipy.optimize import differential_evolution

from metaheuristics import (
    ADAPTERS,
    ALGORITHMS,
    AntColony,
    AntColonyGrid,
    Flip,
    GeneticAlgorithm,
    ParticleSwarm,
    Result,
    SearchError,
    SinglePoint,
    StaticPenalty,
    list_installed_algorithms,
    make_algorithm,
    make_handling,
    minimize,
)
from metaheuristics.adapters.cma import CmaEs
from metaheuristics.adapters.pymoo import MODULES, Pymoo
from metaheuristics.algorithms.differential_evolution import STRATEGIES, DifferentialEvolution
from metaheuristics.algorithms.genetic import GoswamiGeneticAlgorithm
from metaheuristics.interface import FEASIBILITY, Array, Start
from tests.metaheuristics.problems import disc, sphere


def test_a_package_that_is_missing_is_named_and_left_out_of_all(monkeypatch: pytest.MonkeyPatch) -> None:
    assert {"de", "cma", "pymoo:GA"} <= set(list_installed_algorithms())
    for package in ("cma", "pymoo"):
        monkeypatch.setitem(sys.modules, package, None)
    assert "de" in list_installed_algorithms() and not {"cma", "pymoo:GA"} & set(list_installed_algorithms())
    for name, package in (("cma", "cma"), ("pymoo:GA", "pymoo")):
        with pytest.raises(
            SearchError, match=rf"'{name}' needs the package {package}.*pip install 'nlp-gait\[algorithms\]'"
        ):
            make_algorithm(name)


@pytest.mark.parametrize("name", ["cma", *(f"pymoo:{name}" for name in MODULES)])
def test_searches_of_other_packages_start_from_the_shared_points_and_leave_the_global_generator(name: str) -> None:
    def run(name: str, evaluations: int) -> tuple[Result, Array]:
        first: list[Array] = []
        algorithm = make_algorithm(name, population=20)
        return minimize(
            disc(), algorithm, evaluations=evaluations, seed=7, callback=lambda X, f, v: first.append(X)
        ), first[0]

    before = np.random.get_state()[1].copy()  # type: ignore[union-attr]
    result, first = run(name, 400)
    np.testing.assert_array_equal(np.random.get_state()[1], before)  # type: ignore[index]
    if name != "cma":  # that begins at one point
        np.testing.assert_array_equal(first, run("pso", 20)[1])
    assert result.evaluations == 400 and result.objective < first.sum(axis=1).max()


@pytest.mark.parametrize("strategy", STRATEGIES)
def test_trials_of_differential_evolution_are_those_of_scipy(strategy: str) -> None:
    """SciPy's first generation from the same members and the same random numbers."""
    lower, upper = np.array([-1.0, 2.0, 0.0]), np.array([1.0, 5.0, 9.0])
    members = lower + np.random.default_rng(1).random((9, 3)) * (upper - lower)
    generations: list[Array] = []

    def objective(columns: Array) -> Array:
        generations.append(columns.T.copy())
        return np.arange(float(columns.shape[1]))  # the first is the best

    with warnings.catch_warnings():
        warnings.simplefilter("ignore")  # one generation does not converge
        differential_evolution(
            objective,
            np.column_stack([lower, upper]),
            init=members,
            strategy=strategy,
            maxiter=1,
            polish=False,
            updating="deferred",
            vectorized=True,
            seed=np.random.default_rng(2),
        )
    start = Start(lower=lower, upper=upper, initial=members, evaluations=99, rng=np.random.default_rng(2))
    search = DifferentialEvolution(strategy=strategy, population=9).start(start)
    search.tell(members, np.arange(9.0), np.zeros(9), FEASIBILITY)
    np.testing.assert_allclose(search.ask(), generations[1], rtol=1e-14)


def test_cma_restarts_with_a_growing_population() -> None:
    sizes: list[int] = []
    minimize(sphere(2), CmaEs(), evaluations=6000, seed=2, callback=lambda X, f, v: sizes.append(len(X)))
    assert sizes[0] == 10 and sorted(sizes) == sizes or set(sizes[:-1]) <= {10, 20, 40, 80, 160}
    assert 20 in sizes


@pytest.mark.parametrize(
    ("factory", "settings", "message"),
    [
        (ParticleSwarm, {"population": 0}, "ParticleSwarm: population must be a whole number >= 1, got 0; .* 50"),
        (ParticleSwarm, {"velocity_limit": 0.0}, "velocity_limit"),
        (GeneticAlgorithm, {"population": 10, "tournament": 11}, "tournament must be .* <= 10, got 11"),
        (GeneticAlgorithm, {"survival": "comma"}, "survival must be 'plus' or 'generational', got 'comma'"),
        (GeneticAlgorithm, {"crossover": "sbx"}, "crossover must be an operator"),
        (AntColony, {"archive": 1}, "archive must be a whole number >= 2"),
        (AntColonyGrid, {"population": 4, "depositors": 6}, "depositors must be .* <= 5"),
        (DifferentialEvolution, {"population": 4}, "population must be a whole number >= 5"),
        (CmaEs, {"growth": 0.5}, "CmaEs: growth must be a finite number >= 1.0, got 0.5"),
        (partial(Pymoo, algorithm="GA"), {"population": 1}, "population"),
        (StaticPenalty, {"weight": 0.0}, r"StaticPenalty: weight must be a finite number > 0\.0, got 0\.0"),
    ],
)
def test_bad_settings(factory: Callable[..., object], settings: dict[str, object], message: str) -> None:
    with pytest.raises(SearchError, match=message):
        factory(**settings)


@pytest.mark.parametrize("name", [*ALGORITHMS, *ADAPTERS])
def test_lookup_by_name(name: str) -> None:
    algorithm = make_algorithm(name, population=12)
    assert (algorithm.name, algorithm.population) == (name, 12)
    assert algorithm == {**ALGORITHMS, **ADAPTERS}[name](population=12)


@pytest.mark.parametrize(
    ("make", "name", "settings", "message"),
    [
        (
            make_algorithm,
            "psoo",
            {},
            "unknown algorithm 'psoo'; did you mean 'pso'.*Known: pso, pso-constant, ga, ga-goswami",
        ),
        (make_algorithm, "pso", {"inertial": 1.0}, "'pso' has no setting 'inertial'; did you mean 'inertia'"),
        *(
            (make_handling, text, {}, "penalty=WEIGHT, a number > 0")
            for text in ("penalty", "penalty=x", "deb=1", "debb")
        ),
    ],
)
def test_unknown_names_are_answered_with_near_ones(
    make: Callable[..., object], name: str, settings: dict[str, object], message: str
) -> None:
    with pytest.raises(SearchError, match=message):
        make(name, **settings)


def test_the_settings_of_goswami_2008() -> None:
    preset = make_algorithm("ga-goswami")
    assert preset == GoswamiGeneticAlgorithm(
        population=30, crossover=SinglePoint(probability=0.8), mutation=Flip(probability=0.1), survival="generational"
    )
