"""One step of sequential quadratic programming, as a dense quadratic program in the problem's variables.

Each lifted variable lies on one of the rows that tie it, at |v| for example on s - v >= 0 if v > 0. To first order that row, as
an equation, gives s in terms of the variables, and both disappear from the program. Where the program's solution then violates
another row of s, v changes its sign: the program gets a variable r >= 0, by which s is away from the first row, and the other
rows of s. Rows that are satisfied far from their bounds enter when a solution violates them. So the solution is that of the
whole program, but for the curvature by r, which is 0 in the end.
"""

from __future__ import annotations

import importlib
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from nlp_gait.backends.nlp import IntArray
from nlp_gait.backends.onboard.nlp_functions import NlpFunctions
from nlp_gait.errors import InputError
from nlp_gait.formulation import Array

ROUNDS = 15  # in which rows and lifted variables are added
VIOLATED = 1e-9  # by a solution of the program, in units of the row
PRICED = 1e-6  # multiplier of a row that is active
KINK = 1e-3  # least share of the price of |v|'s other row where v is zero
RANK = 1e-9  # singular values of active rows below this share of the largest are zero
# Smallest curvature of the program, relative to the largest.
LEAST_CURVATURE = 1e-6
MARGIN = 1e-2  # of the curvature across active rows, relative to the largest
NO_BOUND = 1e30  # DAQP's infinity
EQUATION, SOFT = 5, 8  # DAQP's marks of rows; a soft one may be violated
INFEASIBLE = -1  # DAQP's exit flag
SETTINGS = {"primal_tol": 1e-10, "dual_tol": 1e-10, "iter_limit": 200}


@dataclass(frozen=True, eq=False)
class Step:
    """Solution of the program."""

    w: Array  #: (N,) step of the scaled variables and the lifted ones
    multipliers: Array  #: (m,) of all rows, positive at an upper bound
    decrease: float  #: predicted decrease of the cost
    relaxed: bool  #: whether rows had to be violated
    normals: Array  #: (a, n) derivatives of the active rows and bounds by the problem's variables
    bend: Array  #: (n, n) curvature that was added to make the program convex
    hessian: Array  #: (n, n) without it

    def estimate_rest(self) -> float:
        """Return how much less the cost would be without the added curvature, with the same active rows."""
        along = _split(self.normals)[1]
        gradient = along.T @ (self.bend @ self.w[: len(self.hessian)])
        values, directions = np.linalg.eigh(along.T @ self.hessian @ along)
        least = LEAST_CURVATURE * max(float(np.abs(self.hessian).max()), 1e-3)
        return 0.5 * float(np.sum((directions.T @ gradient) ** 2 / np.maximum(values, least)))


@dataclass(frozen=True, eq=False)
class _Program:
    """The program in y = (z, r)."""

    chosen: IntArray  #: (lifted,) row that gives each lifted variable
    own: Any  #: derivative of these rows by the lifted variables: its diagonal or its factors
    lifts: Array  #: (lifted, q + 1) lifted variables from (y, 1)
    rows: Array  #: (m, q + 1) change of the rows from (y, 1)
    hessian: Array  #: (n, n), by z
    linear: Array  #: (q,)


