"""First-order conditions of a problem's NLP as functions: values and derivatives of cost, rows and bounds.

Rows are those of the NLP, then the scaled variables; with multipliers lam (positive at an upper bound, negative at a lower one)

    L(w, p, lam) = f(w, p) + lam' values(w, p) - max(lam, 0)' upper(p) - max(-lam, 0)' (-lower(p)).
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from casadi import DM, MX

from nlp_gait.backends.nlp import NlpModel, build_nlp
from nlp_gait.formulation import Array, GaitProblem

# Singular values of the active rows, each of length 1, below this share of the largest are zero.
RANK = 1e-9
# A curvature below this share of the largest, or of 1 in units of cost per squared range, is zero.
FLAT = 1e-12


@dataclass(frozen=True, kw_only=True, eq=False)
class KktFunctions:
    """Functions of w = (z, lifted variables), p = (parameters, sigmoid width) and multipliers lam of all rows."""

    model: NlpModel
    values: ca.Function  #: (w, p) to cost, row values (m,), lower (m,), upper (m,)
    gradient: ca.Function  #: (w, p, lam) to the gradient of L in w

    @cached_property
    def matrices(self) -> ca.Function:
        """(w, p, lam) to the Hessian of L in w, and the Jacobian of the rows in w."""
        w, p, lam = self._symbols()
        return ca.Function(
            "matrices",
            [w, p, lam],
            [ca.jacobian(self.gradient(w, p, lam), w), ca.jacobian(self.values(w, p)[1], w)],
        )

    @cached_property
    def by_parameters(self) -> ca.Function:
        """(w, p, lam) to the Jacobians in p: of cost, rows, lower and upper bounds, and of the gradient of L in w."""
        w, p, lam = self._symbols()
        outputs = [*self.values(w, p), self.gradient(w, p, lam)]
        return ca.Function("by_parameters", [w, p, lam], [ca.jacobian(output, p) for output in outputs])

    def _symbols(self) -> tuple[MX, MX, MX]:
        return (
            MX.sym("w", self.values.size1_in(0)),
            MX.sym("p", self.values.size1_in(1)),
            MX.sym("lam", self.values.size1_out(1)),
        )


def build_kkt_functions(problem: GaitProblem) -> KktFunctions:
    """Return the first-order conditions of a problem, built once for all copies that differ in parameter values only."""
    return problem.build_once(_build)


def _build(problem: GaitProblem) -> KktFunctions:
    model = build_nlp(problem)
    w, p = model.nlp["x"], model.nlp["p"]
    n, ties = model.variables, len(model.tie_upper)
    row_lower, row_upper = model.row_bounds(p[:-1])
    bounds = (p[-1 - 2 * n : -1 - n], p[-1 - n : -1])
    low, high = ((bound - DM(model.offset)) / DM(model.scale) for bound in bounds)
    values = ca.vertcat(model.nlp["g"], w[:n])
    lower = ca.vertcat(row_lower, DM.zeros(ties), low)
    upper = ca.vertcat(row_upper, DM(model.tie_upper), high)
    lam = MX.sym("lam", values.shape[0])
    lagrangian = model.nlp["f"] + ca.dot(lam, values)
    return KktFunctions(
        model=model,
        values=ca.Function("values", [w, p], [model.nlp["f"], values, lower, upper]),
        gradient=ca.Function("gradient", [w, p, lam], [ca.gradient(lagrangian, w)]),
    )


def column(value: DM) -> Array:
    """Return a dense vector."""
    return np.array(value).ravel()


@dataclass(frozen=True, kw_only=True, eq=False)
class KktStep:
    """Solution of H dw + A' dlam = r, A dw = c for one or several right-hand sides."""

    w: Array  #: dw
    multipliers: Array  #: dlam, of least norm where they are not unique
    inconsistent: Array  #: largest part of c that dependent rows contradict, for each right-hand side
    flat: Array  #: (n,) True for the unknowns that neither rows nor curvature determine; they do not move
    freedom: int  #: dimension of the null space of A
    dependent: int  #: rows of A that follow from the others
    reason: str | None  #: why the decision variables' part of dw is not determined, or None


def solve_kkt(hessian: Array, rows: Array, r: Array, c: Array, variables: int) -> KktStep:
    """Solve the linearised first-order conditions in the row space and the null space of the active rows.

    Takes the Hessian (n, n), the Jacobian (m, n) of the active rows, r (n,) or (n, k) and c (m,) or (m, k); the first unknowns
    are the decision variables, the others are lifted.
    """
    length = np.linalg.norm(rows, axis=1)
    length[length == 0.0] = 1.0
    u, s, vt = np.linalg.svd(rows / length[:, None], full_matrices=True)
    rank = int(np.sum(s > RANK * s.max(initial=0.0)))
    u, s, space, null = u[:, :rank], s[:rank], vt[:rank].T, vt[rank:].T
    scaled = (c.T / length).T
    inside = u.T @ scaled
    dw = space @ (inside.T / s).T
    reduced = null.T @ hessian @ null
    curvature, directions = np.linalg.eigh((reduced + reduced.T) / 2)
    steepest = np.abs(curvature).max(initial=0.0)
    zero = np.abs(curvature) <= FLAT * max(steepest, 1.0)
    flat = null @ directions[:, zero]
    curved = null @ directions[:, ~zero]
    reason = None
    if np.abs(flat[:variables]).max(initial=0.0) > np.sqrt(FLAT):
        reason = "neither bounds nor curvature determine x*: it is not an isolated minimum"
    elif (curvature < -FLAT * max(steepest, 1.0)).any():
        reason = f"the curvature along the active bounds is negative ({curvature[0]:.1e}): x* is no minimum"
    dw = dw + curved @ ((curved.T @ (r - hessian @ dw)).T / curvature[~zero]).T
    pull = space.T @ (r - hessian @ dw)
    return KktStep(
        w=dw,
        multipliers=((u @ (pull.T / s).T).T / length).T,
        inconsistent=np.abs(scaled - u @ inside).max(axis=0, initial=0.0),
        flat=np.abs(flat).max(axis=1, initial=0.0) > np.sqrt(FLAT),
        freedom=null.shape[1],
        dependent=len(rows) - rank,
        reason=reason,
    )
