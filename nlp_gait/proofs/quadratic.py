"""Forms of degree two over boxes, outward rounded, and what they say of the least power of a gait.

Beside ``affine.py``, where mixed products of what is unknown are errors, these keep them: a box may be several times as wide for
the same error. A fixed library interprets a function's instructions and bounds boxes (``native/quadratic.hpp``,
``native/relaxation.hpp``); ``quadratic_tape.py`` reads them.
"""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from functools import cache
from importlib.resources import files
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from nlp_gait.backends.kernel.compiler import find_compiler, lane_flags, native_lanes
from nlp_gait.backends.kernel.library_cache import load_library
from nlp_gait.backends.kernel.native_kernel import BASE_FLAGS
from nlp_gait.errors import InputError
from nlp_gait.formulation import Array
from nlp_gait.proofs.quadratic_tape import OUTPUT, Integers, tape_of

SYMBOLS = tuple(f"nlp_gait_quadratic_{name}" for name in ("size", "doubles", "forms", "contract", "assess"))
SOURCES = ("quadratic.hpp", "convex.hpp", "multipliers.hpp", "relaxation.hpp", "quadratic_calls.hpp")
MOST_SYMBOLS = 12
_INTEGER, _LONG, _DOUBLE, _POINTER = ctypes.c_int, ctypes.c_longlong, ctypes.c_double, ctypes.c_void_p
# Arrays of ``PowerRows``, in the order of native/relaxation.hpp.
INTEGERS = ("row", "power", "torque", "rate", "heat")
NUMBERS = ("lower", "upper", "weight", "loss", "ranges")


class _Tape(ctypes.Structure):
    _fields_ = [("steps", _POINTER), ("values", _POINTER), ("count", _LONG), ("slots", _INTEGER)]


class _Gait(ctypes.Structure):
    _fields_ = [
        *((name, _INTEGER) for name in ("n", "outputs", "rows", "terms", "heats", "time")),
        *((name, _POINTER) for name in (*INTEGERS, *NUMBERS)),
    ]


class QuadraticForms(NamedTuple):
    """Forms of M outputs over P boxes of n variables, symbols in [-1, 1].

    Attributes:
        middle: (P, M).
        slopes: (P, M, n).
        bends: (P, M, n (n + 1) / 2) coefficients of e_i e_j with i <= j, at j (j + 1) / 2 + i.
        error: (P, M); infinite where there is no form.
        lower: (P, M) of the range.
        upper: (P, M).
    """

    middle: Array
    slopes: Array
    bends: Array
    error: Array
    lower: Array
    upper: Array


@dataclass(frozen=True, kw_only=True, eq=False)
class PowerRows:
    """A least-power problem as outputs of a function.

    The cost is the sum of weight |torque rate| over the terms, divided by the duration, and of loss times heat, outputs that are
    never negative. Rows are outputs with bounds.

    Attributes:
        row: (R,) outputs that are limited.
        lower: (R,) their bounds.
        upper: (R,).
        power: (K,) outputs torque times rate.
        torque: (K,) outputs.
        rate: (K,) outputs, of unit time.
        weight: (K,) positive.
        heat: (L,) outputs.
        loss: (L,) positive.
        duration: input.
        ranges: (n,) widths of the inputs, by which boxes are measured.
    """

    row: Integers
    lower: Array
    upper: Array
    power: Integers
    torque: Integers
    rate: Integers
    weight: Array
    heat: Integers
    loss: Array
    duration: int
    ranges: Array


class Bounded(NamedTuple):
    """What is left of boxes.

    Attributes:
        boxes: (P, n, 2) without what holds nothing below the target.
        left: (P,) whether anything is.
        lowest: (P,) bound of the cost.
        cut: (P,) input to cut next.
    """

    boxes: Array
    left: np.ndarray[Any, np.dtype[np.bool_]]
    lowest: Array
    cut: Integers


