"""Evaluated points, as algorithms keep them from generation to generation."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from metaheuristics.interface import Array, Rule


class Points(NamedTuple):
    """Points with what is known about them; operations return new ones."""

    X: Array  #: (P, n) points
    f: Array  #: (P,) objectives; infinity where failed
    violation: Array  #: (P,) violations; infinity where failed

    @classmethod
    def none(cls, n: int) -> Points:
        """Give zero points of n variables."""
        return cls(np.empty((0, n)), np.empty(0), np.empty(0))

    def take(self, rows: NDArray[np.intp] | slice) -> Points:
        """Pick rows, in the order given."""
        return Points(self.X[rows], self.f[rows], self.violation[rows])

    def join(self, other: Points) -> Points:
        """Append the rows of others."""
        return Points(*(np.concatenate(pair) for pair in zip(self, other, strict=True)))

    def replace_rows(self, rows: NDArray[np.bool_], by: Points) -> Points:
        """Put the same rows of others, of equal number, in place of those that are True."""
        return Points(
            np.where(rows[:, None], by.X, self.X),
            np.where(rows, by.f, self.f),
            np.where(rows, by.violation, self.violation),
        )

    def best(self, count: int, rule: Rule) -> Points:
        """Keep the best, best first; equals keep their order."""
        return self.take(rule.order(self.f, self.violation)[:count])

    def best_distinct(self, count: int, rule: Rule) -> Points:
        """Keep the best, best first, with copies of a point only where there is nothing else to keep.

        Copies are recognised among neighbours in the order: points of equal f and violation may hide one another.
        """
        ranked = self.best(len(self.f), rule)
        copy = np.zeros(len(ranked.f), dtype=bool)
        copy[1:] = (ranked.X[1:] == ranked.X[:-1]).all(axis=1)
        return ranked.take(np.argsort(copy, kind="stable")[:count])
