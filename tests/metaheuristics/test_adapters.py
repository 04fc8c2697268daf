"""L-SHADE, and algorithms whose package is missing."""

from __future__ import annotations

import numpy as np
import pytest

from metaheuristics import SearchError, list_installed_algorithms, make_algorithm, minimize
from metaheuristics.algorithms.differential_evolution import compute_gains, compute_lehmer_mean
from tests.metaheuristics.problems import sphere


@pytest.mark.parametrize(
    ("name", "settings", "said"),
    [
        ("lshade", {"population": 3}, "LShade: population must be a whole number >= 4, got 3"),
        ("lshade", {"best": 0.0}, "best must be a finite number > 0.0 and <= 1.0, got 0.0"),
        ("lshade", {"archive": -1.0}, "archive must be a finite number >= 0.0, got -1.0"),
        ("cma", {"growth": 0.5}, "CmaEs: growth must be a finite number >= 1.0, got 0.5"),
    ],
)
def test_a_bad_setting_is_refused_in_one_sentence(name: str, settings: dict[str, float], said: str) -> None:
    with pytest.raises(SearchError, match=said):
        make_algorithm(name, **settings)


def test_a_package_that_is_missing_is_named_and_left_out_of_all(monkeypatch: pytest.MonkeyPatch) -> None:
    for package in ("cma", "pymoo"):
        pytest.importorskip(package)
    assert {"lshade", "cma", "pymoo:GA"} <= set(list_installed_algorithms())
    monkeypatch.setattr("metaheuristics.settings.find_spec", lambda name: None)
    assert "lshade" in list_installed_algorithms() and not {"cma", "pymoo:GA"} & set(list_installed_algorithms())
    with pytest.raises(SearchError, match=r"'cma' needs the package cma.*pip install 'nlp-gait\[algorithms\]'"):
        make_algorithm("cma")


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
