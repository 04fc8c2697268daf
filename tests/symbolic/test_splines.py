"""Splines against SciPy, and what they leave alone."""

import casadi as ca
import numpy as np
import pytest
from casadi import SX
from hypothesis import given
from hypothesis import strategies as st
from scipy.interpolate import BSpline

from nlp_gait.symbolic.trajectories import DEGREE, basis, count_coefficients, spline

# The third derivative of 16 spans reaches 1e5; double precision leaves 1e-11 of it.
TOLERANCE, DERIVATIVE_SHARE = 1e-12, 1e-11
SPANS = (1, 2, 4, 8, 16)
PHASES = np.linspace(0.0, 1.0, 53)

seeds = st.integers(0, 2**32 - 1)


def tabulate_basis(spans: int, phases: np.ndarray, order: int = 0) -> np.ndarray:
    phase = SX.sym("phase")
    return ca.Function("basis", [phase], [basis(spans, phase, order)]).map(len(phases))(phases[None, :]).full()


def fit_spline(values: np.ndarray, spans: int) -> np.ndarray:
    """Least-squares fit to values (n, k) at ``PHASES``."""
    return np.linalg.lstsq(tabulate_basis(spans, PHASES).T, values, rcond=None)[0]


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


@pytest.mark.parametrize("spans", SPANS)
def test_ends_and_their_velocities_stay(spans: int) -> None:
    ends = np.array([0.0, 1.0])
    for order in (0, 1):
        assert np.abs(tabulate_basis(spans, ends, order)).max() == 0.0
    assert np.abs(tabulate_basis(spans, ends, 2)).max() > 1.0


def test_no_coefficients_are_no_motion() -> None:
    assert count_coefficients(0) == 0
    assert all(part.shape == (2, 1) and part.is_zero() for part in spline(SX(0, 2), SX(1.0), SX(0.3)))


@given(seed=seeds, spans=st.sampled_from(SPANS[:-1]), times=st.sampled_from([1, 2, 4]))
def test_every_spline_is_one_with_more_spans_whose_coefficients_are_averages(seed: int, spans: int, times: int) -> None:
    coefficients = np.random.default_rng(seed).normal(size=(count_coefficients(spans), 2))
    more = fit_spline(tabulate_basis(spans, PHASES).T @ coefficients, times * spans)
    assert more.shape == (count_coefficients(times * spans), 2)
    np.testing.assert_allclose(
        tabulate_basis(times * spans, PHASES).T @ more,
        tabulate_basis(spans, PHASES).T @ coefficients,
        rtol=0,
        atol=TOLERANCE,
    )
    assert np.abs(more).max() <= np.abs(coefficients).max() + TOLERANCE


def test_a_quintic_with_still_ends_is_found_by_fitting() -> None:
    """By hand: s^2 (1 - s)^2 (2 - 3 s)."""
    values = PHASES**2 * (1 - PHASES) ** 2 * (2 - 3 * PHASES)
    found = fit_spline(values[:, None], 1)
    # Bernstein polynomials of degree 5 with still ends: 10 s^2 (1 - s)^3 and 10 s^3 (1 - s)^2.
    assert found[:, 0] == pytest.approx([0.2, -0.1], abs=TOLERANCE)