class StepSolver:
    """Programs of one NLP; each begins with the rows and lifted variables that mattered in the last one."""

    def __init__(self, functions: NlpFunctions) -> None:
        """Raise InputError if DAQP is not installed."""
        self._daqp = _load_daqp()
        self._functions = functions
        model = functions.model
        self.n, self.lifted = model.variables, model.lifted
        self._first, self._owner, self._sense = len(model.row_names), model.tie_owner, model.lift_sense
        self._order = self._first + np.argsort(self._owner, kind="stable")
        self._groups = np.searchsorted(np.sort(self._owner), np.arange(self.lifted))
        self._sizes = np.diff(np.append(self._groups, len(self._order)))
        self._places = np.arange(len(self._order))
        #: whether rows that tie lifted variables depend on no other lifted variable
        self._alone = bool((np.diff(functions.rows_by_s.indptr)[self._first :] == 1).all())
        self._unit = np.eye(self.n)
        self._rows = self._kept = np.zeros(0, np.intp)  # rows that begin in the program, and lifted variables with an r
        self._active = (self._rows, self._rows)  # rows, and variables at a bound

    def begin(self, multipliers: Array) -> None:
        """Begin the next program with the rows that have a price in multipliers (m,), and with |v| at zero."""
        price = np.abs(multipliers)
        active = price > PRICED
        self._rows = np.flatnonzero(active[: self._first])
        if self.lifted:
            prices = price[self._order]
            highest = np.maximum.reduceat(prices, self._groups)
            others = np.add.reduceat(prices, self._groups) - highest
            is_kept = others > KINK * np.maximum(highest, KINK * price.max()) + PRICED
            is_kept &= self._sense != 0.0
            self._kept = np.flatnonzero(is_kept)
            active[self._first :] &= is_kept[self._owner]
        self._active = np.flatnonzero(active), self._active[1]

    def choose_ties(self, g: Array) -> IntArray:
        """Return the row of each lifted variable that its value comes from: the least one."""
        if not self.lifted:
            return np.zeros(0, np.intp)
        values = g[self._order]
        least = np.minimum.reduceat(values, self._groups)
        place = np.where(values == least.repeat(self._sizes), self._places, -1)
        return np.asarray(self._order[np.maximum.reduceat(place, self._groups)])

    def solve(self, ties: IntArray, lower: Array, upper: Array, z_lower: Array, z_upper: Array) -> Step | None:
        """Solve the program at the functions' point, where ``ties`` are chosen; None if that fails.

        Takes what is left to the bounds of the rows (m,) and of z (n,), negative and positive.
        """
        kept, first = self._kept, self._first
        is_inside = lower == upper
        is_inside[first:] = False
        is_inside[self._rows] = True
        program = self._reduce(ties, kept, lower)
        bend = _make_bend(program.hessian, self._list_normals(program, *self._active))
        bent = program.hessian + bend
        for _ in range(ROUNDS):
            is_kept = np.zeros(self.lifted, dtype=bool)
            is_kept[kept] = True
            is_inside[first:] = is_kept[self._owner]
            is_inside[ties] = False
            inside = np.flatnonzero(is_inside)
            found = self._solve_dense(program, bent, inside, lower, upper, z_lower, z_upper)
            if found is None:
                return None
            y, prices, relaxed = found
            change = program.rows @ np.append(y, 1.0)
            wrong = np.maximum(lower - change, change - upper) > VIOLATED
            wrong[ties] = wrong[inside] = False
            if not wrong.any():
                break
            is_inside |= wrong
            if wrong[first:].any():
                kept = np.concatenate([kept, np.unique(self._owner[wrong[first:]])])
                program = self._reduce(ties, kept, lower)
        return self._finish(program, bend, kept, inside, y, prices, relaxed)

    def _list_normals(self, program: _Program, rows: IntArray, at_bound: IntArray) -> Array:
        return np.concatenate([program.rows[rows, : self.n], self._unit[at_bound]])

    def _reduce(self, ties: IntArray, kept: IntArray, lower: Array) -> _Program:
        """Eliminate all lifted variables; those that are kept are away from their rows by r."""
        at, n, q, by_s = self._functions, self.n, self.n + len(kept), self._functions.rows_by_s
        right = np.zeros((self.lifted, q + 1))
        right[:, :n], right[:, q] = -at.rows_by_z[ties], lower[ties]
        diagonal = by_s.data[by_s.indptr[ties]] if self._alone else by_s[ties].diagonal()
        right[kept, range(n, q)] = (diagonal * self._sense)[kept]
        own = diagonal if self._alone else splu(sparse.csc_matrix(by_s[ties]))
        lifts = right / diagonal[:, None] if self._alone else own.solve(right)
        rows = by_s @ lifts
        rows[:, :n] += at.rows_by_z
        full = np.concatenate([self._unit, lifts[:, :n]])
        bent = at.hessian @ full
        hessian = full.T @ bent
        linear = at.gradient[n:] @ lifts[:, :q]
        linear[:n] += at.gradient[:n] + lifts[:, q] @ bent[n:]
        return _Program(ties, own, lifts, rows, (hessian + hessian.T) / 2, linear)

    def _solve_dense(
        self,
        program: _Program,
        bent: Array,
        inside: IntArray,
        lower: Array,
        upper: Array,
        z_lower: Array,
        z_upper: Array,
    ) -> tuple[Array, Array, bool] | None:
        """Return y, the multipliers of its bounds and of the rows inside, and whether rows are violated."""
        n, q = self.n, len(program.linear)
        rows = program.rows[inside]
        constant = rows[:, q]
        high = np.concatenate([z_upper, np.full(q - n, NO_BOUND), np.minimum(upper[inside] - constant, NO_BOUND)])
        low = np.concatenate([z_lower, np.zeros(q - n), np.maximum(lower[inside] - constant, -NO_BOUND)])
        hessian = np.zeros((q, q))
        hessian[:n, :n] = bent
        hessian[range(n, q), range(n, q)] = LEAST_CURVATURE * bent.diagonal().max()
        sense = np.where(high <= low, EQUATION, 0).astype(np.int32)
        rows = np.ascontiguousarray(rows[:, :q])
        for relaxed in (False, True):
            y, _, flag, info = self._daqp.solve(hessian, program.linear, rows, high, low, sense, **SETTINGS)
            if flag > 0:
                return y, np.asarray(info["lam"]), relaxed
            if flag != INFEASIBLE:
                return None
            sense[q:] = SOFT
        return None

    def _finish(
        self, program: _Program, bend: Array, kept: IntArray, inside: IntArray, y: Array, prices: Array, relaxed: bool
    ) -> Step:
        """Return the whole step, with the multipliers of the eliminated rows, and keep what the next program begins with."""
        at, n, q = self._functions, self.n, len(program.linear)
        w = np.concatenate([y[:n], program.lifts @ np.append(y, 1.0)])
        bent = at.hessian @ w
        multipliers = np.zeros(len(at.g))
        multipliers[inside] = prices[q:]
        if self.lifted:
            rest = -(at.gradient + bent)[n:] - at.rows_by_s.T @ multipliers
            multipliers[program.chosen] = rest / program.own if self._alone else program.own.solve(rest, "T")
        self._active = self._active[0], np.flatnonzero(np.abs(prices[:n]) > PRICED)
        self.begin(multipliers)
        normals = self._list_normals(program, *self._active)
        return Step(w, multipliers, -float(at.gradient @ w + 0.5 * w @ bent), relaxed, normals, bend, program.hessian)


