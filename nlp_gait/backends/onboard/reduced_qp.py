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

ROUNDS = 15  # in which rows, lifted variables and active rows change
VIOLATED = 1e-9  # by a solution of the program, in units of the row
PRICED = 1e-6  # multiplier of a row that is active
RANK = 1e-9  # singular values of active rows below this share of the largest are zero
# Smallest curvature of the program, relative to the largest.
LEAST_CURVATURE = 1e-6
NO_BOUND = 1e30  # DAQP's infinity
EQUATION, SOFT = 5, 8  # DAQP's marks of rows; a soft one may be violated
INFEASIBLE = -1  # DAQP's exit flag
SETTINGS = {"primal_tol": 1e-10, "dual_tol": 1e-10, "iter_limit": 1000}


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
        active = np.flatnonzero(np.abs(multipliers) > PRICED)
        counts = np.bincount(self._owner[active[active >= self._first] - self._first], minlength=self.lifted)
        self._kept = np.flatnonzero((counts > 1) & ~self._is_tight)
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
        rows = np.union1d(self._rows, np.flatnonzero((lower == upper)[: self._first]))
        program = self._reduce(ties, kept, lower)
        for _ in range(ROUNDS):
            inside = np.concatenate([rows, self._first + np.flatnonzero(np.isin(self._owner, kept))])
            found = self._solve_dense(program, inside, lower, upper, z_lower, z_upper)
            if found is None:
                return None
            y, priced, active, relaxed, settled = found
            solved = program, inside, y, priced, relaxed
            change = program.constant + program.rows @ y
            out = np.maximum(lower - change, change - upper)
            out[program.chosen] = out[inside] = 0.0
            wrong = np.flatnonzero(out > VIOLATED)
            self._active = active
            if not wrong.size and settled:
                break
            rows = np.union1d(rows, wrong[wrong < self._first])
            if wrong.size and wrong[0] >= self._first:  # the rows of the problem are satisfied
                kept = np.union1d(kept, self._owner[wrong - self._first])
                program = self._reduce(ties, kept, lower)
        return self._finish(*solved)

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

    def _solve_dense(
        self, program: _Program, inside: IntArray, lower: Array, upper: Array, z_lower: Array, z_upper: Array
    ) -> tuple[Array, Array, tuple[IntArray, IntArray], bool, bool] | None:
        """Return y, multipliers of the rows, what is active, whether rows are violated, and whether curvature fits."""
        q = len(program.linear)
        free = np.full(q - self.n, NO_BOUND)
        high = np.concatenate([z_upper, free, (upper - program.constant)[inside]])
        low = np.concatenate([z_lower, -free, (lower - program.constant)[inside]])
        active_rows, at_bound = self._active
        known = np.isin(inside, active_rows)
        # Targets only matter in combination with the last multipliers' sides; both sides coincide for most rows.
        side = np.where(np.abs(high[q:]) < np.abs(low[q:]), high[q:], low[q:])[known]
        edge = np.where(np.abs(high[:q]) < np.abs(low[:q]), high[:q], low[:q])[at_bound]
        normals = np.concatenate([program.rows[inside[known]], np.eye(q)[at_bound]])
        hessian, linear, changed = _convexify(program, normals, np.concatenate([side, edge]))
        sense = np.where(high - low <= 0.0, EQUATION, 0).astype(np.int32)
        rows = np.ascontiguousarray(program.rows[inside])
        high, low = np.minimum(high, NO_BOUND), np.maximum(low, -NO_BOUND)
        for relaxed in (False, True):
            y, _, flag, info = self._daqp.solve(hessian, linear, rows, high, low, sense, **SETTINGS)
            if flag > 0:
                prices = np.asarray(info["lam"])
                is_active = np.abs(prices) > PRICED
                active = inside[is_active[q:]], np.flatnonzero(is_active[:q])
                same = all(map(np.array_equal, active, (inside[known], at_bound)))
                return y, prices[q:], active, relaxed, same or not changed
            if flag != INFEASIBLE:
                return None
            sense[q:] = SOFT
        return None

    def _finish(self, program: _Program, inside: IntArray, y: Array, priced: Array, relaxed: bool) -> Step:
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
        at_bound = self._active[1]
        self.begin(multipliers)
        self._active = self._active[0], at_bound[at_bound < n]
        return Step(step, multipliers, -float(at.gradient @ step + 0.5 * step @ bent), relaxed)


def _convexify(program: _Program, normals: Array, targets: Array) -> tuple[Array, Array, bool]:
    """Return a positive definite Hessian, its linear term, and whether the Hessian had to change.

    Curvature across the rows that were active, ``normals`` y = ``targets``, is raised around a point on them: it changes nothing
    while they stay active. Negative curvature along them changes its sign.
    """
    hessian = (program.hessian + program.hessian.T) / 2
    curvature = np.linalg.eigvalsh(hessian)
    least = LEAST_CURVATURE * max(float(np.abs(curvature).max(initial=0.0)), 1e-3)
    if curvature[0] >= least:
        return np.ascontiguousarray(hessian), program.linear, False
    length = np.maximum(np.linalg.norm(normals, axis=1), 1e-300)
    u, s, vt = np.linalg.svd(normals / length[:, None], full_matrices=True)
    rank = int(np.sum(s > RANK * s.max(initial=0.0)))
    across, along = vt[:rank].T, vt[rank:].T
    point = across @ ((u[:, :rank].T @ (targets / length)) / s[:rank])
    values, directions = np.linalg.eigh(along.T @ hessian @ along)
    positive = np.maximum(np.abs(values), least)
    axes = along @ directions
    hessian = hessian + (axes * (positive - values)) @ axes.T
    mixed = across.T @ hessian @ axes
    schur = across.T @ hessian @ across - (mixed / positive) @ mixed.T
    raised = max(0.0, 10 * least - float(np.linalg.eigvalsh(schur)[0])) if rank else 0.0
    projector = raised * across
    return np.ascontiguousarray(hessian + projector @ across.T), program.linear - projector @ (across.T @ point), True


def _load_daqp() -> Any:
    try:
        return importlib.import_module("daqp")
    except ImportError as error:
        raise InputError("planning again requires DAQP; install it: pip install 'nlp-gait[qp]'") from error
