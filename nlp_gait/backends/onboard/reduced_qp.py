"""One step of sequential quadratic programming, as a dense quadratic program in the problem's variables.

Each lifted variable lies on one of the rows that tie it, at |v| for example on s - v >= 0 if v > 0. To first order that row, as
an equation, gives s in terms of the variables, and both disappear from the program. Where the program's solution then violates
another row of s, v changes its sign: s stays a variable of the program with all its rows. Rows that are satisfied far from
their bounds enter when a solution violates them. So the solution is that of the whole program.
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
AT_ZERO = 1e-7  # largest |v| that is zero
KINK = 1e-3  # least share of the price of |v|'s other row where v is zero
RANK = 1e-9  # singular values of active rows below this share of the largest are zero
# Smallest curvature of the program, relative to the largest.
LEAST_CURVATURE = 1e-6
MARGIN = 1e-2  # of the curvature across active rows, relative to the largest
NO_BOUND = 1e30  # DAQP's infinity
EQUATION, SOFT = 5, 8  # DAQP's marks of rows; a soft one may be violated
INFEASIBLE = -1  # DAQP's exit flag
# More |v| at zero than this depend on each other in the problems here: DAQP then fails after hundreds of iterations.
MOST_KINKS = 45
SETTINGS = {"primal_tol": 1e-10, "dual_tol": 1e-10, "iter_limit": 200}


@dataclass(frozen=True, eq=False)
class Step:
    """Solution of the program."""

    w: Array  #: (N,) step of the scaled variables and the lifted ones
    multipliers: Array  #: (m,) of all rows, positive at an upper bound
    decrease: float  #: predicted decrease of the cost
    relaxed: bool  #: whether rows had to be violated


@dataclass(frozen=True, eq=False)
class _Program:
    """The program in y, the variables z and the kept lifted ones; the last column of some matrices is the constant part."""

    eliminated: IntArray  #: lifted variables
    chosen: IntArray  #: row that gives each of them
    own: Any  #: derivative of these rows by their lifted variables: its diagonal or its factors
    full: Array  #: (N, q + 1) all variables from y
    bent: Array  #: (N, q + 1) Hessian times ``full``
    rows: Array  #: (m, q) Jacobian
    constant: Array  #: (m,) change of the rows at y = 0
    hessian: Array  #: (q, q)
    linear: Array  #: (q,)


@dataclass(frozen=True, eq=False)
class _Bend:
    """What is added to a program to make it convex, for its first unknowns."""

    hessian: Array
    linear: Array
    least: float  #: smallest curvature, that of further unknowns


class StepSolver:
    """Programs of one NLP; each begins with the rows and lifted variables that mattered in the last one."""

    def __init__(self, functions: NlpFunctions) -> None:
        """Raise InputError if DAQP is not installed."""
        self._daqp = _load_daqp()
        self._functions = functions
        model = functions.model
        self.n, self.lifted = model.variables, model.lifted
        self._first = len(model.row_names)
        self._owner, self._is_tight = model.tie_owner, model.lift_sense == 0.0
        self._order = self._first + np.argsort(self._owner, kind="stable")
        self._groups = np.searchsorted(np.sort(self._owner), np.arange(self.lifted))
        by_s = functions.rows_by_s
        ties = np.arange(self._first, len(functions.g))
        #: whether each row depends on no lifted variable but its own
        self._alone = np.zeros(len(functions.g), dtype=bool)
        self._alone[ties] = np.diff(by_s.indptr)[ties] == 1
        self._rows = np.zeros(0, np.intp)  # that begin in the program
        self._kept = np.zeros(0, np.intp)  # lifted variables that do
        self._active = (self._rows, self._rows)  # rows, and variables at a bound

    def begin(self, multipliers: Array) -> None:
        """Begin the next program with the rows that have a price in multipliers (m,), and with |v| at zero."""
        price = np.abs(multipliers)
        active = np.flatnonzero(price > PRICED)
        total = np.bincount(self._owner, price[self._first :], minlength=self.lifted)
        highest = np.maximum.reduceat(price[self._order], self._groups) if self.lifted else total
        least = KINK * np.maximum(highest, KINK * price.max(initial=0.0)) + PRICED
        self._kept = np.flatnonzero((total - highest > least) & ~self._is_tight)
        of_kept = np.zeros(len(multipliers), dtype=bool)
        of_kept[self._first :] = np.isin(self._owner, self._kept)
        self._rows = active[active < self._first]
        self._active = active[(active < self._first) | of_kept[active]], self._active[1]

    def choose_ties(self, g: Array) -> IntArray:
        """Return the row of each lifted variable that its value comes from: the least one."""
        if not self.lifted:
            return np.zeros(0, np.intp)
        values = g[self._order]
        least = np.minimum.reduceat(values, self._groups)
        sizes = np.diff(np.append(self._groups, len(values)))
        place = np.where(values == np.repeat(least, sizes), np.arange(len(values)), -1)
        return np.asarray(self._order[np.maximum.reduceat(place, self._groups)])

    def solve(self, lower: Array, upper: Array, z_lower: Array, z_upper: Array) -> Step | None:
        """Solve the program at the functions' point; None if that fails.

        Takes what is left to the bounds of the rows (m,) and of z (n,), negative and positive.
        """
        ties, kept = self.choose_ties(self._functions.g), self._kept
        if self.lifted:
            kept = np.union1d(kept, self._find_kinks(self._functions.g))
        rows = np.union1d(self._rows, np.flatnonzero((lower == upper)[: self._first]))
        program = self._reduce(ties, kept, lower)
        bend = self._choose_bend(program, rows, lower, upper, z_lower, z_upper)
        for _ in range(ROUNDS):
            if len(kept) > MOST_KINKS:
                return None
            inside = np.concatenate([rows, self._first + np.flatnonzero(np.isin(self._owner, kept))])
            found = self._solve_dense(program, bend, inside, lower, upper, z_lower, z_upper)
            if found is None:
                return None
            solved = program, inside, *found
            change = program.constant + program.rows @ found[0]
            out = np.maximum(lower - change, change - upper)
            out[program.chosen] = out[inside] = 0.0
            wrong = np.flatnonzero(out > VIOLATED)
            if not wrong.size:
                break
            rows = np.union1d(rows, wrong[wrong < self._first])
            if wrong[0] >= self._first:  # the rows of the problem are satisfied
                kept = np.concatenate([kept, np.unique(self._owner[wrong - self._first])])
                program = self._reduce(ties, kept, lower)
        return self._finish(*solved)

    def _find_kinks(self, g: Array) -> IntArray:
        """Return the lifted variables with more than one row at its bound: |v| at zero."""
        at_bound = np.add.reduceat(g[self._order] < AT_ZERO, self._groups)
        return np.flatnonzero((at_bound > 1) & ~self._is_tight)

    def _reduce(self, ties: IntArray, kept: IntArray, lower: Array) -> _Program:
        """Eliminate all lifted variables but the kept ones."""
        at, n, by_s = self._functions, self.n, self._functions.rows_by_s
        is_kept = np.zeros(self.lifted, dtype=bool)
        is_kept[kept] = True
        eliminated = np.flatnonzero(~is_kept)
        chosen = ties[eliminated]
        right = np.zeros((len(chosen), n + len(kept) + 1))
        right[:, :n], right[:, -1] = at.rows_by_z[chosen], -lower[chosen]
        s = np.zeros((self.lifted, right.shape[1]))
        own: Any
        if self._alone[chosen].all():
            own = by_s.data[by_s.indptr[chosen]]
            s[eliminated] = -right / own[:, None]
        else:
            part = by_s[chosen].tocsc()
            right[:, n:-1] = part[:, kept].toarray()
            own = splu(sparse.csc_matrix(part[:, eliminated]))
            s[eliminated] = -own.solve(right)
        s[kept, n + np.arange(len(kept))] = 1.0
        full = np.concatenate([np.eye(n, right.shape[1]), s])
        rows = by_s @ s
        rows[:, :n] += at.rows_by_z
        bent = at.hessian @ full
        return _Program(
            eliminated=eliminated,
            chosen=chosen,
            own=own,
            full=full,
            bent=bent,
            rows=rows[:, :-1],
            constant=rows[:, -1],
            hessian=full[:, :-1].T @ bent[:, :-1],
            linear=full[:, :-1].T @ (at.gradient + bent[:, -1]),
        )

    def _choose_bend(
        self, program: _Program, rows: IntArray, lower: Array, upper: Array, z_lower: Array, z_upper: Array
    ) -> _Bend:
        """Choose what makes the program convex, from what was active at the end of the last one."""
        active, at_bound = self._active
        active = active[(active >= self._first) | np.isin(active, rows)]
        low, high = (lower - program.constant)[active], (upper - program.constant)[active]
        low, high = np.append(low, z_lower[at_bound]), np.append(high, z_upper[at_bound])
        targets = np.where(np.abs(high) < np.abs(low), high, low)
        normals = np.concatenate([program.rows[active], np.eye(self.n, len(program.linear))[at_bound]])
        return _make_bend((program.hessian + program.hessian.T) / 2, normals, targets)

    def _solve_dense(
        self,
        program: _Program,
        bend: _Bend,
        inside: IntArray,
        lower: Array,
        upper: Array,
        z_lower: Array,
        z_upper: Array,
    ) -> tuple[Array, Array, IntArray, bool] | None:
        """Return y, multipliers of the rows, the variables at a bound, and whether rows are violated."""
        q, old = len(program.linear), len(bend.linear)
        free = np.full(q - self.n, NO_BOUND)
        high = np.minimum(np.concatenate([z_upper, free, (upper - program.constant)[inside]]), NO_BOUND)
        low = np.maximum(np.concatenate([z_lower, -free, (lower - program.constant)[inside]]), -NO_BOUND)
        hessian, linear = (program.hessian + program.hessian.T) / 2, program.linear.copy()
        hessian[:old, :old] += bend.hessian
        linear[:old] += bend.linear
        hessian[range(old, q), range(old, q)] += bend.least
        sense = np.where(high - low <= 0.0, EQUATION, 0).astype(np.int32)
        rows = np.ascontiguousarray(program.rows[inside])
        for relaxed in (False, True):
            y, _, flag, info = self._daqp.solve(hessian, linear, rows, high, low, sense, **SETTINGS)
            if flag > 0:
                prices = np.asarray(info["lam"])
                return y, prices[q:], np.flatnonzero(np.abs(prices[: self.n]) > PRICED), relaxed
            if flag != INFEASIBLE:
                return None
            sense[q:] = SOFT
        return None

    def _finish(
        self, program: _Program, inside: IntArray, y: Array, priced: Array, at_bound: IntArray, relaxed: bool
    ) -> Step:
        """Return the whole step, with the multipliers of the eliminated rows, and keep what the next program begins with."""
        at, n = self._functions, self.n
        extended = np.append(y, 1.0)
        step, bent = program.full @ extended, program.bent @ extended
        multipliers = np.zeros(len(at.g))
        multipliers[inside] = priced
        if program.eliminated.size:
            rest = -(at.gradient + bent)[n:] - at.rows_by_s.T @ multipliers
            rest, own = rest[program.eliminated], program.own
            multipliers[program.chosen] = rest / own if isinstance(own, np.ndarray) else own.solve(rest, "T")
        self.begin(multipliers)
        self._active = self._active[0], at_bound
        return Step(step, multipliers, -float(at.gradient @ step + 0.5 * step @ bent), relaxed)


def _make_bend(hessian: Array, normals: Array, targets: Array) -> _Bend:
    """Return what makes a Hessian positive definite.

    Curvature across the rows that were active, ``normals`` y = ``targets``, is raised around a point on them: it changes nothing
    while they stay active. Negative curvature along them changes its sign.
    """
    q = len(hessian)
    curvature = np.linalg.eigvalsh(hessian)
    least = LEAST_CURVATURE * max(float(np.abs(curvature).max(initial=0.0)), 1e-3)
    if curvature[0] >= least:
        return _Bend(np.zeros((q, q)), np.zeros(q), least)
    length = np.maximum(np.linalg.norm(normals, axis=1), 1e-300)
    u, s, vt = np.linalg.svd(normals / length[:, None], full_matrices=True)
    rank = int(np.sum(s > RANK * s.max(initial=0.0)))
    across, along = vt[:rank].T, vt[rank:].T
    point = across @ ((u[:, :rank].T @ (targets / length)) / s[:rank])
    values, directions = np.linalg.eigh(along.T @ hessian @ along)
    positive = np.maximum(np.abs(values), least)
    axes = along @ directions
    bend = (axes * (positive - values)) @ axes.T
    bent = hessian + bend
    mixed = across.T @ bent @ axes
    schur = across.T @ bent @ across - (mixed / positive) @ mixed.T
    raised = max(0.0, MARGIN * np.abs(curvature).max() - float(np.linalg.eigvalsh(schur)[0])) if rank else 0.0
    projector = raised * across
    return _Bend(bend + projector @ across.T, -projector @ (across.T @ point), least)


def _load_daqp() -> Any:
    try:
        return importlib.import_module("daqp")
    except ImportError as error:
        raise InputError("planning again requires DAQP; install it: pip install 'nlp-gait[qp]'") from error
