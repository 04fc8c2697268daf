"""A local optimum to machine precision, with its active bounds.

IPOPT stops near an optimum, where no multiplier is exactly zero. Here the bounds with a price are equations, and Newton's
method solves the first-order conditions; wrong signs release a bound, violations add one, until nothing changes. Rows are those
of the NLP, then the scaled variables; with multipliers lam (positive at an upper bound, negative at a lower one)

    L(w, p, lam) = f(w, p) + lam' values(w, p) - max(lam, 0)' upper(p) - max(-lam, 0)' (-lower(p)).
"""

from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import casadi as ca
import numpy as np
from casadi import DM, MX

from nlp_gait.backends.nlp import NlpModel, build_nlp
from nlp_gait.backends.solvers.ipopt import IpoptSettings
from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.locking import lock_casadi
from nlp_gait.formulation.solution import Guess, Outcome

# Singular values of the active rows, each of length 1, below this share of the largest are zero.
RANK = 1e-9
# A curvature below this share of the largest, or of 1 in units of cost per squared range, is zero.
FLAT_CURVATURE = 1e-12


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
        outputs = self.gradient(w, p, lam), self.values(w, p)[1]
        return ca.Function("matrices", [w, p, lam], [ca.jacobian(output, w) for output in outputs])

    @cached_property
    def by_parameters(self) -> ca.Function:
        """(w, p, lam) to the Jacobians in p: of cost, rows, lower and upper bounds, and of the gradient of L in w."""
        w, p, lam = self._symbols()
        outputs = [*self.values(w, p), self.gradient(w, p, lam)]
        return ca.Function("by_parameters", [w, p, lam], [ca.jacobian(output, p) for output in outputs])

    def _symbols(self) -> list[MX]:
        return [MX.sym(self.gradient.name_in(i), self.gradient.size1_in(i)) for i in range(3)]


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
        gradient=ca.Function("gradient", [w, p, lam], [ca.gradient(lagrangian, w)], ["w", "p", "lam"], ["gradient"]),
    )


def to_array(value: DM) -> Array:
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
    zero = np.abs(curvature) <= FLAT_CURVATURE * max(steepest, 1.0)
    flat = null @ directions[:, zero]
    curved = null @ directions[:, ~zero]
    reason = None
    if np.abs(flat[:variables]).max(initial=0.0) > np.sqrt(FLAT_CURVATURE):
        reason = "neither bounds nor curvature determine x*: it is not an isolated minimum"
    elif (curvature < -FLAT_CURVATURE * max(steepest, 1.0)).any():
        reason = f"the curvature along the active bounds is negative ({curvature[0]:.1e}): x* is no minimum"
    dw = dw + curved @ ((curved.T @ (r - hessian @ dw)).T / curvature[~zero]).T
    pull = space.T @ (r - hessian @ dw)
    return KktStep(
        w=dw,
        multipliers=((u @ (pull.T / s).T).T / length).T,
        inconsistent=np.abs(scaled - u @ inside).max(axis=0, initial=0.0),
        flat=np.abs(flat).max(axis=1, initial=0.0) > np.sqrt(FLAT_CURVATURE),
        freedom=null.shape[1],
        dependent=len(rows) - rank,
        reason=reason,
    )


# IPOPT then distinguishes bounds with and without a price: at kinks of |power| both multipliers are small.
SHARP = IpoptSettings(tolerance=1e-12)
ROUNDS = 30
# Largest violation of the conditions, in units of cost per range of a variable, and of the rows.
RESIDUAL = 1e-9
# A multiplier or a slack below this is zero: the bound is weakly active, and x* may move differently to either side.
WEAK_MULTIPLIER = 1e-8
# Most unknowns: dense linear algebra takes minutes for more.
LARGEST = 2_500


@dataclass(frozen=True, kw_only=True, eq=False)
class Optimum:
    """Point that satisfies the first-order conditions."""

    problem: GaitProblem
    functions: KktFunctions
    w: Array  #: scaled variables and lifted variables
    width: float  #: of the sigmoid
    multipliers: Array  #: (m,) of all rows and bounds; positive at an upper bound
    side: Array  #: (m,) 1 where a row is at its upper bound, -1 at its lower one, else 0
    weak: tuple[str, ...]  #: names of the bounds that are active without a price, or nearly active
    residual: float  #: largest violation of the conditions
    freedom: int  #: dimension of the space in which x* and the lifted variables could move along the active bounds
    dependent: int  #: number of active rows that follow from the others: their multipliers are not unique
    reason: str | None  #: why there is no derivative, or None

    @property
    def x(self) -> Array:
        """(n,) decision variables."""
        return self.functions.model.point(self.w)

    @property
    @lock_casadi
    def objective(self) -> float:
        """Objective in the problem's sense."""
        return self.problem.objective.sign * float(self.functions.values(self.w, self.parameters)[0])

    @property
    def active(self) -> np.ndarray[Any, np.dtype[np.intp]]:
        """Indices of the active rows."""
        return np.asarray(np.flatnonzero(self.side))

    @cached_property
    def parameters(self) -> Array:
        """Parameters and sigmoid width."""
        return np.append(self.problem.p, self.width)

    @cached_property
    @lock_casadi
    def matrices(self) -> tuple[Array, Array]:
        """Hessian of L and Jacobian of all rows."""
        hessian, jacobian = self.functions.matrices(self.w, self.parameters, self.multipliers)
        return np.array(hessian), np.array(jacobian)

    @cached_property
    @lock_casadi
    def rows(self) -> tuple[Array, Array, Array]:
        """Values of all rows with their lower and upper bounds."""
        _, values, lower, upper = (to_array(output) for output in self.functions.values(self.w, self.parameters))
        return values, lower, upper


