"""Functions over boxes as forms of degree two, rounded outward, and bounds of a least-power problem from them.

In ``affine.py`` products of slopes are errors; these forms keep them, so that a box may be several times as wide for the same
error. A C++ library interprets a function's instructions (``native/quadratic.hpp``; ``quadratic_tape.py`` writes them) and prunes
boxes (``native/relaxation.hpp``).
"""

from __future__ import annotations

import ctypes
from functools import cache
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array
from nlp_gait.proofs.affine import DOUBLE, INT, LONG, POINTER, Flags, Remaining, load_native
from nlp_gait.proofs.quadratic_tape import OUTPUT, PowerRows, make_tape

QUADRATIC_SOURCES = ("quadratic.hpp", "convex.hpp", "multipliers.hpp", "relaxation.hpp", "quadratic_calls.hpp")
MOST_SYMBOLS = 12


class _Tape(ctypes.Structure):
    _fields_ = [("steps", POINTER), ("values", POINTER), ("count", LONG), ("slots", INT)]


class _PowerRows(ctypes.Structure):
    """As in native/relaxation.hpp: integers, arrays of integers, and arrays of numbers."""

    _fields_ = [
        *((name, INT) for name in ("n", "outputs", "rows", "terms", "heats", "duration")),
        *((name, POINTER) for name in ("row", "power", "torque", "rate", "heat")),
        *((name, POINTER) for name in ("lower", "upper", "weight", "loss", "ranges")),
    ]


class QuadraticForms(NamedTuple):
    """Forms of M outputs over P boxes of n variables, symbols in [-1, 1]."""

    middle: Array  # (P, M)
    slopes: Array  # (P, M, n)
    bends: Array  # (P, M, n (n + 1) / 2) coefficients of e_i e_j with i <= j, at j (j + 1) / 2 + i
    error: Array  # (P, M); infinite where there is no form
    lower: Array  # (P, M) of the range
    upper: Array  # (P, M)


class QuadraticFunction:
    """CasADi function of a vector over boxes; calls are thread-safe.

    The minimum of an expression and a number is taken as the expression: the result is valid for those points of a box at which
    the expression is at most the number.
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
        self._steps, self._values = make_tape(function)
        places = self._steps[self._steps[:, 0] != OUTPUT, 1:4]
        slots = int(max(places.max(initial=0), self._steps[:, 2].max(initial=0))) + 1
        self._tape = _Tape(self._steps.ctypes.data, self._values.ctypes.data, len(self._steps), slots)
        self._memory = self._library.nlp_gait_quadratic_doubles(slots, self.inputs, self.outputs) + 8

    def __call__(self, boxes: Array) -> QuadraticForms:
        """Return the forms of all outputs over boxes (P, n, 2)."""
        boxes, n = self._check(boxes), self.inputs
        size = self._library.nlp_gait_quadratic_size(n)
        result = np.empty((len(boxes), self.outputs, size))
        self._run("forms", n, self.outputs, len(boxes), boxes, result)
        kept = next(m for m in range(n, MOST_SYMBOLS + 1) if 6 + m + m * (m + 1) // 2 == size)
        slopes, bends = result[..., 1 : 1 + n], result[..., 1 + kept : 1 + kept + n * (n + 1) // 2]
        error, lower, upper = (result[..., size - 5 + k] for k in range(3))
        return QuadraticForms(result[..., 0], slopes, bends, error, lower, upper)

    def contract(self, boxes: Array, lower: Array, upper: Array) -> tuple[Array, Flags]:
        """Cut off slabs of boxes (P, n, 2) in which an output violates its bounds (M,).

        Returns:
            The boxes, and (P,) whether anything is left of each.
        """
        boxes, left = self._check(boxes).copy(), np.zeros(len(boxes), np.int32)
        low, high = (np.ascontiguousarray(bound, np.float64) for bound in (lower, upper))
        self._run("contract", self.inputs, self.outputs, len(boxes), boxes, low, high, left)
        return boxes, left.astype(bool)

    def prune(self, boxes: Array, target: float, rows: PowerRows) -> Remaining:
        """Remove from boxes (P, n, 2) all that has no feasible point below the target."""
        boxes = self._check(boxes).copy()
        left, lowest, cut = np.zeros(len(boxes), np.int32), np.zeros(len(boxes)), np.zeros(len(boxes), np.int32)
        (row, lower, upper), (power, torque, rate, weight), (heat, loss) = rows.limits.T, rows.terms.T, rows.heats.T
        arrays = [np.ascontiguousarray(values, np.int32) for values in (row, power, torque, rate, heat)]
        arrays += [np.ascontiguousarray(values, np.float64) for values in (lower, upper, weight, loss, rows.ranges)]
        sizes = self.inputs, self.outputs, len(row), len(power), len(heat), rows.duration
        structure = _PowerRows(*sizes, *(values.ctypes.data for values in arrays))
        self._run("prune", ctypes.byref(structure), target, len(boxes), boxes, left, lowest, cut)
        origin = np.flatnonzero(left)
        return Remaining(boxes[origin], lowest[origin], cut[origin].astype(np.intp), origin)

    def _run(self, name: str, *arguments: Any) -> None:
        memory = np.empty(self._memory)
        plain = [a.ctypes.data if isinstance(a, np.ndarray) else a for a in (*arguments, memory)]
        getattr(self._library, f"nlp_gait_quadratic_{name}")(ctypes.byref(self._tape), *plain)

    def _check(self, boxes: Array) -> Array:
        boxes = np.require(boxes, dtype=np.float64, requirements=("C", "A"))
        if boxes.ndim != 3 or boxes.shape[1:] != (self.inputs, 2):
            raise InputError(f"boxes of {self.inputs} inputs expected, got {boxes.shape}")
        return boxes


@cache
def _library() -> ctypes.CDLL:
    functions = {
        "quadratic_size": (INT, (INT,)),
        "quadratic_doubles": (LONG, (INT, INT, INT)),
        "quadratic_forms": (None, (POINTER, INT, INT, LONG, *(POINTER,) * 3)),
        "quadratic_contract": (None, (POINTER, INT, INT, LONG, *(POINTER,) * 5)),
        "quadratic_prune": (None, (POINTER, POINTER, DOUBLE, LONG, *(POINTER,) * 5)),
    }
    return load_native(QUADRATIC_SOURCES, functions, "-O3", "-ffp-contract=fast")
