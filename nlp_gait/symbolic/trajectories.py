"""Trajectories with analytic first and second time derivatives, and quintic splines that a richer one adds to a cubic.

Splines do not change the ends of a curve, and their spaces are nested: every spline is also one with twice as many spans. With
one span it is a polynomial of degree five. A cubic through given end positions and velocities plus such a spline is any spline of
degree five with these ends; zero coefficients leave the cubic.
"""

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from casadi import DM, SX

Array = np.ndarray[Any, np.dtype[np.float64]]

DEGREE = 5  # positions have four continuous derivatives, so torques and their rates are smooth
# The first two and the last two basis functions move an end or its velocity.
FIXED = 2


class Motion(NamedTuple):
    """A quantity with its first and second time derivative (scalars or vectors of one unit: u, u/s, u/s^2)."""

    position: SX
    velocity: SX
    acceleration: SX


def count_coefficients(spans: int) -> int:
    """Return the number of coefficients of one curve; 0 spans mean no spline."""
    return spans + DEGREE - 2 * FIXED if spans else 0


def spline(coefficients: SX, duration: SX, phase: SX) -> Motion:
    """Evaluate k splines with zero value and zero velocity at both ends of a phase [0, 1] of a duration [s].

    The coefficients are (m, k), with m = spans + 1, or 0 for zero curves.

    Source:
        Cox and de Boor's basis functions and derivatives on uniform knots, clamped ends: (C.10) to (C.13) in docs/model.
    """
    m, k = coefficients.shape
    if m == 0:
        return Motion(SX(k, 1), SX(k, 1), SX(k, 1))
    value, slope, bend = (coefficients.T @ basis(m - 1, phase, order) for order in range(3))
    return Motion(value, slope / duration, bend / duration**2)


def basis(spans: int, phase: SX, order: int) -> SX:
    """Return (m,) derivatives of order 0 to 5 of the basis functions with respect to the phase, in [0, 1]."""
    knots = np.concatenate([np.zeros(DEGREE), np.linspace(0.0, 1.0, spans + 1), np.ones(DEGREE)])
    # Of degree 0: 1 on one span, 0 at multiple end knots. The outer spans include the outside.
    after = [SX(1), *(phase >= k / spans for k in range(1, spans)), SX(0)]
    values = [SX(0)] * DEGREE + [after[k] - after[k + 1] for k in range(spans)] + [SX(0)] * DEGREE
    for degree in range(1, DEGREE + 1):
        step = _raise_degree if degree <= DEGREE - order else _differentiate
        values = step(values, knots, degree, phase)
    return ca.vertcat(*values[FIXED : len(values) - FIXED])


def _raise_degree(values: list[SX], knots: Array, degree: int, phase: SX) -> list[SX]:
    return [
        _divide(phase - knots[i], knots[i + degree] - knots[i]) * values[i]
        + _divide(knots[i + degree + 1] - phase, knots[i + degree + 1] - knots[i + 1]) * values[i + 1]
        for i in range(len(values) - 1)
    ]


def _differentiate(values: list[SX], knots: Array, degree: int, _: SX) -> list[SX]:
    one = SX(degree)
    return [
        _divide(one, knots[i + degree] - knots[i]) * values[i]
        - _divide(one, knots[i + degree + 1] - knots[i + 1]) * values[i + 1]
        for i in range(len(values) - 1)
    ]


def _divide(dividend: SX, width: float) -> SX:
    return dividend / float(width) if width > 0.0 else SX(0)  # 0 on a span without width


def cubic(start: SX, end: SX, start_velocity: SX, end_velocity: SX, duration: SX, phase: SX) -> Motion:
    """Return the cubic polynomial in time with given end positions [u] and end velocities [u/s].

    ``phase`` is time / duration; the duration [s] must not be zero.

    Source:
        Gupta, Pratihar, Deb (2023), Tables 3 and 5 (four conditions each), in Hermite form: (C.2) to (C.6) in docs/model.
    """
    rise, v0, v1 = end - start, start_velocity * duration, end_velocity * duration
    c2 = 3 * rise - 2 * v0 - v1
    c3 = v0 + v1 - 2 * rise
    return Motion(
        start + phase * (v0 + phase * (c2 + phase * c3)),
        (v0 + phase * (2 * c2 + 3 * phase * c3)) / duration,
        (2 * c2 + 6 * phase * c3) / duration**2,
    )


def cubic_of_sums(start: SX | float, end: SX | float, half_sum: SX, half_difference: SX, phase: SX) -> Motion:
    """Return the cubic polynomial over unit time with given ends [u]: ``cubic`` with other coefficients [u].

    In unit time velocities are multiplied by the duration; the sum and the difference are those of both ends' velocities.
    """
    rise, bow = end - start, phase * (1 - phase)
    return Motion(
        start + phase**2 * (3 - 2 * phase) * rise + bow * ((1 - 2 * phase) * half_sum + half_difference),
        6 * bow * rise + (1 - 6 * bow) * half_sum + (1 - 2 * phase) * half_difference,
        (6 - 12 * phase) * rise + (12 * phase - 6) * half_sum - 2 * half_difference,
    )


def parabola_lift(along: Motion, start: float | SX, end: float | SX, height: SX) -> Motion:
    """Return the height of a swing foot [m] as a parabola over its path: zero at start and end, ``height`` in the middle.

    Source:
        Gupta, Pratihar, Deb (2023), Table 3, row 2, with Z_A(x_f) = 0 in place of the misprinted Z_A(x_i + S_L) = 0:
        with Z'(x_m) = 0 the cubic has no third-order term; (C.7) to (C.9) in docs/model.
    """
    half = (end - start) / 2
    offset = (along.position - (start + end) / 2) / half
    rate, bend = along.velocity / half, along.acceleration / half
    return Motion(height * (1 - offset**2), -2 * height * offset * rate, -2 * height * (rate**2 + offset * bend))


def map_motion(function: Callable[[SX], SX], argument: Motion) -> Motion:
    """Return the motion of a smooth function of a moving quantity (n,), by the chain rule with automatic differentiation."""
    q = SX.sym("q", argument.position.shape[0])
    value = function(q)
    slope = ca.jtimes(value, q, argument.velocity)
    bend = ca.jtimes(slope, q, argument.velocity) + ca.jtimes(value, q, argument.acceleration)
    return Motion(*ca.substitute([value, slope, bend], [q], [argument.position]))


def add_motions(first: Motion, second: Motion) -> Motion:
    """Add two motions of the same shape and unit."""
    return Motion(*(a + b for a, b in zip(first, second, strict=True)))


def constant_motion(value: SX | float) -> Motion:
    """Return a motion at rest."""
    return Motion(SX(value), SX(0), SX(0))


def resting_point(place: Sequence[float]) -> Motion:
    """Return the motion of a point (n,) at rest."""
    return Motion(SX(DM(list(place))), SX(len(place), 1), SX(len(place), 1))


def stack(*motions: Motion) -> Motion:
    """Stack motions to one vector motion."""
    return Motion(*(ca.vertcat(*values) for values in zip(*motions, strict=True)))