@lock_casadi
def find_optimum(problem: GaitProblem, near: Outcome) -> Optimum:
    """Find the optimum near which a solver ended; raises InputError without multipliers, or for too many variables."""
    if near.guess is None:
        raise InputError(
            f"{problem.name}: prices and sensitivities need multipliers, which {near.solver} does not return; solve with ipopt"
        )
    functions, unknowns = build_kkt_functions(problem), len(near.guess.primal)
    if unknowns > LARGEST:
        raise InputError(
            f"{problem.name} has {unknowns} variables; prices and sensitivities support at most {LARGEST}; use fewer intervals"
        )
    sharper = replace(SHARP, widths=(near.guess.width,)).run_from(problem, near)
    guess = near.guess if sharper is None or sharper.guess is None or not sharper.converged else sharper.guess
    return _fix_flat_lifts(_converge(problem, functions, guess))


def _converge(problem: GaitProblem, functions: KktFunctions, guess: Guess) -> Optimum:
    """Apply Newton's method to the active rows, which change until all signs are right."""
    w, p = guess.primal.copy(), np.append(problem.p, guess.width)
    lam = np.concatenate([guess.rows, guess.bounds[: functions.model.variables]])
    _, values, lower, upper = (to_array(output) for output in functions.values(w, p))
    equation = upper - lower <= 0.0
    side = np.where(lam > upper - values, 1, np.where(-lam > values - lower, -1, 0))
    side[equation] = np.where(lam[equation] >= 0.0, 1, -1)
    reason: str | None = "the set of active bounds did not settle"
    residual = np.inf
    for _ in range(ROUNDS):
        active = np.flatnonzero(side)
        lam[side == 0] = 0.0
        gradient = to_array(functions.gradient(w, p, lam))
        hessian, jacobian = (np.array(output) for output in functions.matrices(w, p, lam))
        gap = (np.where(side > 0, upper, lower) - values)[active]
        step = solve_kkt(hessian, jacobian[active], -gradient, gap, functions.model.variables)
        if not np.isfinite(step.w).all():
            reason = "Newton's method diverged"
            break
        w, lam[active] = w + step.w, lam[active] + step.multipliers
        _, values, lower, upper = (to_array(output) for output in functions.values(w, p))
        wrong = (lam * side < -WEAK_MULTIPLIER) & ~equation
        violated = np.where(values > upper + RESIDUAL, 1, np.where(values < lower - RESIDUAL, -1, 0)) * (side == 0)
        if wrong.any() or violated.any():
            side = np.where(wrong, 0, side + violated)
            continue
        gap = (np.where(side > 0, upper, lower) - values)[active]
        slope = to_array(functions.gradient(w, p, lam))
        residual = max(float(np.abs(slope).max()), float(np.abs(gap).max(initial=0.0)))
        if residual <= RESIDUAL:
            reason = step.reason
            break
    slack = np.minimum(upper - values, values - lower)
    weak = np.where(side == 0, np.abs(slack) < WEAK_MULTIPLIER, np.abs(lam) < WEAK_MULTIPLIER) & ~equation
    ties = (f"lifted[{i}]" for i in range(len(functions.model.tie_upper)))
    names = (*functions.model.row_names, *ties, *(f"bounds[{name}]" for name in problem.names))
    return Optimum(
        problem=problem,
        functions=functions,
        w=w,
        width=guess.width,
        multipliers=lam,
        side=side,
        weak=tuple(names[i] for i in np.flatnonzero(weak)),
        residual=residual,
        freedom=step.freedom,
        dependent=step.dependent,
        reason=reason,
    )


def _fix_flat_lifts(optimum: Optimum) -> Optimum:
    """Set lifted variables that nothing determines, because no bound on them has a price, to their exact values.

    The row that ties such a variable to its value then counts as an equation, so that it follows x.
    """
    model, n = optimum.functions.model, optimum.functions.model.variables
    if optimum.reason is not None or model.lifted == 0:
        return optimum
    hessian, jacobian = optimum.matrices
    nothing = np.zeros(len(optimum.active))
    flat = solve_kkt(hessian, jacobian[optimum.active], np.zeros(len(optimum.w)), nothing, n).flat
    loose = np.flatnonzero(flat[n:])
    if not loose.size:
        return optimum
    w, side = optimum.w.copy(), optimum.side.copy()
    w[n + loose] = to_array(model.lift_start(w[:n], *np.split(optimum.parameters, [-1])))[loose]
    moved = replace(optimum, w=w)
    values, lower, _ = moved.rows
    first, last = len(model.row_names), len(model.row_names) + len(model.tie_upper)
    ties = np.arange(first, last)
    for j in loose:
        tie = ties[(jacobian[first:last, n + j] != 0.0) & (side[first:last] == 0)]
        if tie.size:
            side[tie[np.argmin((values - lower)[tie])]] = -1
    return replace(moved, side=side)
