"""A problem's exact functions over boxes: intervals that hold every value, from the same graph that is searched and judged.

CasADi's generated code is compiled over a type of intervals that are rounded outward (``native/intervals.hpp``).
"""

from __future__ import annotations

import ctypes
import re
from importlib.resources import files

import casadi as ca
import numpy as np

from nlp_gait.backends.compiler import find_compiler
from nlp_gait.backends.kernel_source import kernel_of
from nlp_gait.backends.library_cache import load_library
from nlp_gait.problems.gait_problem import Array, GaitProblem

SYMBOLS = ("nlp_gait_enclosure_bytes", "nlp_gait_enclose")
FLAGS = ("-std=c++17", "-O2", "-fvisibility=hidden", "-ffp-contract=off", "-fno-math-errno", "-w")
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
        self.lower, self.upper = (np.array(bound, dtype=float).ravel() for bound in kernel.bounds(problem.p))
        self.scales = kernel.model.row_scales
        source = _source(kernel.function)
        loaded, self.library = load_library(source, find_compiler(), FLAGS, SYMBOLS)
        self._enclose = loaded.nlp_gait_enclose
        self._enclose.argtypes = [_POINTER, _INTEGER, _POINTER, _POINTER, _POINTER, ctypes.c_int, _POINTER]
        loaded.nlp_gait_enclosure_bytes.restype = _INTEGER
        self._memory = np.empty(-(-int(loaded.nlp_gait_enclosure_bytes()) // 8))
        self._p = np.array(problem.p, dtype=float)

    def values(self, boxes: Array) -> tuple[Array, Array]:
        """Enclosures of the values.

        Args:
            boxes: (P, n, 2) lower and upper ends.

        Returns:
            (P, 2) of the cost, which is to be minimised, and (P, m, 2) of the rows.
        """
        cost, rows = self._call(boxes, slopes=False)
        return cost[:, 0], rows

    def slopes(self, boxes: Array) -> tuple[Array, Array]:
        """Enclosures of the derivatives: (P, n, 2) of the cost and (P, m, n, 2) of the rows."""
        gradient, jacobian = self._call(boxes, slopes=True)
        count, n = boxes.shape[:2]
        return gradient, jacobian.reshape(count, n, len(self.lower), 2).transpose(0, 2, 1, 3)

    def _call(self, boxes: Array, slopes: bool) -> tuple[Array, Array]:
        boxes = np.require(boxes, dtype=np.float64, requirements=("C", "A"))
        ones = boxes.shape[1] if slopes else 1
        first, second = np.empty((len(boxes), ones, 2)), np.empty((len(boxes), ones * len(self.lower), 2))
        pointers = (array.ctypes.data for array in (self._p, first, second))
        if self._enclose(boxes.ctypes.data, len(boxes), *pointers, int(slopes), self._memory.ctypes.data):
            raise RuntimeError("the compiled enclosure reported a failure")
        return first, second


def _source(kernel: ca.Function) -> str:
    """C++ source of the kernel (x, p) to cost and g, and of its derivatives, over intervals."""
    x, p = kernel.mx_in()
    cost, g = kernel.call([x, p], True, False)
    slopes = [ca.densify(ca.jacobian(value, x)) for value in (cost, g)]
    generator = ca.CodeGenerator("enclosure", {"casadi_real": "Interval"})
    generator.add(ca.Function("range", [x, p], [ca.densify(cost), ca.densify(g)]))
    generator.add(ca.Function("slope", [x, p], slopes))
    generated = re.sub(r"\((\w+)\?(\w+):0\)", r"if_else_zero(\1,\2)", generator.dump())
    # A square is not the product of two independent intervals.
    generated = re.sub(r"\bcasadi_real casadi_sq\(.*", "", generated)
    generated = re.sub(r"\bcasadi_sq\(", "squared(", generated)
    native = files("nlp_gait.backends") / "native"
    sizes = {"VARIABLES": x.shape[0], "PARAMETERS": p.shape[0], "ROWS": g.shape[0]}
    return "\n".join(
        [
            "#include <initializer_list>",
            (native / "intervals.hpp").read_text(encoding="utf-8"),
            "#define __STDC_VERSION__ 199901L  // so that the generated code calls fmin, fmax and fabs of intervals.hpp",
            generated,
            *(f"#define {name} {size}" for name, size in sizes.items()),
            (native / "enclosures.hpp").read_text(encoding="utf-8"),
        ]
    )
