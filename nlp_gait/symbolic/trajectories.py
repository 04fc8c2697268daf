"""Trajectories with analytic first and second time derivatives."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import casadi as ca
from casadi import DM, SX


class Motion(NamedTuple):
    """A quantity with its first and second time derivative (scalars or vectors of one unit: u, u/s, u/s^2)."""

    position: SX
    velocity: SX
    acceleration: SX


def cubic(start: SX, end: SX, start_velocity: SX, end_velocity: SX, duration: SX, phase: SX) -> Motion:
    """Return the cubic polynomial in time with given end positions [u] and end velocities [u/s].

    ``phase`` is time / duration; the duration [s] must not be zero.

    Source:
        Gupta, Pratihar, Deb (2023), Tables 3 and 5 (four boundary conditions each), in Hermite form.
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

    In unit time velocities are multiplied by the duration; the sum and the difference are those of the velocities at phase 0 and
    at phase 1.
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
        with Z'(x_m) = 0 the cubic has no third-order term.
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


def constant_motion(value: float) -> Motion:
    """Return a motion at rest."""
    return Motion(SX(value), SX(0), SX(0))


def resting_point(place: Sequence[float]) -> Motion:
    """Return the motion of a point (n,) at rest."""
    return Motion(SX(DM(list(place))), SX(len(place), 1), SX(len(place), 1))


def stack(*motions: Motion) -> Motion:
    """Stack motions to one vector motion."""
    return Motion(*(ca.vertcat(*parts) for parts in zip(*motions, strict=True)))
