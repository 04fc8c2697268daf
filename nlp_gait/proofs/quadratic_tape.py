"""Least power in other variables, whose formulas have narrow bounds, and tapes of CasADi functions on few places in memory."""

from __future__ import annotations

import operator
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from fractions import Fraction
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array
from nlp_gait.symbolic.tape import read_tape

Integers = np.ndarray[Any, np.dtype[np.int32]]

# Largest relative difference of the form and the exact functions, both in double precision; every bound is widened by the second
# number to make up for it.
AGREEMENT, WIDENING = 1e-11, 1e-8


@dataclass(frozen=True, kw_only=True, eq=False)
class PowerRows:
    """Roles of the outputs of a function, which are named by their numbers: rows with bounds, and the terms of the cost.

    The cost is the sum of weight |torque rate| over K terms, divided by the duration, plus the sum of loss times heat.
    """

    limits: Array  # (R, 3) outputs that are limited, lower and upper bounds
    terms: Array  # (K, 4) outputs torque times rate, torque, and rate in unit time; positive weights
    heats: Array  # (L, 2) outputs that are never negative; positive losses
    duration: int  # input
    ranges: Array  # (n,) widths of the inputs, in which boxes are measured


@dataclass(frozen=True, kw_only=True, eq=False)
class PowerForm:
    """A least-power problem as a function of z, into which every x is mapped."""

    to_z: Callable[[Array], Array]  # maps points (..., n) to their z (..., n)
    box: Array  # (n, 2) box that contains the z of every x within its bounds
    function: ca.Function  # maps z to all outputs
    rows: PowerRows  # roles of these outputs. Their bounds contain every point that the judge accepts
    poses: ca.Function  # maps z to the outputs of the rows that cost little, which are bounded first
    pose_rows: Integers  # (E,) numbers of these rows in ``rows``
    # Maps z to metrics of the problem, under the same names; they are compared with the exact functions within reach
    metrics: ca.Function


# Operations of a tape, as in native/quadratic.hpp.
INPUT, NUMBER, OUTPUT, SUM, DIFFERENCE, SHIFT, SCALE, PRODUCT, INVERSE, ROOT, ABSOLUTE, LARGER, BELOW, WHERE_BELOW = (
    range(14)
)
UNARY = {ca.OP_SQRT: ROOT, ca.OP_INV: INVERSE, ca.OP_FABS: ABSOLUTE}
FACTORS = {ca.OP_NEG: -1.0, ca.OP_TWICE: 2.0}
COMMUTATIVE = {ca.OP_ADD: SUM, ca.OP_MUL: PRODUCT}
WITH_NUMBER = {ca.OP_ADD: SHIFT, ca.OP_MUL: SCALE, ca.OP_FMIN: BELOW, ca.OP_FMAX: LARGER}
EXACT: Mapping[int, Callable[[Fraction, Fraction], Fraction]]
EXACT = {ca.OP_ADD: operator.add, ca.OP_SUB: operator.sub, ca.OP_MUL: operator.mul, ca.OP_DIV: operator.truediv}


class _Node(NamedTuple):
    """Operation on earlier quantities; equal nodes are one quantity."""

    code: int
    first: int = -1
    second: int = -1
    value: float = 0.0


