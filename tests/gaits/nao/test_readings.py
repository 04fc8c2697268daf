"""Readings of Gupta, Pratihar, Deb (2023) under which the printed numbers come out of the printed solutions."""

from typing import Any

import numpy as np
import pytest

import nlp_gait
from nlp_gait.backends.exact import ExactValues, build_exact_model

# Tables 6 to 9: x, and the least and the mean margins in x and y [mm].
PRINTED = {
    ("nao-ssp", "PSO"): (
        (0.31, -0.0020, 0.0034, 0.0080, 0.0025, 0.0243, -0.0256, 0.015, 4.0),
        {"dbm_x_min_m": 30.7, "dbm_y_min_m": 8.5, "dbm_x_mean_m": 64.1, "dbm_y_mean_m": 20.0},
    ),
    ("nao-ssp", "GA"): (
        (0.31, -0.005, 0.000, 0.0031, 0.0017, 0.0364, -0.0135, 0.015, 4.0),
        {"dbm_x_min_m": 30.8, "dbm_y_min_m": 8.4, "dbm_x_mean_m": 59.1, "dbm_y_mean_m": 20.0},
    ),
    ("nao-dsp", "PSO"): (
        (0.31, -0.0008, -0.0055, 0.0520, 0.0010, -0.0367, -0.0424, 2.0),
        {"dbm_x_min_m": 73.4, "dbm_y_min_m": 70.0},
    ),
    ("nao-dsp", "GA"): (
        (0.31, 0.0002, -0.0052, 0.0582, 0.0010, -0.0384, -0.0405, 2.0),
        {"dbm_x_min_m": 73.1, "dbm_y_min_m": 69.9},
    ),
}
# Ten samples, (19) and (20) as printed, 23 masses in double support.
READING: dict[str, dict[str, Any]] = {
    "nao-ssp": {"intervals": 9, "zmp_gravity": "printed"},
    "nao-dsp": {"intervals": 9, "zmp_gravity": "printed", "zmp_masses": 23},
}


def evaluate(name: str, x: tuple[float, ...], **options: Any) -> ExactValues:
    problem = nlp_gait.load(name, **options)
    return build_exact_model(problem).at(np.array(x), problem.p)


@pytest.mark.parametrize(("name", "algorithm"), PRINTED)
def test_printed_margins_follow_from_printed_solutions(name: str, algorithm: str) -> None:
    x, margins_mm = PRINTED[name, algorithm]
    metrics = evaluate(name, x, **READING[name]).metrics
    for index, value_mm in margins_mm.items():
        assert 1000.0 * metrics[index] == pytest.approx(value_mm, abs=0.2), index


@pytest.mark.parametrize(
    ("share", "arms", "power_W"),  # of PSO's printed solution, recomputed by hand from the text [W]
    [
        ("printed", "carried", 0.629),
        ("printed", "separate", 0.598),
        ("printed", "shared", 0.884),
        ("lever", "carried", 0.511),
        ("lever", "separate", 0.521),
        ("lever", "shared", 0.774),
    ],
)
def test_power_of_double_support_by_who_carries_the_arms(share: str, arms: str, power_W: float) -> None:
    x, _ = PRINTED["nao-dsp", "PSO"]
    found = evaluate("nao-dsp", x, intervals=9, torso_share=share, arms=arms).metrics["power_W"]
    assert found == pytest.approx(power_W, abs=0.001)


@pytest.mark.parametrize(("derivatives", "edge_order"), [("finite-difference", 1), ("finite-difference-2", 2)])
def test_differences_are_those_of_numpy(derivatives: str, edge_order: int) -> None:
    problem = nlp_gait.load("nao-ssp", derivatives=derivatives)
    arrays = problem.signals(PRINTED["nao-ssp", "PSO"][0]).arrays
    rates = np.gradient(arrays["q"], arrays["t"], axis=0, edge_order=edge_order)
    np.testing.assert_allclose(arrays["qd"], rates, atol=1e-12)
    np.testing.assert_allclose(
        arrays["qdd"], np.gradient(rates, arrays["t"], axis=0, edge_order=edge_order), atol=1e-12
    )


@pytest.mark.parametrize(
    ("name", "share", "power_W"),
    [("nao-ssp", {}, 0.845868), ("nao-dsp", {}, 0.531886), ("nao-dsp", {"torso_share": "lever"}, 0.464777)],
)
def test_ipopt_finds_the_optimum_from_a_random_start(name: str, share: dict[str, Any], power_W: float) -> None:
    solution = nlp_gait.solve(nlp_gait.load(name, **share), starts=1, seed=1)
    assert solution.converged and solution.objective == pytest.approx(power_W, rel=1e-5)
