"""Linear equations of a few unknowns as expressions: elimination with pivots that are chosen once, from numbers."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import casadi as ca
import numpy as np
from casadi import SX

Array = np.ndarray[Any, Any]

# A pivot of at least this share of the largest one may be chosen for its sparsity.
THRESHOLD = 0.2
# Matrices whose orders are candidates, and the share of the best smallest pivot above which less work decides.
CANDIDATES, NEARLY_BEST = 60, 0.8


@dataclass(frozen=True, kw_only=True, eq=False)
class Factors:
    """Factors of a matrix, with rows and columns in the order of elimination."""

    order: tuple[tuple[int, int], ...]  #: (row, column) of each pivot
    #: (n, n) multipliers below the pivots and remaining entries above them, in the places of the matrix
    factors: Sequence[Sequence[SX]]
    inverses: Sequence[SX]  #: of the pivots

    def solve(self, right: SX) -> SX:
        """Return the solution (n,) for a right-hand side (n,)."""
        b = ca.vertsplit(right)
        for k, (row, column) in enumerate(self.order):
            for below, _ in self.order[k + 1 :]:
                b[below] = b[below] - self.factors[below][column] * b[row]
        x = [SX(0)] * len(b)
        for k in reversed(range(len(self.order))):
            row, column = self.order[k]
            solved = sum((self.factors[row][later] * x[later] for _, later in self.order[k + 1 :]), SX(0))
            x[column] = (b[row] - solved) * self.inverses[k]
        return ca.vertcat(*x)


def choose_pivots(matrices: Array, pattern: Array) -> tuple[tuple[int, int], ...]:
    """Choose an order of elimination, (row, column) of each pivot, that suits all of some matrices and needs little work.

    ``matrices`` (N, n, n) are examples, ``pattern`` (n, n) says whether an entry is ever nonzero.
    """
    orders = {_choose_pivots_of(matrix, pattern) for matrix in matrices[:: max(1, len(matrices) // CANDIDATES)]}
    least = {order: _find_least_pivot(matrices, order) for order in orders}
    best = max(least.values())
    return min(
        (order for order in orders if least[order] >= NEARLY_BEST * best),
        key=lambda order: (_count_multiplications(pattern, order), -least[order], order),
    )


def _choose_pivots_of(matrix: Array, pattern: Array) -> tuple[tuple[int, int], ...]:
    left, filled = matrix.copy(), pattern.copy()
    rows, columns = list(range(len(matrix))), list(range(len(matrix)))
    order: list[tuple[int, int]] = []
    while rows:
        block = np.abs(left[np.ix_(rows, columns)])
        used = filled[np.ix_(rows, columns)]
        candidates = np.argwhere((block >= THRESHOLD * block.max()) & used)
        work = [(used[:, c].sum() - 1) * (used[r].sum() - 1) for r, c in candidates]
        best = min(range(len(candidates)), key=lambda k: (work[k], -block[tuple(candidates[k])]))
        row, column = rows[candidates[best][0]], columns[candidates[best][1]]
        rows.remove(row)
        columns.remove(column)
        order.append((row, column))
        for below in rows:
            left[below, columns] -= left[below, column] / left[row, column] * left[row, columns]
            if filled[below, column]:
                filled[below, columns] |= filled[row, columns]
    return tuple(order)


def _find_least_pivot(matrices: Array, order: Sequence[tuple[int, int]]) -> float:
    left, least = matrices.copy(), np.inf
    rows = [row for row, _ in order]
    for k, (row, column) in enumerate(order):
        pivot = left[:, row, column]
        least = min(least, float(np.abs(pivot).min()))
        if least == 0.0:
            return 0.0
        for below in rows[k + 1 :]:
            left[:, below] -= (left[:, below, column] / pivot)[:, None] * left[:, row]
    return least


def _count_multiplications(pattern: Array, order: Sequence[tuple[int, int]]) -> int:
    filled, work = pattern.copy(), 0
    for k, (row, column) in enumerate(order):
        later = [c for _, c in order[k + 1 :]]
        for below, _ in order[k + 1 :]:
            if filled[below, column]:
                work += 1 + int(filled[row, later].sum())
                filled[below, later] |= filled[row, later]
    return work


def factorise(matrix: SX, order: Sequence[tuple[int, int]], least_pivot: float) -> Factors:
    """Factorise a matrix (n, n) in the order of ``choose_pivots``; structural zeros cost nothing.

    Smaller pivots are replaced by the least one, with their sign: the factors are finite for every matrix.
    """
    n = len(order)
    entries = [[matrix[i, j] for j in range(n)] for i in range(n)]
    inverses = []
    for k, (row, column) in enumerate(order):
        pivot = entries[row][column]
        sign = 2 * (pivot >= 0) - 1
        inverses.append(sign / ca.fmax(ca.fabs(pivot), least_pivot))
        for below, _ in order[k + 1 :]:
            entries[below][column] = entries[below][column] * inverses[k]
            for _, later in order[k + 1 :]:
                entries[below][later] = entries[below][later] - entries[below][column] * entries[row][later]
    return Factors(order=tuple(order), factors=entries, inverses=inverses)
