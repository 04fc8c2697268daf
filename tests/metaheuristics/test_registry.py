"""Algorithms of other packages and constraint handlings, by name."""

from __future__ import annotations

import subprocess
import sys
import warnings
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import differential_evolution

from metaheuristics import (
    ADAPTERS,
    Deb,
    EpsilonLevel,
    SearchError,
    StaticPenalty,
    make_algorithm,
    make_handling,
    minimize,
)
from metaheuristics.adapters.cma import CmaEs
from metaheuristics.adapters.pymoo import MODULES, Pymoo
from metaheuristics.algorithms.differential_evolution import STRATEGIES, DifferentialEvolution
from metaheuristics.interface import FEASIBILITY, Array, Start
from tests.metaheuristics.problems import disc, sphere


def test_names_of_adapters() -> None:
    assert make_algorithm("cma", population=20) == CmaEs(population=20)
    assert make_algorithm("de", strategy="rand1bin") == DifferentialEvolution(strategy="rand1bin")
    assert (
        make_algorithm("pymoo:NSGA2") == Pymoo(algorithm="NSGA2")
        and make_algorithm("pymoo:NSGA2").name == "pymoo:NSGA2"
    )
    assert all(make_algorithm(name).name == name for name in ADAPTERS)


def test_a_package_that_is_not_installed_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("metaheuristics.settings.find_spec", lambda name: None)
    with pytest.raises(SearchError, match=r"'cma' needs the package cma.*pip install 'nlp-gait\[algorithms\]'"):
        make_algorithm("cma")
    with pytest.raises(SearchError, match="'pymoo:GA' needs the package pymoo"):
        make_algorithm("pymoo:GA")
    assert make_algorithm("pso").name == "pso"


def test_importing_the_package_imports_none_of_them() -> None:
    program = "import sys, metaheuristics; print(*sorted(sys.modules))"
    root = Path(__file__).parents[2]
    done = subprocess.run([sys.executable, "-c", program], cwd=root, capture_output=True, text=True, timeout=60)
    assert not {"cma", "pymoo", "scipy"} & set(done.stdout.split())


def test_handlings_by_name() -> None:
    assert make_handling("deb") == Deb() and make_handling("epsilon", control=0.5) == EpsilonLevel(control=0.5)
    assert make_handling("penalty", weight=3.0) == StaticPenalty(weight=3.0)
    for name, settings, message in (
        ("penalty", {}, "constraint handling 'penalty' needs a value for 'weight'"),
        ("deb", {"weight": 1.0}, "constraint handling 'deb' has no setting 'weight'"),
        ("epsilonn", {}, "unknown constraint handling 'epsilonn'; did you mean 'epsilon'"),
    ):
        with pytest.raises(SearchError, match=message):
            make_handling(name, **settings)


@pytest.mark.parametrize(
    ("name", "settings", "message"),
    [
        ("cma", {"population": 3}, "population must be a whole number >= 4"),
        ("cma", {"sigma": 0.0}, "sigma"),
        ("cma", {"growth": 0.5}, "growth"),
        ("de", {"population": 4}, "population must be a whole number >= 5"),
        ("de", {"strategy": "best"}, "strategy must be one of best1bin"),
        ("de", {"mutation_low": 1.2}, "mutation_low must be .* <= 1.0"),
        ("de", {"recombination": 2.0}, "recombination"),
        ("pymoo:GA", {"population": 1}, "population"),
        ("pymoo:GAA", {}, "unknown algorithm 'pymoo:GAA'; did you mean 'pymoo:GA'"),
        ("pymoo:GA", {"settings": {"nonsense": 1, "seed": 1}}, None),
    ],
)
def test_bad_settings_of_adapters(name: str, settings: dict[str, object], message: str | None) -> None:
    if message is None:  # what pymoo itself takes, it takes: its own settings are passed on
        assert make_algorithm(name, **settings).population == 50
        return
    with pytest.raises(SearchError, match=message):
        make_algorithm(name, **settings)


@pytest.mark.parametrize("name", MODULES)
def test_every_pymoo_algorithm_runs_from_the_shared_points_and_leaves_the_global_generator(name: str) -> None:
    pytest.importorskip("pymoo")
    generations: list[Array] = []
    before = np.random.get_state()[1].copy()  # type: ignore[union-attr]
    result = minimize(
        disc(),
        make_algorithm(f"pymoo:{name}", population=20),
        evaluations=400,
        seed=7,
        callback=lambda X, f, v: generations.append(X),
    )
    reference: list[Array] = []
    minimize(
        disc(),
        make_algorithm("pso", population=20),
        evaluations=20,
        seed=7,
        callback=lambda X, f, v: reference.append(X),
    )
    np.testing.assert_array_equal(generations[0], reference[0])
    np.testing.assert_array_equal(np.random.get_state()[1], before)  # type: ignore[index]
    assert result.evaluations == 400 and result.objective < generations[0].sum(axis=1).max()


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


def test_two_mutants_of_random_members_need_six() -> None:
    with pytest.raises(SearchError, match="population must be a whole number >= 6"):
        DifferentialEvolution(strategy="rand2bin", population=5)


@pytest.mark.parametrize("strategy", STRATEGIES)
def test_every_strategy_of_differential_evolution_converges(strategy: str) -> None:
    result = minimize(sphere(2), DifferentialEvolution(strategy=strategy, population=20), evaluations=4000, seed=3)
    assert result.objective < 1e-3


@pytest.mark.slow
def test_cma_restarts_with_a_growing_population() -> None:
    sizes: list[int] = []
    minimize(sphere(2), CmaEs(), evaluations=6000, seed=2, callback=lambda X, f, v: sizes.append(len(X)))
    assert sizes[0] == 10 and sorted(sizes) == sizes or set(sizes[:-1]) <= {10, 20, 40, 80, 160}
    assert 20 in sizes


def test_cma_does_not_touch_the_global_generator() -> None:
    before = np.random.get_state()[1].copy()  # type: ignore[union-attr]
    minimize(disc(), CmaEs(), evaluations=500, seed=1)
    np.testing.assert_array_equal(np.random.get_state()[1], before)  # type: ignore[index]
