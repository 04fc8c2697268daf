"""Settings and the registry: what is refused, and how it is said."""

from __future__ import annotations

import dataclasses

import numpy as np
import pytest

from metaheuristics import (
    ALGORITHMS,
    AntColony,
    AntColonyGrid,
    Flip,
    GeneticAlgorithm,
    ParticleSwarm,
    Polynomial,
    SearchError,
    SimulatedBinary,
    SinglePoint,
    make_algorithm,
)


@pytest.mark.parametrize(
    ("factory", "settings", "message"),
    [
        (ParticleSwarm, {"population": 0}, "ParticleSwarm: population must be a whole number >= 1, got 0; .* 50"),
        (ParticleSwarm, {"population": 10.0}, "whole number"),
        (ParticleSwarm, {"inertia": np.nan}, "inertia must be a finite number"),
        (ParticleSwarm, {"inertia": "1"}, "inertia must be a finite number"),
        (ParticleSwarm, {"inertia_damping": 1.01}, "inertia_damping"),
        (ParticleSwarm, {"velocity_limit": 0.0}, "velocity_limit"),
        (GeneticAlgorithm, {"population": 1}, "population"),
        (GeneticAlgorithm, {"population": 10, "tournament": 11}, "tournament must be .* <= 10, got 11"),
        (GeneticAlgorithm, {"population": 10, "elites": 10}, "elites must be .* <= 9"),
        (GeneticAlgorithm, {"survival": "comma"}, "survival must be 'plus' or 'generational', got 'comma'"),
        (GeneticAlgorithm, {"crossover": "sbx"}, "crossover must be an operator"),
        (SimulatedBinary, {"probability": 1.1}, "probability"),
        (SinglePoint, {"probability": -0.1}, "probability"),
        (Polynomial, {"probability": 2.0}, "probability"),
        (Flip, {"probability": np.inf}, "probability"),
        (AntColony, {"archive": 1}, "archive must be a whole number >= 2"),
        (AntColony, {"locality": 0.0}, "locality must be a finite number > 0"),
        (AntColony, {"spread": -1.0}, "spread"),
        (AntColonyGrid, {"levels": 1}, "levels"),
        (AntColonyGrid, {"evaporation": 0.0}, "evaporation"),
        (AntColonyGrid, {"population": 4, "depositors": 6}, "depositors must be .* <= 5"),
    ],
)
def test_bad_settings(factory: type, settings: dict[str, object], message: str) -> None:
    with pytest.raises(SearchError, match=message):
        factory(**settings)


@pytest.mark.parametrize("name", ALGORITHMS)
def test_lookup_by_name(name: str) -> None:
    made = make_algorithm(name, population=12)
    assert made.name == name and made.population == 12 and made == ALGORITHMS[name](population=12)


def test_unknown_names_are_answered_with_near_ones() -> None:
    with pytest.raises(
        SearchError, match="unknown algorithm 'psoo'; did you mean 'pso'.*Known: pso, pso-constant, ga, aco, aco-grid"
    ):
        make_algorithm("psoo")
    with pytest.raises(SearchError, match="'pso' has no setting 'inertial'; did you mean 'inertia'"):
        make_algorithm("pso", inertial=1.0)
    with pytest.raises(SearchError, match="unknown algorithm 'simplex'; Known"):
        make_algorithm("simplex")


def test_settings_are_immutable() -> None:
    with pytest.raises(dataclasses.FrozenInstanceError):
        ParticleSwarm().inertia = 0.5  # type: ignore[misc]


def test_the_settings_of_goswami_2008() -> None:
    preset = GeneticAlgorithm.goswami2008()
    assert (preset.population, preset.crossover, preset.mutation) == (
        30,
        SinglePoint(probability=0.8),
        Flip(probability=0.1),
    )
