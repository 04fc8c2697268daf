"""A kernel evaluated by CasADi's virtual machine: no compiler needed, many times slower, the same numbers."""

from __future__ import annotations

import numpy as np

from nlp_gait.backends.kernel_source import Kernel
from nlp_gait.problems.gait_problem import Array


class InterpretedKernel:
    """Evaluates a kernel candidate by candidate.

    Attributes:
        description: for people.
    """

    def __init__(self, kernel: Kernel) -> None:
        """Take the kernel as it is."""
        self._function = kernel.function
        self._weights = kernel.weights
        self.description = "interpreted by CasADi's virtual machine"

    def __call__(self, X: Array, p: Array, lower: Array, upper: Array, f: Array, violation: Array, g: Array | None) -> None:
        """Fill f, violation (P,) and, unless None, g (P, m) for X (P, n)."""
        for i, x in enumerate(X):
            cost, rows = self._function(x, p)
            values = np.array(rows).ravel()
            # Plain maximum, not fmax: a NaN must not pass for feasible.
            excess = np.maximum(np.maximum(lower - values, values - upper), 0.0)
            finite = np.isfinite(x).all()
            f[i] = float(cost) if finite else np.inf
            violation[i] = excess @ self._weights if finite else np.inf
            if g is not None:
                g[i] = values
