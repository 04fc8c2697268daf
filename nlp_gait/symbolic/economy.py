"""Expressions rewritten to cost fewer and cheaper operations, with the same values up to rounding."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import NamedTuple

import casadi as ca
from casadi import DM, SX

# Squared length below which a vector has no direction; keeps its cosine and sine finite.
LEAST_SQUARE = 1e-200


def economical(outputs: Sequence[SX]) -> list[SX]:
    """The same expressions, cheaper to evaluate.

    Common parts are shared; several divisions by one divisor become one reciprocal and products; sines and cosines of angles
    that come from ``acos`` and ``atan2`` are taken from the arguments of these, without a transcendental function.
    """
    shared = ca.cse(list(outputs))
    symbols = ca.symvar(ca.veccat(*shared))
    function = ca.Function("shared", symbols, shared)
    rewriter = _Rewriter(symbols, [SX(output) for output in shared])
    for node in _nodes(function):
        rewriter.take(node)
    with _unsimplified():
        return list(ca.cse(rewriter.results))


def tabulated(function: ca.Function, values: DM) -> tuple[ca.Function, DM]:
    """A function that is to be mapped over known values of its last input, without what depends on that input alone.

    Args:
        function: of SX expressions; its last input is a scalar.
        values: (1, n) values of that input.

    Returns:
        The function with a vector (k,) in place of its last input, and that vector's values (k, n).
    """
    *others, last = function.sx_in()
    with _unsimplified():
        outputs = function.call([*others, last])
        remaining, symbols, extracted = ca.extract_parametric(outputs, last, {"extract_trivial": True})
    table = ca.Function("table", [last], [ca.vertcat(*extracted)]).map(values.shape[1])
    names = function.name_in(), function.name_out()
    return ca.Function(function.name(), [*others, ca.vertcat(*symbols)], remaining, *names), table(values)


class _Node(NamedTuple):
    """An instruction of a function: an operation on the results of earlier ones.

    Attributes:
        operation: CasADi's number of it.
        arguments: indices of the nodes that it works on; for inputs and outputs (number, nonzero).
        target: for an output (number, nonzero).
        constant: value of a constant.
        divisions: number of divisions by this node.
    """

    operation: int
    arguments: tuple[int, ...]
    target: tuple[int, ...]
    constant: float
    divisions: int


def _nodes(function: ca.Function) -> list[_Node]:
    """Instructions of an SX function, with work-vector places replaced by indices of the nodes that last wrote them."""
    nodes: list[_Node] = []
    writer: dict[int, int] = {}
    divisions: Counter[int] = Counter()
    for k in range(function.n_instructions()):
        operation = function.instruction_id(k)
        arguments, target = tuple(function.instruction_input(k)), tuple(function.instruction_output(k))
        if operation != ca.OP_INPUT:
            arguments = tuple(writer[place] for place in arguments[: 1 if operation == ca.OP_OUTPUT else None])
        if operation != ca.OP_OUTPUT:
            writer[target[0]] = k
        if operation == ca.OP_DIV:
            divisions[arguments[1]] += 1
        constant = function.instruction_constant(k) if operation == ca.OP_CONST else 0.0
        nodes.append(_Node(operation, arguments, target, constant, 0))
    return [node._replace(divisions=divisions[k]) for k, node in enumerate(nodes)]


class _Rewriter:
    """Builds expressions anew, node by node.

    Attributes:
        results: outputs, filled as the nodes are taken.
    """

    def __init__(self, symbols: Sequence[SX], results: list[SX]) -> None:
        self.results = results
        self._symbols = symbols
        self._nodes: list[_Node] = []
        self._values: list[SX] = []
        self._reciprocals: dict[int, SX] = {}

    def take(self, node: _Node) -> None:
        """Build one more node."""
        self._nodes.append(node)
        self._values.append(self._built(node))
        if node.operation == ca.OP_OUTPUT:
            number, place = node.target
            self.results[number].nz[place] = self._values[-1]

    def _built(self, node: _Node) -> SX:
        if node.operation == ca.OP_INPUT:
            return self._symbols[node.arguments[0]]
        if node.operation == ca.OP_CONST:
            return SX(node.constant)
        arguments = [self._values[i] for i in node.arguments]
        if node.operation == ca.OP_OUTPUT:
            return arguments[0]
        if node.operation == ca.OP_DIV:
            return self._quotient(*node.arguments)
        if node.operation in (ca.OP_SIN, ca.OP_COS):
            cos, sin = self._turn(node.arguments[0])
            return sin if node.operation == ca.OP_SIN else cos
        build = SX.unary if len(arguments) == 1 else SX.binary
        return build(node.operation, *arguments)

    def _quotient(self, dividend: int, divisor: int) -> SX:
        node = self._nodes[divisor]
        if node.operation == ca.OP_CONST:
            return self._values[dividend] * (1.0 / node.constant)
        if node.divisions < 2:
            return self._values[dividend] / self._values[divisor]
        if divisor not in self._reciprocals:
            self._reciprocals[divisor] = 1.0 / self._values[divisor]
        return _product(self._values[dividend], self._reciprocals[divisor])

    def _turn(self, angle: int) -> tuple[SX, SX]:
        """Cosine and sine of an angle, in closed form where that is possible."""
        node = self._nodes[angle]
        if node.operation == ca.OP_NEG:
            cos, sin = self._turn(node.arguments[0])
            return cos, -sin
        if not self._closed(angle):
            return ca.cos(self._values[angle]), ca.sin(self._values[angle])
        if node.operation == ca.OP_ACOS:
            cos = self._values[node.arguments[0]]
            return cos, ca.sqrt((1.0 - cos) * (1.0 + cos))
        if node.operation == ca.OP_ATAN2:
            y, x = (self._values[i] for i in node.arguments)
            square = self._square(node.arguments[1]) + self._square(node.arguments[0])
            scale = 1.0 / ca.sqrt(ca.fmax(square, LEAST_SQUARE))
            return _product(x, scale), _product(y, scale)
        (cos_a, sin_a), (cos_b, sin_b) = (self._turn(i) for i in node.arguments)
        if node.operation == ca.OP_SUB:
            sin_b = -sin_b
        return cos_a * cos_b - sin_a * sin_b, sin_a * cos_b + cos_a * sin_b

    def _closed(self, angle: int) -> bool:
        """Whether an angle is acos, atan2, or a sum, difference or negative of such angles."""
        node = self._nodes[angle]
        if node.operation in (ca.OP_ADD, ca.OP_SUB, ca.OP_NEG):
            return all(self._closed(i) for i in node.arguments)
        return node.operation in (ca.OP_ACOS, ca.OP_ATAN2)

    def _square(self, number: int) -> SX:
        """Square of a node, without a detour over a sign or a root."""
        node = self._nodes[number]
        if node.operation == ca.OP_NEG:
            return self._square(node.arguments[0])
        return self._values[node.arguments[0]] if node.operation == ca.OP_SQRT else self._values[number] ** 2


def _product(factor: SX, reciprocal: SX) -> SX:
    with _unsimplified():
        return factor * reciprocal


@contextmanager
def _unsimplified() -> Iterator[None]:
    """Keeps CasADi from turning a product with a reciprocal back into a division."""
    before = ca.GlobalOptions.getSimplificationOnTheFly()
    ca.GlobalOptions.setSimplificationOnTheFly(False)
    try:
        yield
    finally:
        ca.GlobalOptions.setSimplificationOnTheFly(before)
