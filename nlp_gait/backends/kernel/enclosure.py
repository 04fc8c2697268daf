"""A problem's exact functions over boxes: intervals that hold every value, from the same graph that is searched and judged.

CasADi's generated code is compiled over a type of intervals that are rounded outward (``native/intervals.hpp``).
"""

from __future__ import annotations

import ctypes
import re

import casadi as ca
import numpy as np

from nlp_gait.backends.kernel.compiler import find_compiler
from nlp_gait.backends.kernel.kernel_source import assembled_source, kernel_of
from nlp_gait.backends.kernel.library_cache import load_library
from nlp_gait.backends.kernel.native_kernel import BASE_FLAGS
from nlp_gait.problem import Array, GaitProblem

SYMBOLS = ("nlp_gait_enclosure_bytes", "nlp_gait_enclose")
_INTEGER, _POINTER = ctypes.c_longlong, ctypes.c_void_p


class Enclosure:
    """Cost, rows and their derivatives over boxes.

    Attributes:
        problem: with the parameter values that are used.
        lower: (m,) bounds of the rows; the last n rows are the variables themselves.
        upper: likewise.
        scales: (m,) violation of a row that counts as 1.
    """

    def __init__(self, problem: GaitProblem) -> None:
        """Compile, or take the library from the cache.

        Raises:
            CompilerError: there is no compiler, or it fails.
        """
        kernel = kernel_of(problem)
        self.problem = problem
        self.lower, self.upper = kernel.row_bounds(problem)
        self.scales = kernel.model.row_scales
        source = _source(kernel.function)
        loaded, self.library = load_library(source, find_compiler(), BASE_FLAGS, SYMBOLS)
        self._enclose = loaded.nlp_gait_enclose
        self._enclose.argtypes = [ctypes.c_int, _POINTER, _INTEGER, _INTEGER, _INTEGER, *[_POINTER] * 4]
        loaded.nlp_gait_enclosure_bytes.restype = _INTEGER
        self._memory_doubles = -(-int(loaded.nlp_gait_enclosure_bytes()) // 8)
        self._p = np.array(problem.p, dtype=float)

    def values(self, boxes: Array) -> tuple[Array, Array]:
        """Enclosures of the values.

        Args:
            boxes: (P, n, 2) lower and upper ends.

        Returns:
            (P, 2) of the cost, which is to be minimised, and (P, m, 2) of the rows.
        """
        cost, rows = self._call(0, boxes, 1, len(self.lower))
        return cost[:, 0], rows

    def gradient(self, boxes: Array) -> Array:
        """Enclosures (P, n, 2) of the cost's derivatives over boxes (P, n, 2)."""
        return self._call(1, boxes, boxes.shape[1], 0)[0]

    def jacobian(self, boxes: Array) -> Array:
        """Enclosures (P, m, n, 2) of the rows' derivatives over boxes (P, n, 2)."""
        count, n = boxes.shape[:2]
        by_column = self._call(2, boxes, n * len(self.lower), 0)[0]
        return by_column.reshape(count, n, len(self.lower), 2).transpose(0, 2, 1, 3)

    def _call(self, which: int, boxes: Array, first: int, second: int) -> tuple[Array, Array]:
        """Outputs (P, first, 2) and (P, second, 2) of one of the compiled functions."""
        boxes = np.require(boxes, dtype=np.float64, requirements=("C", "A"))
        outputs = np.empty((len(boxes), first, 2)), np.empty((len(boxes), second, 2))
        memory = np.empty(self._memory_doubles)  # of this call alone: several threads may call
        pointers = (array.ctypes.data for array in (self._p, *outputs, memory))
        if self._enclose(which, boxes.ctypes.data, len(boxes), first, second, *pointers):
            raise RuntimeError("the compiled enclosure reported a failure")
        return outputs


def _source(kernel: ca.Function) -> str:
    """C++ source of the kernel (x, p) to cost and g, and of its derivatives, over intervals."""
    x, p = kernel.mx_in()
    cost, g = kernel.call([x, p], True, False)
    generator = ca.CodeGenerator("enclosure", {"casadi_real": "Interval"})
    for name, outputs in (
        ("values", [cost, g]),
        ("gradient", [ca.jacobian(cost, x)]),
        ("jacobian", [ca.jacobian(g, x)]),
    ):
        generator.add(ca.Function(name, [x, p], [ca.densify(output) for output in outputs]))
    generated = generator.dump()
    # A square is not the product of two independent intervals, and a sign is no branch.
    for helper, name in (("sq", "squared"), ("sign", "sign")):
        generated = re.sub(rf"\bcasadi_real casadi_{helper}\(.*", "", generated)
        generated = re.sub(rf"\bcasadi_{helper}\(", f"{name}(", generated)
    sizes = {"VARIABLES": x.shape[0], "PARAMETERS": p.shape[0]}
    return assembled_source("intervals.hpp", generated, sizes, "enclosures.hpp")
