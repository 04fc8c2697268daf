"""CasADi's instruction tapes, the scalar operations of a function in their order, and simpler expressions made from them.

Rewritten expressions cost fewer and cheaper operations, with the same values up to rounding.
"""

from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from itertools import accumulate, count
from typing import NamedTuple

import casadi as ca
from casadi import DM, SX


class Instruction(NamedTuple):
    """An operation on the results of earlier instructions."""

    operation: int  #: CasADi's number of the operation
    arguments: tuple[int, ...] = ()  #: indices of earlier instructions
    place: int = -1  #: index of an input or an output among the nonzeros of all inputs or all outputs
    constant: float = 0.0  #: value of a constant
    register: int = -1  #: place in CasADi's work vector at which the result is stored; -1 for outputs


def read_tape(function: ca.Function) -> Iterator[Instruction]:
    """Yield the instructions of a function, expanded to scalar operations; raises RuntimeError where that is impossible."""
    scalar = function if function.is_a("SXFunction") else function.expand()
    first_input = list(accumulate((scalar.nnz_in(i) for i in range(scalar.n_in())), initial=0))
    first_output = list(accumulate((scalar.nnz_out(i) for i in range(scalar.n_out())), initial=0))
    writer: dict[int, int] = {}  # instruction that last wrote each register
    for k in range(scalar.n_instructions()):
        operation, read, written = scalar.instruction_id(k), scalar.instruction_input(k), scalar.instruction_output(k)
        if operation == ca.OP_OUTPUT:
            yield Instruction(operation, (writer[read[0]],), place=first_output[written[0]] + written[1])
            continue
        register = written[0]
        if operation == ca.OP_INPUT:
            yield Instruction(operation, place=first_input[read[0]] + read[1], register=register)
        elif operation == ca.OP_CONST:
            yield Instruction(operation, constant=float(scalar.instruction_constant(k)), register=register)
        else:
            yield Instruction(operation, tuple(writer[place] for place in read), register=register)
        writer[register] = k


# Squared length below which a vector has no direction; keeps its cosine and sine finite.
LEAST_SQUARE = 1e-200


def simplify(outputs: Sequence[SX]) -> list[SX]:
    """Return the same expressions, cheaper to evaluate.

    Common parts are shared; several divisions by one divisor become one reciprocal and products; sines and cosines of angles
    that come from ``acos`` and ``atan2`` are computed from the arguments of these, without a transcendental function.
    """
    shared = ca.cse(list(outputs))
    symbols = ca.symvar(ca.veccat(*shared))
    rewritten = _Rewriter(symbols, list(read_tape(ca.Function("shared", symbols, shared)))).rewrite(shared)
    with _without_simplification():
        return list(ca.cse(rewritten))


def tabulate_last_input(function: ca.Function, values: DM) -> tuple[ca.Function, DM]:
    """Take out of a function what depends on its last input alone, a scalar of known values (1, n).

    Returns:
        The function with a vector (k,) in place of its last input, and that vector's values (k, n).
    """
    *first_inputs, last = function.sx_in()
    with _without_simplification():
        outputs = function.call([*first_inputs, last])
        remaining, symbols, extracted = ca.extract_parametric(outputs, last, {"extract_trivial": True})
    table = ca.Function("table", [last], [ca.vertcat(*extracted)]).map(values.shape[1])
    names = function.name_in(), function.name_out()
    return ca.Function(function.name(), [*first_inputs, ca.vertcat(*symbols)], remaining, *names), table(values)


