"""Equations of motion of a mechanism from its kinetic and potential energy."""

from __future__ import annotations

from typing import NamedTuple

import casadi as ca
from casadi import SX


class EquationsOfMotion(NamedTuple):
    """M(q) qdd + C(q, qd) qd + G(q) = generalised forces."""

    M: SX  #: (n, n) inertia matrix, symmetric and positive definite
    C: SX  #: (n, n) Coriolis matrix of Christoffel symbols, so that dM/dt - 2 C is skew-symmetric
    G: SX  #: (n,) gravity


def equations_of_motion(kinetic: SX, potential: SX, q: SX, qd: SX) -> EquationsOfMotion:
    """Derive Lagrange's equations of L = K(q, qd) - P(q) [J] in coordinates q (n,), with K quadratic in the rates.

    Source:
        Bhardwaj et al., eqs. (40)-(42); with C as a matrix, so that the product C qd is the vector of eq. (42).
    """
    # Equal entries of M are one expression, so that terms of C cancel symbolically.
    M = ca.triu2symm(ca.cse(ca.triu(ca.hessian(kinetic, qd)[0])))
    n = range(q.shape[0])
    slopes = {(i, j): ca.jacobian(M[i, j], q) for i in n for j in n if i <= j}

    def slope(i: int, j: int, k: int) -> SX:  # derivative of M_ij by q_k
        return slopes[min(i, j), max(i, j)][k]

    C = SX(q.shape[0], q.shape[0])
    for i in n:
        for j in n:
            C[i, j] = sum(0.5 * (slope(i, k, j) + slope(i, j, k) - slope(j, k, i)) * qd[k] for k in n)
    return EquationsOfMotion(M, ca.sparsify(C), ca.gradient(potential, q))
