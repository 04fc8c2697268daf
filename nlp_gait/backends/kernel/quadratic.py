"""Forms of degree two over boxes, outward rounded, and what they say of the least power of a gait.

Beside ``affine.py``, where mixed products of what is unknown are errors, these keep them: a box may be several times as wide for
the same error. A fixed library interprets a function's instructions and bounds boxes (``native/quadratic.hpp``,
``native/relaxation.hpp``).
"""

from __future__ import annotations

import ctypes
from dataclasses import dataclass
from fractions import Fraction
from functools import cache
from importlib.resources import files
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from nlp_gait.backends.kernel.compiler import find_compiler, lane_flags, native_lanes
from nlp_gait.backends.kernel.library_cache import load_library
from nlp_gait.backends.kernel.native_kernel import BASE_FLAGS
from nlp_gait.errors import InputError
from nlp_gait.problem import Array

SYMBOLS = tuple(f"nlp_gait_quadratic_{name}" for name in ("size", "doubles", "forms", "contract", "assess"))
SOURCES = ("quadratic.hpp", "relaxation.hpp")
MOST_SYMBOLS = 12
# Operations of a tape, as in native/quadratic.hpp.
INPUT, NUMBER, OUTPUT, SUM, DIFFERENCE, SHIFT, SCALE, PRODUCT, INVERSE, ROOT, ABSOLUTE, LARGER, BELOW, WHERE_BELOW = (
    range(14)
)
_INTEGER, _LONG, _DOUBLE, _POINTER = ctypes.c_int, ctypes.c_longlong, ctypes.c_double, ctypes.c_void_p
Integers = np.ndarray[Any, np.dtype[np.int32]]


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
        self._steps, self._values = _tape(function)
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
    native = files("nlp_gait.backends.kernel") / "native"
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


@dataclass(frozen=True, slots=True)
class _Node:
    """A quantity: an operation on earlier ones, told apart by what they are."""

    code: int
    first: int = -1
    second: int = -1
    value: float = 0.0


class _Graph:
    """Quantities of a function, each once; numbers and conditions are kept apart."""

    def __init__(self, function: ca.Function) -> None:
        self._name = function.name()
        self.nodes: list[_Node] = []
        self.symbols: list[int] = []  # each depends on so many first ones
        self._numbers: dict[_Node, int] = {}

    def add(self, code: int, first: int = -1, second: int = -1, value: float = 0.0) -> int:
        """Number of a quantity, which may be there already."""
        node = _Node(code, first, second, value)
        if node not in self._numbers:
            self._numbers[node] = len(self.nodes)
            self.nodes.append(node)
            used = max(self.symbols[k] if k >= 0 else 0 for k in (first, second))
            self.symbols.append(int(value) + 1 if code == INPUT else used)
        return self._numbers[node]

    def unary(self, operation: int, x: int) -> int:
        """Of a quantity alone."""
        codes = {ca.OP_SQRT: ROOT, ca.OP_INV: INVERSE, ca.OP_FABS: ABSOLUTE}
        factors = {ca.OP_NEG: -1.0, ca.OP_TWICE: 2.0}
        if operation == ca.OP_SQ:
            return self.add(PRODUCT, x, x)
        if operation in factors:
            return self.add(SCALE, x, value=factors[operation])
        if operation not in codes:
            raise self._refusal(operation)
        return self.add(codes[operation], x)

    def binary(self, operation: int, x: int, y: int) -> int:
        """Of two quantities."""
        if operation == ca.OP_DIV:
            return self.add(PRODUCT, x, self.add(INVERSE, y))
        if operation in (ca.OP_ADD, ca.OP_MUL):
            return self.add(SUM if operation == ca.OP_ADD else PRODUCT, min(x, y), max(x, y))
        if operation != ca.OP_SUB:
            raise self._refusal(operation)
        return self.add(DIFFERENCE, x, y)

    def with_number(self, operation: int, x: int, number: float, number_first: bool) -> int:
        """Of a quantity and a number."""
        if operation == ca.OP_ADD:
            return self.add(SHIFT, x, value=number)
        if operation == ca.OP_SUB:
            if number_first:
                return self.add(SHIFT, self.add(SCALE, x, value=-1.0), value=number)
            return self.add(SHIFT, x, value=-number)
        if operation == ca.OP_MUL:
            return self.add(SCALE, x, value=number)
        if operation == ca.OP_DIV:  # a rounded reciprocal errs by less than a scaled form is widened
            if number_first:
                return self.add(SCALE, self.add(INVERSE, x), value=number)
            return self.add(SCALE, x, value=1.0 / number)
        if operation in (ca.OP_FMIN, ca.OP_FMAX):
            return self.add(BELOW if operation == ca.OP_FMIN else LARGER, x, value=number)
        raise self._refusal(operation)

    def numbers(self, operation: int, a: float, b: float) -> float:
        """Of two numbers, where that is a number too."""
        exact = {
            ca.OP_ADD: lambda: Fraction(a) + Fraction(b),
            ca.OP_SUB: lambda: Fraction(a) - Fraction(b),
            ca.OP_MUL: lambda: Fraction(a) * Fraction(b),
            ca.OP_DIV: lambda: Fraction(a) / Fraction(b),
        }
        value = exact[operation]() if operation in exact else None
        if value is None or Fraction(float(value)) != value:
            raise InputError(f"function {self._name!r} works with the numbers {a} and {b} alone; simplify it first")
        return float(value)

    def _refusal(self, operation: int) -> InputError:
        return InputError(f"function {self._name!r}: CasADi's operation number {operation} has no quadratic form here")


