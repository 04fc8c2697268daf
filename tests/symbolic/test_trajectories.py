"""Trajectories and their derivatives, by hand; splines against SciPy, and what they leave alone."""

import casadi as ca
import numpy as np
import pytest
from casadi import SX
from scipy.interpolate import BSpline

from nlp_gait.symbolic.trajectories import (
    DEGREE,
    Motion,
    basis,
    constant_motion,
    count_coefficients,
    cubic,
    cubic_of_sums,
    map_motion,
    parabola_lift,
    spline,
    stack,
)

# Positions, velocities and times of order one in double precision.
TOLERANCE = 1e-10


def test_what_stands_still_has_no_derivatives_and_costs_nothing() -> None:
    motion = stack(constant_motion(1.5), constant_motion(-2.0))
    assert [float(v) for v in ca.vertsplit(motion.position)] == [1.5, -2.0]
    assert motion.velocity.is_zero()
    assert motion.acceleration.is_zero()


def test_a_function_of_a_motion_by_the_chain_rule() -> None:
    """F = (a^2 b, sin b) at a = 2 + 3 t + 5 t^2 and b = 1 - t + t^2 / 2, at t = 0."""
    motion = Motion(SX([2.0, 1.0]), SX([3.0, -1.0]), SX([10.0, 1.0]))
    position, velocity, acceleration = (
        [float(v) for v in ca.vertsplit(part)]
        for part in map_motion(lambda q: ca.vertcat(q[0] ** 2 * q[1], ca.sin(q[1])), motion)
    )
    sin, cos = np.sin(1.0), np.cos(1.0)
    assert position == pytest.approx([4.0, sin])
    assert velocity == pytest.approx([2 * 2 * 3 * 1 + 4 * -1, -cos])
    # a^2 b: 2 (a'^2 + a a'') b + 4 a a' b' + a^2 b''
    assert acceleration == pytest.approx([2 * (9 + 20) * 1 + 4 * 2 * 3 * -1 + 4 * 1, cos - sin])


def test_a_cubic_of_sums_of_velocities_is_the_cubic_over_unit_time() -> None:
    expected = cubic(SX(1.0), SX(3.0), SX(0.7), SX(-0.4), SX(1.0), SX(0.3))
    found = cubic_of_sums(1.0, 3.0, SX(0.15), SX(0.55), SX(0.3))
    assert [float(part) for part in found] == pytest.approx([float(part) for part in expected])


def test_a_path_off_the_origin_is_lifted_between_its_own_ends() -> None:
    """From 1 to 3, at 1.5 with rate 2 and bend 4: offset -1/2, rate 2, bend 4 in halves of the path."""
    lift = parabola_lift(Motion(SX(1.5), SX(2.0), SX(4.0)), 1.0, 3.0, SX(0.1))
    assert [float(part) for part in lift] == pytest.approx([0.1 * 0.75, 0.1 * 2.0, -0.2 * (4.0 - 2.0)], abs=TOLERANCE)


# The third derivative of 16 spans reaches 1e5; double precision leaves 1e-11 of it.
DERIVATIVE_SHARE = 1e-11
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
