"""Quintic splines that do not change the ends of a curve: what a richer trajectory adds to a cubic.

The spaces are nested: every spline is also a spline with twice as many spans. With one span it is a polynomial of degree five. A
cubic through given end positions and velocities plus such a spline is any spline of degree five with these ends; zero
coefficients leave the cubic.
"""

from __future__ import annotations

from functools import cache
from typing import Any

import casadi as ca
import numpy as np
from casadi import SX

from nlp_gait.symbolic.trajectories import Motion

Array = np.ndarray[Any, np.dtype[np.float64]]

DEGREE = 5  # positions have four continuous derivatives, so torques and their rates are smooth
# The first two and the last two basis functions move an end or its velocity.
FIXED = 2


def count_coefficients(spans: int) -> int:
    """Return the number of coefficients of one curve; 0 spans mean no spline."""
    return spans + DEGREE - 2 * FIXED if spans else 0


def spline(coefficients: SX, duration: SX, phase: SX) -> Motion:
    """Evaluate k splines with zero value and zero velocity at both ends of a phase [0, 1] of a duration [s].

    The coefficients are (m, k), with m = spans + 1, or 0 for zero curves.

    Source:
        Basis functions of Cox and de Boor on uniform knots with clamped ends; derivatives by de Boor's formula.
    """
    m, k = coefficients.shape
    if m == 0:
        return Motion(SX(k, 1), SX(k, 1), SX(k, 1))
    value, slope, bend = (coefficients.T @ basis(m - 1, phase, order) for order in range(3))
    return Motion(value, slope / duration, bend / duration**2)


def basis(spans: int, phase: SX, order: int) -> SX:
    """Return (m,) derivatives of order 0 to 5 of the basis functions with respect to the phase, in [0, 1]."""
    knots = np.concatenate([np.zeros(DEGREE), np.linspace(0.0, 1.0, spans + 1), np.ones(DEGREE)])
    values = _start_basis(spans, phase)
    for degree in range(1, DEGREE + 1):
        step = _raise_degree if degree <= DEGREE - order else _differentiate
        values = step(values, knots, degree, phase)
    return ca.vertcat(*values[FIXED : len(values) - FIXED])


def refine_spline(coefficients: Array, spans: int) -> Array:
    """Return the coefficients (m,) of a curve, or (m, k) of k curves, with more spans, a multiple of theirs."""
    m = coefficients.shape[0]
    if m == 0:
        return np.zeros((count_coefficients(spans), *coefficients.shape[1:]))
    phases = np.linspace(0.0, 1.0, 4 * (spans + DEGREE))
    return fit_spline(tabulate_basis(m - 1, phases).T @ coefficients, spans, phases)


def fit_spline(values: Array, spans: int, phases: Array) -> Array:
    """Return (m, k) coefficients of the least-squares fit to values (n, k) at phases (n,)."""
    return np.asarray(np.linalg.lstsq(tabulate_basis(spans, phases).T, values, rcond=None)[0], dtype=float)


def tabulate_basis(spans: int, phases: Array, order: int = 0) -> Array:
    """Return (m, n) derivatives of the basis functions at phases (n,)."""
    return np.array(_basis_function(spans, order).map(len(phases))(phases[None, :]).full())


@cache
def _basis_function(spans: int, order: int) -> ca.Function:
    phase = SX.sym("phase")
    return ca.Function("basis", [phase], [basis(spans, phase, order)])


def _start_basis(spans: int, phase: SX) -> list[SX]:
    """Return the basis functions of degree 0: 1 on one span, 0 at multiple end knots. The outer spans include the outside."""
    after = [SX(1), *(phase >= k / spans for k in range(1, spans)), SX(0)]
    inner = [after[k] - after[k + 1] for k in range(spans)]
    return [SX(0)] * DEGREE + inner + [SX(0)] * DEGREE


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


def _divide(part: SX, width: float) -> SX:
    return part / float(width) if width > 0.0 else SX(0)  # 0 on a span without width