class _Rewriter:
    def __init__(self, symbols: Sequence[SX], tape: Sequence[Instruction]) -> None:
        self._symbols = symbols
        self._tape = tape
        divisions = [instruction for instruction in tape if instruction.operation == ca.OP_DIV]
        self._divisions = Counter(instruction.arguments[1] for instruction in divisions)  # by each divisor
        self._values: list[SX] = []
        self._reciprocals: dict[int, SX] = {}

    def rewrite(self, outputs: Sequence[SX]) -> list[SX]:
        """Return the function's outputs, with the sparsity of ``outputs``."""
        nonzeros: dict[int, SX] = {}
        for instruction in self._tape:
            self._values.append(self._build(instruction))
            if instruction.operation == ca.OP_OUTPUT:
                nonzeros[instruction.place] = self._values[-1]
        results, places = [SX(output) for output in outputs], count()
        for result in results:
            for k in range(result.nnz()):
                result.nz[k] = nonzeros[next(places)]
        return results

    def _build(self, instruction: Instruction) -> SX:
        operation = instruction.operation
        if operation == ca.OP_INPUT:
            return self._symbols[instruction.place]
        if operation == ca.OP_CONST:
            return SX(instruction.constant)
        arguments = [self._values[i] for i in instruction.arguments]
        if operation == ca.OP_OUTPUT:
            return arguments[0]
        if operation == ca.OP_DIV:
            return self._divide(*instruction.arguments)
        if operation in (ca.OP_SIN, ca.OP_COS):
            cos, sin = self._cos_sin(instruction.arguments[0])
            return sin if operation == ca.OP_SIN else cos
        build = SX.unary if len(arguments) == 1 else SX.binary
        return build(operation, *arguments)

    def _divide(self, dividend: int, divisor: int) -> SX:
        node = self._tape[divisor]
        if node.operation == ca.OP_CONST:
            return self._values[dividend] * (1.0 / node.constant)
        if self._divisions[divisor] < 2:
            return self._values[dividend] / self._values[divisor]
        if divisor not in self._reciprocals:
            self._reciprocals[divisor] = 1.0 / self._values[divisor]
        return _multiply(self._values[dividend], self._reciprocals[divisor])

    def _cos_sin(self, angle: int) -> tuple[SX, SX]:
        """Return cosine and sine of an angle, in closed form where possible."""
        node = self._tape[angle]
        if node.operation == ca.OP_NEG:
            cos, sin = self._cos_sin(node.arguments[0])
            return cos, -sin
        if not self._has_closed_form(angle):
            return ca.cos(self._values[angle]), ca.sin(self._values[angle])
        if node.operation == ca.OP_ACOS:
            cos = self._values[node.arguments[0]]
            return cos, ca.sqrt((1.0 - cos) * (1.0 + cos))
        if node.operation == ca.OP_ATAN2:
            y, x = (self._values[i] for i in node.arguments)
            square = self._square(node.arguments[1]) + self._square(node.arguments[0])
            scale = 1.0 / ca.sqrt(ca.fmax(square, LEAST_SQUARE))
            return _multiply(x, scale), _multiply(y, scale)
        (cos_a, sin_a), (cos_b, sin_b) = (self._cos_sin(i) for i in node.arguments)
        if node.operation == ca.OP_SUB:
            sin_b = -sin_b
        return cos_a * cos_b - sin_a * sin_b, sin_a * cos_b + cos_a * sin_b

    def _has_closed_form(self, angle: int) -> bool:
        node = self._tape[angle]
        if node.operation in (ca.OP_ADD, ca.OP_SUB, ca.OP_NEG):
            return all(self._has_closed_form(i) for i in node.arguments)
        return node.operation in (ca.OP_ACOS, ca.OP_ATAN2)

    def _square(self, number: int) -> SX:
        """Return the square of an instruction's result, without a sign or a root."""
        node = self._tape[number]
        if node.operation == ca.OP_NEG:
            return self._square(node.arguments[0])
        return self._values[node.arguments[0]] if node.operation == ca.OP_SQRT else self._values[number] ** 2


def _multiply(factor: SX, reciprocal: SX) -> SX:
    with _without_simplification():
        return factor * reciprocal


@contextmanager
def _without_simplification() -> Iterator[None]:
    """Keep CasADi from turning a product with a reciprocal back into a division."""
    before = ca.GlobalOptions.getSimplificationOnTheFly()
    ca.GlobalOptions.setSimplificationOnTheFly(False)
    try:
        yield
    finally:
        ca.GlobalOptions.setSimplificationOnTheFly(before)
