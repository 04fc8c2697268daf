"""One step of sequential quadratic programming, as a dense quadratic program in the problem's variables.

Each lifted variable lies on one of the rows that tie it, at |v| for example on s - v >= 0 if v > 0. To first order that row, as
an equation, gives s in terms of the variables, and both disappear from the program. Where the program's solution then violates
another row of s, v changes its sign: the program gets a variable r >= 0, by which s is away from the first row, and the other
rows of s. Rows that are satisfied far from their bounds enter when a solution violates them. So the solution is that of the
whole program, but for the curvature by r, which is 0 in the end.

Often many v are zero at once but depend on few directions. Then r of as many v as there are directions are enough to hold all at
zero, if each other v stays on the row that has its price in the last program, whatever its sign is now. What these v miss
to second order costs little next to the step's decrease, and is tolerated.
"""

import importlib
from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.linalg import splu

from nlp_gait.backends.nlp import IntArray
from nlp_gait.backends.onboard.nlp_functions import NlpFunctions
from nlp_gait.errors import InputError
from nlp_gait.formulation import Array

BoolArray = NDArray[np.bool_]
ROUNDS = 15  # in which rows and lifted variables are added
VIOLATED = 1e-9  # by a solution of the program, in units of the row
PRICED = 1e-6  # multiplier of a row that is active
KINK = 1e-3  # least share of the price of |v|'s other row where v is zero
# A |v| stays on the row of the last program if that costs less than this share of the cost.
NEAR, LEAST_COST = 1e-4, 0.1
TOLERATED = 0.1  # share of the predicted decrease that lifted variables on wrong rows may cost
WORST = 0.1  # share of the highest of these costs, from which a lifted variable is kept in the program
RANK = 1e-6  # singular values of active rows below this share of the largest are zero
# Smallest curvature, relative to the largest: along active rows, and at first across them.
LEAST_CURVATURE, LEAST_DAMPING = 1e-6, 1e-3
NO_BOUND = 1e30  # DAQP's infinity
ACTIVE, ACTIVE_BELOW, EQUATION, SOFT = 1, 3, 5, 8  # DAQP's marks of rows; a soft one may be violated
INFEASIBLE = -1  # DAQP's exit flag
SETTINGS = {"primal_tol": 1e-10, "dual_tol": 1e-10, "iter_limit": 200}


@dataclass(frozen=True, eq=False)
class Step:
    """Solution of the program."""

    w: Array  #: (N,) step of the scaled variables and the lifted ones
    multipliers: Array  #: (m,) of all rows, positive at an upper bound
    decrease: float  #: predicted decrease of the cost
    relaxed: bool  #: whether rows had to be violated
    #: How much less the cost would be with the Hessian itself, if the same rows are active
    estimate_rest: Callable[[], float]


@dataclass(frozen=True, eq=False)
class _Program:
    """The program in the problem's variables z, without kept lifted variables, and without what is left to the bounds."""

    ties: IntArray  #: (lifted,) chosen rows
    own: Array  #: (lifted,) derivatives of the chosen rows by their lifted variables
    #: By the derivatives of the chosen rows by the lifted variables, or ("T") by their transpose
    divide: Callable[..., Array]
    lifts: Array  #: (lifted, n) lifted variables from z
    rows: Array  #: (m, n) change of the rows from z
    hessian: Array  #: (n, n)
    linear: Array  #: (n,)
    crossed: Array  #: (lifted, n) linear term from lifted variables