class _Graph:
    """Quantities of a function, without duplicates."""

    def __init__(self, function: ca.Function) -> None:
        self._name = function.name()
        self.nodes: list[_Node] = []
        self.symbols: list[int] = []  # a quantity depends on this many first inputs
        self._numbers: dict[_Node, int] = {}

    def add(self, code: int, first: int = -1, second: int = -1, value: float = 0.0) -> int:
        """Return the number of a quantity, a new one if it does not exist."""
        node = _Node(code, first, second, value)
        if node not in self._numbers:
            self._numbers[node] = len(self.nodes)
            self.nodes.append(node)
            used = max(self.symbols[k] if k >= 0 else 0 for k in (first, second))
            self.symbols.append(int(value) + 1 if code == INPUT else used)
        return self._numbers[node]

    def add_unary(self, operation: int, x: int) -> int:
        if operation == ca.OP_SQ:
            return self.add(PRODUCT, x, x)
        if operation in FACTORS:
            return self.add(SCALE, x, value=FACTORS[operation])
        return self.add(self._code(UNARY, operation), x)

    def add_binary(self, operation: int, x: int, y: int) -> int:
        if operation == ca.OP_DIV:
            return self.add(PRODUCT, x, self.add(INVERSE, y))
        if operation == ca.OP_SUB:
            return self.add(DIFFERENCE, x, y)
        return self.add(self._code(COMMUTATIVE, operation), min(x, y), max(x, y))

    def add_with_number(self, operation: int, x: int, number: float, number_first: bool) -> int:
        if operation == ca.OP_SUB:
            operation, number = ca.OP_ADD, number if number_first else -number
            x = self.add(SCALE, x, value=-1.0) if number_first else x
        elif operation == ca.OP_DIV:  # the rounding error of a reciprocal is less than what a scaled form is widened by
            operation, number = ca.OP_MUL, number if number_first else 1.0 / number
            x = self.add(INVERSE, x) if number_first else x
        return self.add(self._code(WITH_NUMBER, operation), x, value=number)

    def compute(self, operation: int, a: float, b: float) -> float:
        """Return the result for two numbers if it is exact."""
        value = EXACT[operation](Fraction(a), Fraction(b)) if operation in EXACT else None
        if value is None or Fraction(float(value)) != value:
            raise InputError(
                f"function {self._name!r} combines the numbers {a} and {b}, and the result is rounded; simplify it first"
            )
        return float(value)

    def _code(self, codes: Mapping[int, int], operation: int) -> int:
        if operation not in codes:
            raise InputError(f"function {self._name!r}: CasADi's operation number {operation} has no quadratic form")
        return codes[operation]


class _Condition(NamedTuple):
    """A quantity is below a number."""

    quantity: int
    number: float


def make_tape(function: ca.Function) -> tuple[Integers, Array]:
    """Return the steps (count, 5), as operation, result, two arguments and symbols, and the values (count,) of a function.

    Raises:
        InputError: an operation that cannot be enclosed.
    """
    graph, outputs = _Graph(function), dict[int, int]()
    results: list[int | float | _Condition] = []  # of each instruction: number of a quantity, a number, or a condition
    for node in read_tape(function):
        given = [results[k] for k in node.arguments]
        if node.operation == ca.OP_CONST:
            results.append(node.constant)
        elif node.operation == ca.OP_INPUT:
            results.append(graph.add(INPUT, value=float(node.place)))
        elif node.operation == ca.OP_OUTPUT:
            results += given
            assert not isinstance(given[0], _Condition)  # no problem has such an output; for the type checker
            outputs[node.place] = graph.add(NUMBER, value=given[0]) if isinstance(given[0], float) else given[0]
        else:
            results.append(_add(graph, node.operation, given))
    return _arrange(graph, [outputs[k] for k in range(len(outputs))])


def _add(graph: _Graph, operation: int, given: list[int | float | _Condition]) -> int | float | _Condition:
    x, y = given[0], given[-1]
    if isinstance(x, _Condition) and operation == ca.OP_IF_ELSE_ZERO and isinstance(y, int):
        return graph.add(WHERE_BELOW, x.quantity, y, x.number)
    if isinstance(x, _Condition) or isinstance(y, _Condition):
        raise InputError("a condition can only choose between a form and zero")
    if len(given) == 1 and isinstance(x, int):
        return graph.add_unary(operation, x)
    if isinstance(x, float) and isinstance(y, float):
        return graph.compute(operation, x, y)
    if isinstance(x, int) and isinstance(y, int):
        return graph.add_binary(operation, x, y)
    if operation == ca.OP_LE:
        return 1.0 if isinstance(x, int) else 0.0  # the form is for such points only, see ``QuadraticFunction``
    if operation == ca.OP_LT and isinstance(x, int):
        return _Condition(x, float(y))
    if isinstance(x, int):
        return graph.add_with_number(operation, x, float(y), False)
    return graph.add_with_number(operation, int(y), float(x), True)


def _arrange(graph: _Graph, outputs: list[int]) -> tuple[Integers, Array]:
    """Return the graph as a tape: outputs as soon as they are known, places free after their last use."""
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
