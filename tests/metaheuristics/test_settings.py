"""Settings and the registry: what is refused, and how it is said."""

from collections.abc import Callable
from functools import partial

import pytest

from metaheuristics import (
    ADAPTERS,
    ALGORITHMS,
    AntColony,
    AntColonyGrid,
    EpsilonLevel,
    Flip,
    GeneticAlgorithm,
    ParticleSwarm,
    SearchError,
    SinglePoint,
    StaticPenalty,
    make_algorithm,
    make_handling,
)
from metaheuristics.adapters.cma import CmaEs
from metaheuristics.adapters.pymoo import Pymoo
from metaheuristics.algorithms.differential_evolution import DifferentialEvolution, LShade
from metaheuristics.algorithms.genetic import GoswamiGeneticAlgorithm


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
        (LShade, {"best": 0.0}, "best must be a finite number > 0.0 and <= 1.0, got 0.0"),
        (CmaEs, {"growth": 0.5}, "CmaEs: growth must be a finite number >= 1.0, got 0.5"),
        (partial(Pymoo, algorithm="GA"), {"population": 1}, "population"),
        (StaticPenalty, {"weight": 0.0}, r"StaticPenalty: weight must be a finite number > 0\.0, got 0\.0"),
        (EpsilonLevel, {"share": 1.5}, "share must be .* >= 0.0 and <= 1.0, got 1.5"),
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