class StepSolver:
    """Programs of one NLP; each begins with the rows and lifted variables that mattered in the last one."""

    #: Least curvature across active rows, relative to the largest; steps are longer and less safe if it is small.
    damping = LEAST_DAMPING

    def __init__(self, functions: NlpFunctions) -> None:
        """Raise InputError if DAQP is not installed."""
        try:
            self._daqp: Any = importlib.import_module("daqp")
        except ImportError as error:
            raise InputError("planning again requires DAQP; install it: pip install 'nlp-gait[qp]'") from error
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
        self._prices, self._z_prices = np.zeros(len(functions.g)), np.zeros(self.n)

    def begin(self, multipliers: Array) -> None:
        """Begin the next program with the rows that have a price in multipliers (m,)."""
        self._prices = multipliers

    def choose_ties(self, g: Array) -> IntArray:
        """Return the row of each lifted variable that its value comes from: the least one."""
        if not self.lifted:
            return np.zeros(0, np.intp)
        values = g[self._order]
        least = np.minimum.reduceat(values, self._groups)
        place = np.where(values == least.repeat(self._sizes), self._places, -1)
        return np.asarray(self._order[np.maximum.reduceat(place, self._groups)])

    def prepare(self, ties: IntArray) -> None:
        """Set up the program at the functions' point, where ``ties`` are the least rows."""
        self._program = self._reduce(self._keep_ties(ties))
        is_active, self._is_kept = self._find_active()
        self._bent = _make_convex(self._program.hessian, self._list_normals(is_active), self.damping)

    def solve(self, lower: Array, upper: Array, z_lower: Array, z_upper: Array) -> Step | None:
        """Solve the prepared program, also again with other values of the rows; None if that fails.

        Takes what is left to the bounds of the rows (m,) and of z (n,), negative and positive.
        """
        at, n, first, program = self._functions, self.n, self._first, self._program
        ties, is_kept, lift = program.ties, self._is_kept, program.divide(lower[program.ties])
        shift, slope = at.rows_by_s @ lift, program.linear + lift @ program.crossed
        is_inside = lower == upper
        is_inside[:first] |= np.abs(self._prices[:first]) > PRICED
        for _ in range(ROUNDS):
            is_inside[first:] = is_kept[self._owner]
            is_inside[ties] = False
            inside, kept = np.flatnonzero(is_inside), np.flatnonzero(is_kept)
            away = np.zeros((self.lifted, len(kept)))
            away[kept, range(len(kept))] = (self._sense * program.own)[kept]
            away = program.divide(away)
            rows_by_r = at.rows_by_s @ away
            rows = np.concatenate([program.rows[inside], rows_by_r[inside]], axis=1)
            linear = np.concatenate([slope, at.gradient[n:] @ away])
            left = lower[inside] - shift[inside], upper[inside] - shift[inside], z_lower, z_upper
            found = self._solve_dense(self._bent, linear, rows, inside, left)
            if found is None:
                return None
            y, prices, relaxed = found
            z, r = y[:n], y[n:]
            w = np.concatenate([z, program.lifts @ z + lift + away @ r])
            curved = at.hessian @ w
            multipliers = np.zeros(len(at.g))
            multipliers[inside] = prices[len(y) :]
            multipliers[ties] = program.divide(-(at.gradient + curved)[n:] - at.s_by_rows @ multipliers, "T")
            decrease = -float(at.gradient @ w + 0.5 * w @ curved)
            change = program.rows @ z + shift + rows_by_r @ r
            violation = np.maximum(lower - change, change - upper)
            violation[ties] = violation[inside] = 0.0
            wrong = np.flatnonzero(violation > VIOLATED)
            own_rows, wrong = wrong[wrong < first], wrong[wrong >= first]
            owners = self._owner[wrong - first]
            missed = np.abs(multipliers[ties[owners]]) * violation[wrong]
            if not own_rows.size and missed.sum() <= TOLERATED * abs(decrease) + VIOLATED:
                break
            is_inside[own_rows] = True
            is_kept[owners[missed >= WORST * missed.max(initial=0.0)]] = True
        self._prices, self._z_prices = multipliers, prices[:n]
        priced = inside[(inside >= first) & (np.abs(prices[len(y) :]) > PRICED)]
        self._is_kept = np.isin(np.arange(self.lifted), self._owner[priced - first])
        return Step(w, multipliers, decrease, relaxed, lambda: self._estimate_rest(z))

    def _estimate_rest(self, z: Array) -> float:
        hessian = self._program.hessian
        along = _split(self._list_normals(self._find_active()[0]))[1]
        gradient = along.T @ ((self._bent - hessian) @ z)
        values, directions = np.linalg.eigh(along.T @ hessian @ along)
        return 0.5 * float(np.sum((directions.T @ gradient) ** 2 / np.maximum(values, _least(hessian))))

    def _keep_ties(self, ties: IntArray) -> IntArray:
        """Return the rows to choose: that with the highest price in the last program if it is near the least one."""
        if not self.lifted:
            return ties
        g, price = self._functions.g, np.abs(self._prices[self._order])
        highest = np.maximum.reduceat(price, self._groups)
        place = np.where(price == highest.repeat(self._sizes), self._places, -1)
        priced = self._order[np.maximum.reduceat(place, self._groups)]
        most = NEAR * max(abs(float(self._functions.cost[0])), LEAST_COST)
        return np.where((highest > PRICED) & ((g[priced] - g[ties]) * highest <= most), priced, ties)

    def _find_active(self) -> tuple[BoolArray, BoolArray]:
        """Return which rows have a price, apart from the only one of a lifted variable, and which lifted variables have two."""
        price = np.abs(self._prices)
        is_active = price > PRICED
        if not self.lifted:
            return is_active, np.zeros(0, dtype=bool)
        prices = price[self._order]
        highest = np.maximum.reduceat(prices, self._groups)
        others = np.add.reduceat(prices, self._groups) - highest
        is_kept = others > KINK * np.maximum(highest, KINK * price.max()) + PRICED
        is_kept &= self._sense != 0.0
        is_active[self._first :] &= is_kept[self._owner]
        return is_active, is_kept

    def _list_normals(self, is_active: BoolArray) -> Array:
        """Return the derivatives of active rows and bounds by z; those of the chosen ties are 0."""
        is_active[self._program.ties] = False
        return np.concatenate([self._program.rows[is_active], self._unit[np.abs(self._z_prices) > PRICED]])

    def _reduce(self, ties: IntArray) -> _Program:
        at, n, by_s = self._functions, self.n, self._functions.rows_by_s
        divide: Callable[..., Array]
        if self._alone:
            own = by_s.data[by_s.indptr[ties]]
            divide = lambda right, _="N": (right.T / own).T  # noqa: E731
        else:
            chosen = sparse.csc_matrix(by_s[ties])
            own, divide = chosen.diagonal(), splu(chosen).solve
        lifts = divide(-at.rows_by_z[ties])
        full = np.concatenate([self._unit, lifts])
        bent = at.hessian @ full
        hessian = full.T @ bent
        hessian = (hessian + hessian.T) / 2
        return _Program(ties, own, divide, lifts, by_s @ lifts + at.rows_by_z, hessian, at.gradient @ full, bent[n:])

    def _solve_dense(
        self, bent: Array, linear: Array, rows: Array, inside: IntArray, bounds: tuple[Array, Array, Array, Array]
    ) -> tuple[Array, Array, bool] | None:
        """Return y = (z, r), the multipliers of its bounds and of the rows inside, and whether rows are violated."""
        n, q = self.n, len(linear)
        lower, upper, z_lower, z_upper = bounds
        high = np.concatenate([z_upper, np.full(q - n, NO_BOUND), np.minimum(upper, NO_BOUND)])
        low = np.concatenate([z_lower, np.zeros(q - n), np.maximum(lower, -NO_BOUND)])
        hessian = np.zeros((q, q))
        hessian[:n, :n] = bent
        hessian[range(n, q), range(n, q)] = LEAST_CURVATURE * bent.diagonal().max(initial=1e-3)
        prices = np.concatenate([self._z_prices, np.full(q - n, -1.0), self._prices[inside]])
        sense = np.where(prices > PRICED, ACTIVE, np.where(prices < -PRICED, ACTIVE_BELOW, 0)).astype(np.int32)
        sense[high <= low] = EQUATION
        for relaxed in (False, True):
            y, _, flag, info = self._daqp.solve(hessian, linear, rows, high, low, sense, **SETTINGS)
            if flag > 0:
                return y, np.asarray(info["lam"]), relaxed
            if flag != INFEASIBLE:
                return None
            sense[q:] = SOFT
        return None


