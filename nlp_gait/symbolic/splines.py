"""Quintic splines that leave both ends of a curve alone: what a richer trajectory adds to a cubic.

The spaces are nested: knots come by bisection, so every spline is one with twice as many spans, too. With one span it is a
polynomial of degree five. A cubic through given end positions and velocities plus such a spline is any spline of degree five
with these ends, and zero coefficients leave the cubic.
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
# The first and the last two of the basis functions are those that move an end or its velocity.
FIXED = 2


def count_coefficients(spans: int) -> int:
    """Number of coefficients of one curve; 0 spans stand for no spline at all."""
    return spans + DEGREE - 2 * FIXED if spans else 0


def spline(coefficients: SX, duration: SX, phase: SX) -> Motion:
    """Splines (k,) with zero value and zero velocity at both ends of a phase.

    Args:
        coefficients: (m, k) of k curves [u]; m = spans + 1, or 0 for curves that do not move.
        duration: of the phase [s].
        phase: time / duration, in [0, 1].

    Source:
        Basis functions of Cox and de Boor on uniform knots with clamped ends; derivatives by de Boor's formula.
    """
    m, k = coefficients.shape
    if m == 0:
        return Motion(SX(k, 1), SX(k, 1), SX(k, 1))
    value, slope, bend = (coefficients.T @ basis(m - 1, phase, order) for order in range(3))
    return Motion(value, slope / duration, bend / duration**2)


def basis(spans: int, phase: SX, order: int) -> SX:
    """(m,) derivatives of the basis functions with respect to the phase.

    Args:
        spans: equal parts of the phase, at least 1.
        phase: in [0, 1].
        order: of the derivative, 0 to 5.
    """
    knots = np.concatenate([np.zeros(DEGREE), np.linspace(0.0, 1.0, spans + 1), np.ones(DEGREE)])
    values = _pieces(spans, phase)
    for degree in range(1, DEGREE + 1):
        raised = _raised if degree <= DEGREE - order else _differentiated
        values = raised(values, knots, degree, phase)
    return ca.vertcat(*values[FIXED : len(values) - FIXED])


def refine_spline(coefficients: Array, spans: int) -> Array:
    """Coefficients of the same curve with more spans, which are averages of the given ones.

    Args:
        coefficients: (m,) of a curve, or (m, k) of k curves.
        spans: a multiple of the curve's own.
    """
    m = coefficients.shape[0]
    if m == 0:
        return np.zeros((count_coefficients(spans), *coefficients.shape[1:]))
    phases = np.linspace(0.0, 1.0, 4 * (spans + DEGREE))
    return fit_spline(tabulate_basis(m - 1, phases).T @ coefficients, spans, phases)


def fit_spline(values: Array, spans: int, phases: Array) -> Array:
    """(m, k) coefficients of the splines that are nearest to values (n, k) at phases (n,), in the sense of least squares."""
    return np.asarray(np.linalg.lstsq(tabulate_basis(spans, phases).T, values, rcond=None)[0], dtype=float)


def tabulate_basis(spans: int, phases: Array, order: int = 0) -> Array:
    """(m, n) derivatives of the basis functions at phases (n,)."""
    return np.array(_basis_function(spans, order).map(len(phases))(phases[None, :]).full())


@cache
def _basis_function(spans: int, order: int) -> ca.Function:
    phase = SX.sym("phase")
    return ca.Function("basis", [phase], [basis(spans, phase, order)])


def _pieces(spans: int, phase: SX) -> list[SX]:
    """Basis functions of degree 0: 1 on one span, those of the multiple end knots 0. The outer spans reach beyond the ends."""
    after = [SX(1), *(phase >= k / spans for k in range(1, spans)), SX(0)]
    inner = [after[k] - after[k + 1] for k in range(spans)]
    return [SX(0)] * DEGREE + inner + [SX(0)] * DEGREE


def _raised(values: list[SX], knots: Array, degree: int, phase: SX) -> list[SX]:
    """Basis functions of the next degree."""
    return [
        _share(phase - knots[i], knots[i + degree] - knots[i]) * values[i]
        + _share(knots[i + degree + 1] - phase, knots[i + degree + 1] - knots[i + 1]) * values[i + 1]
        for i in range(len(values) - 1)
    ]


def _differentiated(values: list[SX], knots: Array, degree: int, _: SX) -> list[SX]:
    """Derivatives of the basis functions of the next degree."""
    one = SX(degree)
    return [
        _share(one, knots[i + degree] - knots[i]) * values[i]
        - _share(one, knots[i + degree + 1] - knots[i + 1]) * values[i + 1]
        for i in range(len(values) - 1)
    ]


def _share(part: SX, width: float) -> SX:
    """Quotient, or 0 on a span without width."""
    return part / float(width) if width > 0.0 else SX(0)