class QuadraticFunction:
    """A CasADi function of a vector over boxes; safe to call from several threads at once.

    The smaller one of an expression and a number is taken as the expression: what comes out holds for those points of a box at
    which it is at most the number.
    """

    def __init__(self, function: ca.Function) -> None:
        """Read the instructions of a function from (n,) to (M,).

        Raises:
            InputError: an operation that cannot be enclosed, or too many inputs.
            CompilerError: there is no compiler, or it fails.
        """
        self._library = _library()
        self.inputs, self.outputs = function.numel_in(0), function.numel_out(0)
        if self.inputs > MOST_SYMBOLS:
            raise InputError(f"at most {MOST_SYMBOLS} inputs can be enclosed together, got {self.inputs}")
        self._steps, self._values = tape_of(function)
        places = self._steps[self._steps[:, 0] != OUTPUT, 1:4]
        slots = int(max(places.max(initial=0), self._steps[:, 2].max(initial=0))) + 1
        self._tape = _Tape(self._steps.ctypes.data, self._values.ctypes.data, len(self._steps), slots)
        self._memory = self._library.nlp_gait_quadratic_doubles(slots, self.inputs, self.outputs) + 8

    def __len__(self) -> int:
        """Number of operations."""
        return len(self._steps)

    def __call__(self, boxes: Array) -> QuadraticForms:
        """Forms over boxes (P, n, 2)."""
        boxes = self._checked(boxes)
        n = self.inputs
        size = self._library.nlp_gait_quadratic_size(n)
        result = np.empty((len(boxes), self.outputs, size))
        memory = np.empty(self._memory)
        self._library.nlp_gait_quadratic_forms(
            ctypes.byref(self._tape),
            n,
            self.outputs,
            len(boxes),
            *(array.ctypes.data for array in (boxes, result, memory)),
        )
        kept = next(m for m in range(n, MOST_SYMBOLS + 1) if 6 + m + m * (m + 1) // 2 == size)
        first, bends = result[..., 1 : 1 + n], result[..., 1 + kept : 1 + kept + n * (n + 1) // 2]
        error, lower, upper = (result[..., size - 5 + k] for k in range(3))
        return QuadraticForms(result[..., 0], first, bends, error, lower, upper)

    def contract(self, boxes: Array, lower: Array, upper: Array) -> tuple[Array, np.ndarray[Any, np.dtype[np.bool_]]]:
        """Boxes (P, n, 2) without slabs in which an output is beyond its bounds (M,), and (P,) whether anything is left."""
        boxes = self._checked(boxes).copy()
        left, memory = np.zeros(len(boxes), np.int32), np.empty(self._memory)
        low, high = (np.ascontiguousarray(bound, np.float64) for bound in (lower, upper))
        self._library.nlp_gait_quadratic_contract(
            ctypes.byref(self._tape),
            self.inputs,
            self.outputs,
            len(boxes),
            *(array.ctypes.data for array in (boxes, low, high, left, memory)),
        )
        return boxes, left.astype(bool)

    def assess(self, boxes: Array, target: float, problem: PowerRows) -> Bounded:
        """What is left of boxes (P, n, 2) when no cost of the target or more is of interest."""
        boxes = self._checked(boxes).copy()
        left, lowest, cut = np.zeros(len(boxes), np.int32), np.zeros(len(boxes)), np.zeros(len(boxes), np.int32)
        memory = np.empty(self._memory)
        given = {name: getattr(problem, name) for name in (*INTEGERS, *NUMBERS)}
        kept = {
            name: np.ascontiguousarray(values, np.int32 if name in INTEGERS else np.float64)
            for name, values in given.items()
        }
        gait = _Gait(
            n=self.inputs,
            outputs=self.outputs,
            rows=len(problem.row),
            terms=len(problem.power),
            heats=len(problem.heat),
            time=problem.duration,
            **{name: values.ctypes.data for name, values in kept.items()},
        )
        self._library.nlp_gait_quadratic_assess(
            ctypes.byref(self._tape),
            ctypes.byref(gait),
            target,
            len(boxes),
            *(array.ctypes.data for array in (boxes, left, lowest, cut, memory)),
        )
        return Bounded(boxes, left.astype(bool), lowest, cut)

    def _checked(self, boxes: Array) -> Array:
        boxes = np.require(boxes, dtype=np.float64, requirements=("C", "A"))
        if boxes.ndim != 3 or boxes.shape[1:] != (self.inputs, 2):
            raise InputError(f"boxes of {self.inputs} inputs expected, got {boxes.shape}")
        return boxes


@cache
def _library() -> ctypes.CDLL:
    native = files("nlp_gait.proofs") / "native"
    source = "\n".join((native / name).read_text(encoding="utf-8") for name in SOURCES)
    flags = (*BASE_FLAGS, *lane_flags(native_lanes()), "-O3", "-ffp-contract=fast")
    library, _ = load_library(source, find_compiler(), flags, SYMBOLS)
    library.nlp_gait_quadratic_size.argtypes = [_INTEGER]
    library.nlp_gait_quadratic_size.restype = _INTEGER
    library.nlp_gait_quadratic_doubles.argtypes = [_INTEGER, _INTEGER, _INTEGER]
    library.nlp_gait_quadratic_doubles.restype = _LONG
    library.nlp_gait_quadratic_forms.argtypes = [_POINTER, _INTEGER, _INTEGER, _LONG, *(_POINTER,) * 3]
    library.nlp_gait_quadratic_forms.restype = None
    library.nlp_gait_quadratic_contract.argtypes = [_POINTER, _INTEGER, _INTEGER, _LONG, *(_POINTER,) * 5]
    library.nlp_gait_quadratic_contract.restype = None
    library.nlp_gait_quadratic_assess.argtypes = [_POINTER, _POINTER, _DOUBLE, _LONG, *(_POINTER,) * 5]
    library.nlp_gait_quadratic_assess.restype = None
    return library
