"""A CasADi function as operations that have quadratic forms: each quantity once, each place used again when it is free."""

from __future__ import annotations

from dataclasses import dataclass
from fractions import Fraction
from typing import Any, NamedTuple

import casadi as ca
import numpy as np

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array
from nlp_gait.symbolic.tape import read_tape

# Operations of a tape, as in native/quadratic.hpp.
INPUT, NUMBER, OUTPUT, SUM, DIFFERENCE, SHIFT, SCALE, PRODUCT, INVERSE, ROOT, ABSOLUTE, LARGER, BELOW, WHERE_BELOW = (
    range(14)
)
Integers = np.ndarray[Any, np.dtype[np.int32]]


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


def tape_of(function: ca.Function) -> tuple[Integers, Array]:
    """Steps (count, 5) of operation, result, arguments and symbols, and values (count,).

    Raises:
        InputError: an operation that cannot be enclosed.
    """
    graph, outputs = _Graph(function), dict[int, int]()
    results: list[int | float | _Condition] = []  # of each instruction: number of a quantity, a number, or a condition
    for each in read_tape(function):
        given = [results[k] for k in each.arguments]
        if each.operation == ca.OP_CONST:
            results.append(each.constant)
        elif each.operation == ca.OP_INPUT:
            results.append(graph.add(INPUT, value=float(each.place)))
        elif each.operation == ca.OP_OUTPUT:
            results += given
            assert not isinstance(given[0], _Condition)  # conditions are outputs of no problem; for the type checker
            outputs[each.place] = graph.add(NUMBER, value=given[0]) if isinstance(given[0], float) else given[0]
        else:
            results.append(_found(graph, each.operation, given))
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
