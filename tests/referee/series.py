"""Truncated Taylor series in time: what is computed with them has its exact derivatives, whatever the formula.

The package differentiates symbolically; here numbers carry their derivatives along (Griewank and Walther, Evaluating
Derivatives, 2008, table 13.1 and 13.2).
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np

Array = np.ndarray[Any, np.dtype[np.float64]]


class Series:
    """Arrays as functions of time about an instant.

    Attributes:
        c: (order + 1, ...) coefficients: c[k] is the k-th derivative divided by k!.
    """

    __array_ufunc__ = None  # an array on the left leaves the operation to this class

    def __init__(self, c: Any) -> None:
        self.c = np.asarray(c, dtype=float)

    def d(self, order: int) -> Array:
        """Derivative of this order (0 is the value)."""
        return np.asarray(self.c[order] * math.factorial(order))

    def like(self, value: Any) -> Series:
        """A constant of the same order."""
        if isinstance(value, Series):
            return value
        value = np.asarray(value, dtype=float)
        return Series(np.concatenate([value[None], np.zeros((len(self.c) - 1, *value.shape))]))

    def __getitem__(self, index: Any) -> Series:
        return Series(self.c[(slice(None), *(index if isinstance(index, tuple) else (index,)))])

    def __neg__(self) -> Series:
        return Series(-self.c)

    def __add__(self, other: Any) -> Series:
        a, b = aligned(self.c, self.like(other).c)
        return Series(a + b)

    __radd__ = __add__

    def __sub__(self, other: Any) -> Series:
        return self + (-self.like(other))

    def __rsub__(self, other: Any) -> Series:
        return -self + other

    def __mul__(self, other: Any) -> Series:
        if not isinstance(other, Series):
            return Series(aligned(self.c, self.like(other).c)[0] * np.asarray(other))
        a, b = self.c, other.c
        return Series([sum(a[j] * b[k - j] for j in range(k + 1)) for k in range(len(a))])

    __rmul__ = __mul__

    def __truediv__(self, other: Any) -> Series:
        if not isinstance(other, Series):
            return self * (1.0 / np.asarray(other))
        a, b = aligned(self.c, other.c)
        q: list[Array] = []
        for k in range(len(a)):
            q.append((a[k] - sum(q[j] * b[k - j] for j in range(k))) / b[0])
        return Series(q)

    def __rtruediv__(self, other: Any) -> Series:
        return self.like(other) / self


def aligned(a: Array, b: Array) -> tuple[Array, Array]:
    """Coefficients whose values have the same number of axes."""
    axes = max(a.ndim, b.ndim)
    return tuple(x.reshape(x.shape[0], *(1,) * (axes - x.ndim), *x.shape[1:]) for x in (a, b))


def time(t: Any, order: int) -> Series:
    """Time itself at the instants t (...)."""
    t = np.asarray(t, dtype=float)
    return Series([t, np.ones_like(t), *(np.zeros_like(t) for _ in range(order - 1))])


def sqrt(u: Series) -> Series:
    """Square root of a positive series."""
    r = [np.sqrt(u.c[0])]
    for k in range(1, len(u.c)):
        r.append((u.c[k] - sum(r[j] * r[k - j] for j in range(1, k))) / (2.0 * r[0]))
    return Series(r)


def exp(u: Series) -> Series:
    """Exponential."""
    e = [np.exp(u.c[0])]
    for k in range(1, len(u.c)):
        e.append(sum(j * u.c[j] * e[k - j] for j in range(1, k + 1)) / k)
    return Series(e)


def sincos(u: Series) -> tuple[Series, Series]:
    """Sine and cosine."""
    s, c = [np.sin(u.c[0])], [np.cos(u.c[0])]
    for k in range(1, len(u.c)):
        s.append(sum(j * u.c[j] * c[k - j] for j in range(1, k + 1)) / k)
        c.append(-sum(j * u.c[j] * s[k - j] for j in range(1, k + 1)) / k)
    return Series(s), Series(c)


def atan2(y: Series, x: Series) -> Series:
    """Angle of the point (x, y): its rate is (x y' - y x') / (x^2 + y^2)."""
    n = len(y.c)
    square = x * x + y * y
    slope = [np.zeros_like(y.c[0] * x.c[0])] * (n - 1)
    dy, dx = ([(k + 1) * u.c[k + 1] for k in range(n - 1)] for u in (y, x))
    for k in range(n - 1):
        top = sum(x.c[j] * dy[k - j] - y.c[j] * dx[k - j] for j in range(k + 1))
        slope[k] = (top - sum(slope[j] * square.c[k - j] for j in range(k))) / square.c[0]
    return Series([np.arctan2(y.c[0], x.c[0]), *(slope[k] / (k + 1) for k in range(n - 1))])


def stack(parts: Any) -> Series:
    """Series of the same shape along a new first axis."""
    whole = next(p for p in parts if isinstance(p, Series))
    rows = [aligned(whole.like(part).c, whole.c)[0] for part in parts]
    shape = np.broadcast_shapes(*(row.shape for row in rows))
    return Series(np.stack([np.broadcast_to(row, shape) for row in rows], axis=1))


def cubic(t: Series, duration: Any, ends: Any, rates: Any) -> Series:
    """Third-degree polynomial on [0, duration] with given values and rates at both ends."""
    (a, b), (va, vb) = ends, rates
    c2 = (3.0 * (b - a) / duration - 2.0 * va - vb) / duration
    c3 = (2.0 * (a - b) / duration + va + vb) / duration**2
    return a + t * (va + t * (c2 + t * c3))