class _Condition(NamedTuple):
    """Whether a quantity is below a number."""

    quantity: int
    number: float


def _tape(function: ca.Function) -> tuple[Integers, Array]:
    """Steps (count, 5) of operation, result, arguments and symbols, and values (count,)."""
    function = function if function.is_a("SXFunction") else function.expand()
    graph, outputs = _Graph(function), dict[int, int]()
    places: dict[
        int, int | float | _Condition
    ] = {}  # what stands there now: a quantity by its number, a number, a condition
    for k in range(function.n_instructions()):
        operation, out, arguments = (
            function.instruction_id(k),
            function.instruction_output(k),
            function.instruction_input(k),
        )
        if operation == ca.OP_OUTPUT:
            found = places[arguments[0]]
            assert not isinstance(found, _Condition)  # conditions are outputs of no problem; for the type checker
            outputs[out[1]] = graph.add(NUMBER, value=found) if isinstance(found, float) else found
        elif operation == ca.OP_CONST:
            places[out[0]] = float(function.instruction_constant(k))
        elif operation == ca.OP_INPUT:
            places[out[0]] = graph.add(INPUT, value=float(arguments[1]))
        else:
            places[out[0]] = _found(graph, operation, [places[place] for place in arguments])
    return _laid_out(graph, [outputs[k] for k in range(len(outputs))])


def _found(graph: _Graph, operation: int, given: list[int | float | _Condition]) -> int | float | _Condition:
    """What an operation gives."""
    x, y = given[0], given[-1]
    if isinstance(x, _Condition) and operation == ca.OP_IF_ELSE_ZERO and isinstance(y, int):
        return graph.add(WHERE_BELOW, x.quantity, y, x.number)
    if isinstance(x, _Condition) or isinstance(y, _Condition):
        raise InputError("a condition can only choose between a form and zero")
    if len(given) == 1 and isinstance(x, int):
        return graph.unary(operation, x)
    if isinstance(x, float) and isinstance(y, float):
        return graph.numbers(operation, x, y)
    if isinstance(x, int) and isinstance(y, int):
        return graph.binary(operation, x, y)
    if operation == ca.OP_LE:
        return 1.0 if isinstance(x, int) else 0.0  # only such points are of interest: see the class
    if operation == ca.OP_LT and isinstance(x, int):
        return _Condition(x, float(y))
    if isinstance(x, int):
        return graph.with_number(operation, x, float(y), False)
    return graph.with_number(operation, int(y), float(x), True)


def _laid_out(graph: _Graph, outputs: list[int]) -> tuple[Integers, Array]:
    """The graph as a tape: in its order, outputs as soon as they are known, places free again after their last use."""
    nodes, wanted = graph.nodes, dict[int, list[int]]()
    for number, quantity in enumerate(outputs):
        wanted.setdefault(quantity, []).append(number)
    last, needed = dict[int, int](), set(outputs)
    for k in range(len(nodes) - 1, -1, -1):
        if k in needed:
            used = {j for j in (nodes[k].first, nodes[k].second) if j >= 0}
            needed |= used
            for j in used:
                last.setdefault(j, k)
    steps, values = list[tuple[int, int, int, int, int]](), list[float]()
    place, free, count = dict[int, int](), list[int](), 0
    for k, node in enumerate(nodes):
        if k not in needed:
            continue
        first, second = (place[j] if j >= 0 else -1 for j in (node.first, node.second))
        for j in {node.first, node.second} - {-1}:
            if last[j] == k:
                free.append(place[j])
        if not free:
            free.append(count)
            count += 1
        place[k] = free.pop()
        steps.append((node.code, place[k], first, second, graph.symbols[k]))
        values.append(node.value)
        for number in wanted.get(k, ()):
            steps.append((OUTPUT, number, place[k], -1, 0))
            values.append(0.0)
        if k not in last:
            free.append(place[k])
    return np.array(steps, dtype=np.int32).reshape(-1, 5), np.array(values)
