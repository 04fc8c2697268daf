"""CasADi's scalar operations as C++, for lanes and for single numbers."""

from __future__ import annotations

from collections.abc import Iterator

import casadi as ca

from nlp_gait.backends.derivatives.structure import NotMapped
from nlp_gait.symbolic.tape import Instruction, read_tape

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


def read_operations(function: ca.Function) -> Iterator[Instruction]:
    """Yield the instructions of a function of scalar operations.

    Raises:
        NotMapped: an operation has no C++ here.
    """
    for instruction in read_tape(function):
        if instruction.operation not in (*EXPRESSIONS, ca.OP_INPUT, ca.OP_CONST, ca.OP_OUTPUT):
            raise NotMapped(f"operation {instruction.operation} of function {function.name()}")
        yield instruction