def _split(normals: Array) -> tuple[Array, Array]:
    """Return orthonormal bases of the span of rows (a, n), and of what is orthogonal to it, as columns."""
    unit = normals / np.maximum(np.sqrt(np.einsum("ij,ij->i", normals, normals)), 1e-300)[:, None]
    values, vectors = np.linalg.eigh(unit.T @ unit)
    is_across = values > RANK**2 * values[-1]
    return vectors[:, is_across], vectors[:, ~is_across]


def _least(hessian: Array) -> float:
    return LEAST_CURVATURE * max(float(np.abs(hessian).max(initial=0.0)), 1e-3)


def _make_convex(hessian: Array, normals: Array, damping: float) -> Array:
    """Return a positive definite matrix in place of a Hessian.

    Along the active rows, whose derivatives are ``normals``, negative curvature changes its sign and the rest stays, so that
    the convergence is quadratic. Curvature across them, which acts only where one of them is left, becomes at least the damping
    times the largest, and what connects both is removed.
    """
    least = _least(hessian)
    bent = np.zeros_like(hessian)
    for basis, lowest, is_along in zip(_split(normals), (damping / LEAST_CURVATURE, 1.0), (False, True), strict=True):
        if basis.size:
            values, directions = np.linalg.eigh(basis.T @ hessian @ basis)
            axes = basis @ directions
            bent += (axes * np.maximum(np.abs(values) if is_along else values, lowest * least)) @ axes.T
    return bent
