"""Splines against SciPy, and what they leave alone."""

import casadi as ca
import numpy as np
import pytest
from casadi import SX
from scipy.interpolate import BSpline

from nlp_gait.symbolic.trajectories import DEGREE, basis, count_coefficients, spline

# The third derivative of 16 spans reaches 1e5; double precision leaves 1e-11 of it.
TOLERANCE, DERIVATIVE_SHARE = 1e-12, 1e-11
SPANS = (1, 2, 4, 8, 16)
PHASES = np.linspace(0.0, 1.0, 53)


def tabulate_basis(spans: int, phases: np.ndarray, order: int = 0) -> np.ndarray:
    phase = SX.sym("phase")
    return ca.Function("basis", [phase], [basis(spans, phase, order)]).map(len(phases))(phases[None, :]).full()


def scipy_spline(coefficients: np.ndarray) -> BSpline:
    spans = len(coefficients) - 1
    knots = np.concatenate([np.zeros(DEGREE), np.linspace(0.0, 1.0, spans + 1), np.ones(DEGREE)])
    return BSpline(knots, np.concatenate([[0.0, 0.0], coefficients, [0.0, 0.0]]), DEGREE)


@pytest.mark.parametrize("spans", SPANS)
@pytest.mark.parametrize("order", range(4))
def test_derivatives_are_those_of_scipy(spans: int, order: int) -> None:
    coefficients = np.random.default_rng(spans).normal(size=count_coefficients(spans))
    expected = scipy_spline(coefficients)(PHASES, nu=order)
    got = tabulate_basis(spans, PHASES, order).T @ coefficients
    np.testing.assert_allclose(got, expected, rtol=0, atol=DERIVATIVE_SHARE * np.abs(expected).max())


@pytest.mark.parametrize("spans", SPANS)
def test_a_motion_is_a_spline_in_time(spans: int) -> None:
    """Over 4 s, whose powers are exact."""
    coefficients = np.random.default_rng(spans).normal(size=count_coefficients(spans))
    phase = SX.sym("phase")
    motion = ca.Function("motion", [phase], list(spline(SX(ca.DM(coefficients)), SX(4.0), phase)))
    for s in (0.0, 0.2, 0.5, 0.77, 1.0):
        expected = [float(scipy_spline(coefficients)(s, nu=order)) / 4.0**order for order in range(3)]
        assert [float(part) for part in motion(s)] == pytest.approx(
            expected, rel=DERIVATIVE_SHARE, abs=DERIVATIVE_SHARE
        )


def test_no_coefficients_are_no_motion() -> None:
    assert count_coefficients(0) == 0
    assert all(part.shape == (2, 1) and part.is_zero() for part in spline(SX(0, 2), SX(1.0), SX(0.3)))
