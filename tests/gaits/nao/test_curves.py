"""Richer motions of the NAO phases: what they contain, what they keep, what limits them, and what they save."""

import numpy as np
import pytest

from nlp_gait.formulation import Array, GaitProblem, load
from tests.backends.toys import row_violations
from tests.evaluation import evaluated
from tests.gaits.nao.test_readings import PRINTED

NAMES = ("nao-ssp", "nao-dsp")
OWN = {"nao-ssp": 9, "nao-dsp": 8}
# The same sums in another order.
ROUNDING = 1e-12


def padded(problem: GaitProblem, coefficients: float | Array = 0.0) -> Array:
    x = np.zeros(len(problem.names))
    own = OWN[problem.name]
    x[:own], x[own:] = PRINTED[problem.name, "PSO"][0], coefficients
    return x


def some(problem: GaitProblem, seed: int = 0) -> Array:
    """Coefficients of a few millimetres and centiradians."""
    units = np.array([0.005 if v.unit == "m" else 0.05 for v in problem.variables[OWN[problem.name] :]])
    return units * np.random.default_rng(seed).normal(size=len(units))


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("order", ["quintic", "spline-4"])
def test_without_coefficients_the_motion_is_the_papers(name: str, order: str) -> None:
    problem = load(name, trajectory=order, samples_per_interval=1)
    rich, plain = evaluated(problem, padded(problem)), evaluated(load(name), PRINTED[name, "PSO"][0])
    assert rich.metrics == pytest.approx(plain.metrics, rel=ROUNDING)


@pytest.mark.parametrize("name", NAMES)
def test_ends_stay(name: str) -> None:
    problem = load(name, trajectory="spline-2").dense(100)
    assert problem is not None
    moved, paper = (problem.signals(padded(problem, c)).arrays for c in (some(problem), 0.0))
    for row in (0, -1):
        for signal in ("q", "qd", "hip", "left_foot", "right_foot"):
            np.testing.assert_allclose(moved[signal][row], paper[signal][row], rtol=0, atol=ROUNDING)
    assert np.abs(moved["hip"] - paper["hip"]).max() > 1e-3


@pytest.mark.parametrize(
    ("curve", "value", "row"),
    [
        ("foot_x_m", 0.02, "foot_middle"),
        ("foot_z_m", -0.2, "foot_height["),
        ("foot_z_m", -0.01, "foot_lift"),
        ("LElbowRoll_rad", 3.0, "arm_angle[LElbowRoll"),
    ],
)
def test_what_only_a_spline_can_break_is_a_limit(curve: str, value: float, row: str) -> None:
    problem = load("nao-ssp", trajectory="quintic")
    x = padded(problem)
    assert not row_violations(problem, x)
    x[[problem.variable_index(f"{curve}[{k}]") for k in range(2)]] = value
    assert any(found.name.startswith(row) for found in row_violations(problem, x))
