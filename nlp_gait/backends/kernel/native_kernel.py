"""A kernel as a compiled library."""

from __future__ import annotations

import ctypes
import threading

import numpy as np

from nlp_gait.backends.kernel.compiler import Compiler, lane_flags
from nlp_gait.backends.kernel.kernel_source import SYMBOLS, Kernel, write_kernel_source
from nlp_gait.backends.kernel.library_cache import load_library
from nlp_gait.formulation import Array

# No -ffast-math: NaN and infinity keep their meaning. No contraction to fused multiply-add, which gains nothing here: so
# results are the virtual machine's bit for bit, but for what vector functions of libm round differently. Hidden symbols let
# the compiler inline CasADi's helpers.
BASE_FLAGS = ("-std=c++17", "-O2", "-fvisibility=hidden", "-ffp-contract=off", "-fno-math-errno", "-w")
SCALAR_FUNCTIONS = ("-DNO_VECTOR_LIBM",)
_INTEGER, _POINTER = ctypes.c_longlong, ctypes.c_void_p


class NativeKernel:
    """Evaluates a kernel in a compiled library; safe to call from several threads at once.

    Attributes:
        lanes: candidates that one instruction works on.
        description: compiler and lane count, in words.
        library: file of the library.
    """

    def __init__(self, kernel: Kernel, compiler: Compiler, lanes: int, *, scalar_functions: bool = False) -> None:
        """Build the library, or load it from the cache.

        Args:
            kernel: what is compiled.
            compiler: that builds it.
            lanes: 1, 2, 4 or 8.
            scalar_functions: sines and the like one lane after the other: then no bit depends on the lane count.

        Raises:
            CompilerError: the compiler fails.
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
        memory = self._memory()
        failed = self._evaluate(
            _address(X),
            len(X),
            _address(p),
            _address(lower),
            _address(upper),
            _address(self._weights),
            _address(f),
            _address(violation),
            None if g is None else _address(g),
            _address(memory),
        )
        if failed:
            raise RuntimeError("the compiled kernel reported a failure")

    def _memory(self) -> Array:
        """Scratch memory of the calling thread."""
        if not hasattr(self._local, "memory"):
            self._local.memory = np.empty(-(-self._workspace_bytes // 8))
        memory: Array = self._local.memory
        return memory


def _address(array: Array) -> int:
    address: int = array.__array_interface__["data"][0]
    return address
