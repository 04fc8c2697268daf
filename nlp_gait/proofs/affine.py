"""Functions over boxes in affine arithmetic, rounded outward, by a C++ interpreter of their instructions.

A value over a box is an affine form (the sum of a middle, a slope along every edge and an error) and a range; both enclose it.
Slopes keep what values have in common, so that bounds are far narrower than those of intervals (``native/affine.hpp``).

Source:
    Stolfi, de Figueiredo (1997), Self-Validated Numerical Methods and Applications, chapter 3. Rounding errors are added to the
    error explicitly, with the bounds of Rump (2010), Verification methods, section 2, and four units for functions of libm.
"""

from __future__ import annotations

import ctypes
from collections.abc import Collection, Mapping, Sequence
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from nlp_gait.backends.kernel.compiler import BASE_FLAGS, find_compiler, lane_flags, load_library, native_lanes
from nlp_gait.errors import InputError
from nlp_gait.formulation import Array
from nlp_gait.symbolic.tape import read_tape

INT, LONG, DOUBLE, POINTER = ctypes.c_int, ctypes.c_longlong, ctypes.c_double, ctypes.c_void_p

# Operations with an enclosure; their numbers are those of CasADi, all below 46.
_UNARY = "ASSIGN NEG EXP LOG SQRT SQ TWICE SIN COS TAN ASIN ACOS ATAN NOT FLOOR CEIL FABS SIGN INV SINH COSH TANH"
_BINARY = "ADD SUB MUL DIV POW CONSTPOW LT LE EQ NE AND OR FMOD COPYSIGN IF_ELSE_ZERO FMIN FMAX ATAN2"
UNARY, BINARY = (tuple(getattr(ca, f"OP_{name}") for name in names.split()) for names in (_UNARY, _BINARY))
HALF_OPEN_LE, HALF_OPEN_LT = 200, 201
NATIVE = Path(str(files("nlp_gait.proofs") / "native"))
AFFINE_SOURCES = ("intervals.hpp", "affine.hpp")


class AffineForms(NamedTuple):
    """Affine forms of M outputs over P boxes, along n symbols in [-1, 1]."""

    middle: Array  # (P, M)
    slopes: Array  # (P, M, n)
    error: Array  # (P, M); infinite where there is no form
    lower: Array  # (P, M) of the range
    upper: Array  # (P, M)


class AffineFunction:
    """CasADi function over boxes; calls are thread-safe."""

    def __init__(self, function: ca.Function, half_open: Collection[int] = ()) -> None:
        """Read the function's instructions.

        Args:
            function: with dense arguments and results; a function of MX expressions is expanded.
            half_open: scalar inputs whose boxes exclude their upper ends. Where a formula changes at such an end (a spline's
                knot), a box has one formula on either side.

        Raises:
            InputError: an operation that cannot be enclosed.
            CompilerError: there is no compiler, or it fails.
        """
        self._library = _library()
        scalar = function if function.is_a("SXFunction") else function.expand()
        self.inputs, self.outputs = scalar.numel_in(), scalar.numel_out()  # scalar ones, over all arguments and results
        self._code, self._constants = _encode(scalar, half_open)
        self._slots = max(int(self._code[:, 1:].max(initial=0)), scalar.sz_w()) + 1

    def __call__(self, boxes: Array, symbols: Array) -> AffineForms:
        """Return the forms of all outputs over boxes.

        Args:
            boxes: (P, inputs, 2) lower and upper ends.
            symbols: (inputs,) number of the symbol along which an input varies; -1 for none, which makes its width an error.
                Two inputs with one symbol vary together, each from its lower to its upper end.
        """
        boxes = np.require(boxes, dtype=np.float64, requirements=("C", "A"))
        symbols = np.require(symbols, dtype=np.int32, requirements=("C", "A"))
        if boxes.shape[1:] != (self.inputs, 2) or symbols.shape != (self.inputs,):
            raise InputError(
                f"boxes and symbols of {self.inputs} inputs expected, got {boxes.shape} and {symbols.shape}"
            )
        n = int(symbols.max(initial=-1)) + 1
        result = np.empty((len(boxes), self.outputs, n + 4))
        memory = np.empty(self._library.nlp_gait_affine_doubles(self._slots, n))
        code, constants, given, used, out, work = (
            array.ctypes.data for array in (self._code, self._constants, boxes, symbols, result, memory)
        )
        self._library.nlp_gait_affine(
            *(code, constants, len(self._code), n, self.inputs, used, len(boxes), given, self.outputs, out, work)
        )
        return AffineForms(
            result[..., 0], result[..., 1 : 1 + n], result[..., 1 + n], result[..., 2 + n], result[..., 3 + n]
        )


def load_native(sources: Sequence[str], functions: Mapping[str, tuple[Any, Sequence[Any]]], *flags: str) -> ctypes.CDLL:
    """Compile files of ``native/`` to one library, or load it from the cache; raises CompilerError.

    Functions are given by their names without prefix, with the types of the result and of the arguments.
    """
    text = "\n".join((NATIVE / name).read_text(encoding="utf-8") for name in sources)
    names = [f"nlp_gait_{name}" for name in functions]
    library, _ = load_library(text, find_compiler(), (*BASE_FLAGS, *lane_flags(native_lanes()), *flags), names)
    for name, (result, arguments) in zip(names, functions.values(), strict=True):
        function = getattr(library, name)
        function.restype, function.argtypes = result, arguments
    return library


@cache
def _library() -> ctypes.CDLL:
    arguments = (POINTER, POINTER, LONG, INT, INT, POINTER, LONG, POINTER, INT, POINTER, POINTER)
    return load_native(AFFINE_SOURCES, {"affine": (None, arguments), "affine_doubles": (LONG, (INT, INT))})


def _encode(function: ca.Function, half_open: Collection[int]) -> tuple[Any, Array]:
    """Return the instructions (count, 4), as operation, result and arguments, and the constants (count,)."""
    tape = list(read_tape(function))
    code = np.full((len(tape), 4), -1, dtype=np.int32)
    inputs_below = {k for k, node in enumerate(tape) if node.operation == ca.OP_INPUT and node.place in half_open}
    for k, node in enumerate(tape):
        operation, places = node.operation, [tape[j].register for j in node.arguments]
        if operation == ca.OP_OUTPUT:
            code[k, :3] = operation, node.place, places[0]
            continue
        if operation == ca.OP_INPUT:
            places = [node.place]
        elif operation in BINARY:
            if operation == ca.OP_LE and node.arguments[1] in inputs_below:
                operation = HALF_OPEN_LE
            elif operation == ca.OP_LT and node.arguments[0] in inputs_below:
                operation = HALF_OPEN_LT
        elif operation not in (*UNARY, ca.OP_CONST):
            raise InputError(f"function {function.name()!r}: CasADi's operation number {operation} cannot be enclosed")
        code[k, : 2 + len(places)] = operation, node.register, *places
    return code, np.array([node.constant for node in tape])


Numbers = np.ndarray[Any, np.dtype[np.intp]]
Flags = np.ndarray[Any, np.dtype[np.bool_]]


class Remaining(NamedTuple):
    """Boxes in which a feasible point below a target cost may lie."""

    boxes: Array  # (P, n, 2) without the slabs in which there is none
    lowest: Array  # (P,) lower bound of the cost of the feasible points in the box
    cut: Numbers  # (P,) variable to cut next
    origin: Numbers  # (P,) indices of the boxes that were pruned to these
