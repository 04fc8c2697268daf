"""A kernel evaluated by CasADi's virtual machine: no compiler needed, many times slower, the same numbers."""

from __future__ import annotations

import casadi as ca
import numpy as np

from nlp_gait.backends.kernel.kernel_source import Kernel
from nlp_gait.formulation import Array
from nlp_gait.formulation.locking import one_at_a_time

# Candidates in one call of the virtual machine; more would only use more memory.
BLOCK = 64


class InterpretedKernel:
    """Evaluates a kernel in blocks of candidates, one thread at a time.

    Attributes:
        description: in words.
    """

    def __init__(self, kernel: Kernel) -> None:
        """Take the kernel as it is."""
        n, k, m = kernel.function.size1_in(0), kernel.function.size1_in(1), kernel.function.size1_out(1)
        x, p = ca.MX.sym("x", n, BLOCK), ca.MX.sym("p", k)
        cost, g = kernel.function.map(BLOCK)(x, ca.repmat(p, 1, BLOCK))
        self._function = ca.Function("block", [x, p], [cost, g])
        self._weights = kernel.weights
        self._shape = n, m
        self.description = "interpreted by CasADi's virtual machine"

    @one_at_a_time
    def __call__(
        self, X: Array, p: Array, lower: Array, upper: Array, f: Array, violation: Array, g: Array | None
    ) -> None:
        """Fill f, violation (P,) and, unless None, g (P, m) for X (P, n)."""
        block = np.zeros((self._shape[0], BLOCK))
        for first in range(0, len(X), BLOCK):
            rows = slice(first, min(first + BLOCK, len(X)))
            count = rows.stop - rows.start
            block[:, :count] = X[rows].T
            cost, values = (np.array(output)[:, :count].T for output in self._function(block, p))
            # Plain maximum, not fmax: a NaN must not pass for feasible.
            excess = np.maximum(np.maximum(lower - values, values - upper), 0.0)
            finite = np.isfinite(X[rows]).all(axis=1)
            f[rows] = np.where(finite, cost[:, 0], np.inf)
            violation[rows] = np.where(finite, excess @ self._weights, np.inf)
            if g is not None:
                g[rows] = values
