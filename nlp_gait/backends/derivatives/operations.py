"""CasADi's scalar operations as C++, for lanes and for single numbers, and the instructions of a function in their order."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import casadi as ca

from nlp_gait.backends.derivatives.structure import NotMapped

# {f} is the prefix of functions: of lanes or of numbers (``native/nlp.hpp``).
EXPRESSIONS = {
    ca.OP_ASSIGN: "{0}",
    ca.OP_ADD: "{0} + {1}",
    ca.OP_SUB: "{0} - {1}",
    ca.OP_MUL: "{0} * {1}",
    ca.OP_DIV: "{0} / {1}",
    ca.OP_NEG: "-{0}",
    ca.OP_SQ: "{0} * {0}",
    ca.OP_TWICE: "{0} + {0}",
    ca.OP_INV: "{f}number(1.0) / {0}",
    **{
        code: f"{{f}}{name}({{0}})"
        for code, name in {
            ca.OP_EXP: "exp",
            ca.OP_LOG: "log",
            ca.OP_SQRT: "sqrt",
            ca.OP_SIN: "sin",
            ca.OP_COS: "cos",
            ca.OP_TAN: "tan",
            ca.OP_ASIN: "asin",
            ca.OP_ACOS: "acos",
            ca.OP_ATAN: "atan",
            ca.OP_SINH: "sinh",
            ca.OP_COSH: "cosh",
            ca.OP_TANH: "tanh",
            ca.OP_FLOOR: "floor",
            ca.OP_CEIL: "ceil",
            ca.OP_FABS: "fabs",
            ca.OP_SIGN: "sign",
            ca.OP_NOT: "not",
            ca.OP_LOG1P: "log1p",
            ca.OP_EXPM1: "expm1",
        }.items()
    },
    **{
        code: f"{{f}}{name}({{0}}, {{1}})"
        for code, name in {
            ca.OP_POW: "pow",
            ca.OP_CONSTPOW: "pow",
            ca.OP_LT: "less",
            ca.OP_LE: "at_most",
            ca.OP_EQ: "equal",
            ca.OP_NE: "unequal",
            ca.OP_AND: "and",
            ca.OP_OR: "or",
            ca.OP_FMOD: "fmod",
            ca.OP_COPYSIGN: "copysign",
            ca.OP_IF_ELSE_ZERO: "if_else_zero",
            ca.OP_FMIN: "fmin",
            ca.OP_FMAX: "fmax",
            ca.OP_ATAN2: "atan2",
            ca.OP_HYPOT: "hypot",
        }.items()
    },
}
CODES = {operation: code for code, operation in enumerate(EXPRESSIONS)}


class Instruction(NamedTuple):
    """An operation on the results of earlier instructions.

    Attributes:
        operation: CasADi's number of it.
        arguments: indices of instructions; of an input, its place in all inputs one after the other.
        place: of an output, its place in all outputs.
        constant: value of a constant.
        register: number of the place that CasADi keeps the result at until it is no longer needed.
    """

    operation: int
    arguments: tuple[int, ...]
    place: int = -1
    constant: float = 0.0
    register: int = -1


def instructions(function: ca.Function) -> Iterator[Instruction]:
    """Instructions of a function of scalar operations.

    Raises:
        NotMapped: an operation that has no C++ here.
    """
    starts = [0]
    for i in range(function.n_in()):
        starts.append(starts[-1] + function.nnz_in(i))
    ends = [0]
    for i in range(function.n_out()):
        ends.append(ends[-1] + function.nnz_out(i))
    writer: dict[int, int] = {}
    for k in range(function.n_instructions()):
        operation = function.instruction_id(k)
        inputs, outputs = function.instruction_input(k), function.instruction_output(k)
        if operation == ca.OP_OUTPUT:
            yield Instruction(operation, (writer[inputs[0]],), place=ends[outputs[0]] + outputs[1])
            continue
        register = outputs[0]
        if operation == ca.OP_INPUT:
            yield Instruction(operation, (starts[inputs[0]] + inputs[1],), register=register)
        elif operation == ca.OP_CONST:
            yield Instruction(operation, (), constant=function.instruction_constant(k), register=register)
        elif operation in EXPRESSIONS:
            yield Instruction(operation, tuple(writer[place] for place in inputs), register=register)
        else:
            raise NotMapped(f"operation {operation} of function {function.name()}")
        writer[register] = k