def _split(normals: Array) -> tuple[Array, Array]:
    """Return orthonormal bases of the span of rows (a, n), and of what is orthogonal to it, as columns."""
    lengths = np.maximum(np.linalg.norm(normals, axis=1), 1e-300)
    square = np.linalg.qr((normals / lengths[:, None]), mode="r")
    _, s, vt = np.linalg.svd(square)
    rank = int(np.sum(s > RANK * s.max(initial=0.0)))
    return vt[:rank].T, vt[rank:].T


def _make_bend(hessian: Array, normals: Array) -> Array:
    """Return what makes a Hessian positive definite when it is added.

    Curvature across the active rows, whose derivatives are ``normals``, is raised: it does not act along them, which keeps the
    convergence quadratic. Negative curvature along them changes its sign.
    """
    scale = max(float(np.abs(hessian).max(initial=0.0)), 1e-3)
    least = LEAST_CURVATURE * scale
    across, along = _split(normals)
    values, directions = np.linalg.eigh(along.T @ hessian @ along)
    positive = np.maximum(np.abs(values), least)
    axes = along @ directions
    bend = (axes * (positive - values)) @ axes.T
    if across.size:
        bent = hessian + bend
        mixed = across.T @ bent @ axes
        schur = across.T @ bent @ across - (mixed / positive) @ mixed.T
        bend += max(0.0, MARGIN * scale - float(np.linalg.eigvalsh(schur)[0])) * (across @ across.T)
    return np.asarray(bend)


def _load_daqp() -> Any:
    try:
        return importlib.import_module("daqp")
    except ImportError as error:
        raise InputError("planning again requires DAQP; install it: pip install 'nlp-gait[qp]'") from error
