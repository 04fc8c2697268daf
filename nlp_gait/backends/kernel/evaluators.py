"""Evaluators of a kernel: a compiled library, or CasADi's virtual machine where there is no compiler."""

from __future__ import annotations

import ctypes
import threading

import casadi as ca
import numpy as np

from nlp_gait.backends.kernel.compiler import BASE_FLAGS, Compiler, lane_flags
from nlp_gait.backends.kernel.kernel_source import SYMBOLS, Kernel, write_kernel_source
from nlp_gait.backends.kernel.library_cache import load_library
from nlp_gait.formulation import Array
from nlp_gait.formulation.locking import lock_casadi

SCALAR_FUNCTIONS = ("-DNO_VECTOR_LIBM",)
_INTEGER, _POINTER = ctypes.c_longlong, ctypes.c_void_p
# Candidates in one call of the virtual machine; more would only use more memory.
BLOCK = 64


class NativeKernel:
    """Evaluates a kernel in a compiled library; safe to call from several threads at once."""

    def __init__(self, kernel: Kernel, compiler: Compiler, lanes: int, *, scalar_functions: bool = False) -> None:
        """Build the library for 1, 2, 4 or 8 lanes, or load it from the cache; raises CompilerError.

        With ``scalar_functions``, sines and the like take one lane after the other, so that no bit depends on the lane count.
        """
        flags = (*BASE_FLAGS, *lane_flags(lanes), f"-DLANES={lanes}", *SCALAR_FUNCTIONS[: int(scalar_functions)])
        loaded, self.library = load_library(write_kernel_source(kernel.function), compiler, flags, SYMBOLS)
        self._evaluate = loaded.nlp_gait_evaluate
        self._evaluate.argtypes = [_POINTER, _INTEGER, *[_POINTER] * 8]
        loaded.nlp_gait_workspace_bytes.restype = _INTEGER
        self._workspace_bytes = int(loaded.nlp_gait_workspace_bytes())
        self._local = threading.local()
        self._weights = kernel.weights
        self.lanes = lanes
        self.description = f"compiled by {compiler.summary}, {lanes} candidates at a time"

    def __call__(
        self, X: Array, p: Array, lower: Array, upper: Array, f: Array, violation: Array, g: Array | None
    ) -> None:
        """Fill f, violation (P,) and, unless None, g (P, m) for X (P, n); all arrays contiguous, aligned doubles."""
        if not hasattr(self._local, "memory"):  # scratch memory of the calling thread
            self._local.memory = np.empty(-(-self._workspace_bytes // 8))
        failed = self._evaluate(
            get_address(X),
            len(X),
            get_address(p),
            get_address(lower),
            get_address(upper),
            get_address(self._weights),
            get_address(f),
            get_address(violation),
            None if g is None else get_address(g),
            get_address(self._local.memory),
        )
        if failed:
            raise RuntimeError("the compiled kernel reported a failure")


def get_address(array: Array) -> int:
    """Return the address of an array's first number."""
    address: int = array.__array_interface__["data"][0]
    return address


class InterpretedKernel:
    """Evaluates a kernel in CasADi's virtual machine, one thread at a time: many times slower, the same numbers."""

    def __init__(self, kernel: Kernel) -> None:
        n, k, m = kernel.function.size1_in(0), kernel.function.size1_in(1), kernel.function.size1_out(1)
        x, p = ca.MX.sym("x", n, BLOCK), ca.MX.sym("p", k)
        cost, g = kernel.function.map(BLOCK)(x, ca.repmat(p, 1, BLOCK))
        self._function = ca.Function("block", [x, p], [cost, g])
        self._weights = kernel.weights
        self._shape = n, m
        self.description = "interpreted by CasADi's virtual machine"

    @lock_casadi
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
            violations = np.maximum(np.maximum(lower - values, values - upper), 0.0)
            finite = np.isfinite(X[rows]).all(axis=1)
            f[rows] = np.where(finite, cost[:, 0], np.inf)
            violation[rows] = np.where(finite, violations @ self._weights, np.inf)
            if g is not None:
                g[rows] = values
