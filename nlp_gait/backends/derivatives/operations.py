"""CasADi's scalar operations as C++, for lanes and for single numbers, and functions of them as straight-line code."""

from __future__ import annotations

import math
from collections.abc import Iterator

import casadi as ca

from nlp_gait.backends.derivatives.structure import NotMapped
from nlp_gait.symbolic.tape import Instruction, read_tape

_UNARY = "EXP LOG SQRT SIN COS TAN ASIN ACOS ATAN SINH COSH TANH FLOOR CEIL FABS SIGN NOT LOG1P EXPM1"
_BINARY = "POW CONSTPOW LT LE EQ NE AND OR FMOD COPYSIGN IF_ELSE_ZERO FMIN FMAX ATAN2 HYPOT"
_NAMES = {"CONSTPOW": "pow", "LT": "less", "LE": "at_most", "EQ": "equal", "NE": "unequal"}  # others have CasADi's
# {f} is the prefix of functions: of lanes or of numbers (``native/operations.hpp``).
EXPRESSIONS: dict[int, str] = {
    ca.OP_ASSIGN: "{0}",
    ca.OP_ADD: "{0} + {1}",
    ca.OP_SUB: "{0} - {1}",
    ca.OP_MUL: "{0} * {1}",
    ca.OP_DIV: "{0} / {1}",
    ca.OP_NEG: "-{0}",
    ca.OP_SQ: "{0} * {0}",
    ca.OP_TWICE: "{0} + {0}",
    ca.OP_INV: "{f}number(1.0) / {0}",
    **{getattr(ca, f"OP_{name}"): f"{{f}}{name.lower()}({{0}})" for name in _UNARY.split()},
    **{getattr(ca, f"OP_{name}"): f"{{f}}{_NAMES.get(name, name.lower())}({{0}}, {{1}})" for name in _BINARY.split()},
}
CODES = {operation: code for code, operation in enumerate(EXPRESSIONS)}
# Operations in one C++ function: longer ones take the compiler longer per operation, shorter ones pass more values in memory.
PIECE = 500


def read_operations(function: ca.Function) -> Iterator[Instruction]:
    """Yield the instructions of a function of scalar operations; raises NotMapped for one that has no C++ here."""
    for instruction in read_tape(function):
        if instruction.operation not in (*EXPRESSIONS, ca.OP_INPUT, ca.OP_CONST, ca.OP_OUTPUT):
            raise NotMapped(f"operation {instruction.operation} of function {function.name()}")
        yield instruction


def write_function(name: str, function: ca.Function) -> str:
    """Return C++ of ``void name(const Vector* in, Vector* out)``, with all inputs one after the other, and all outputs.

    It is split into pieces, so that the compile time is proportional to the length.
    """
    tape = list(read_operations(function))
    free = {
        k: f"in[{each.place}]" if each.operation == ca.OP_INPUT else f"v_number({format_number(each.constant)})"
        for k, each in enumerate(tape)
        if each.operation in (ca.OP_INPUT, ca.OP_CONST)
    }
    body = [k for k in range(len(tape)) if k not in free]
    piece = {k: i // PIECE for i, k in enumerate(body)}
    kept: dict[int, int] = {}  # values that later pieces need, by their place in memory
    for k in body:
        for value in tape[k].arguments:
            if value not in free and piece[value] != piece[k]:
                kept.setdefault(value, len(kept))
    pieces = -(-len(body) // PIECE)
    lines: list[str] = []
    for number in range(pieces):
        lines.append(
            f"static NEVER_INLINE void {name}_{number}(const Vector* __restrict in, Vector* __restrict out, "
            "Vector* __restrict kept) {"
        )
        known: set[int] = set()
        for k in body[number * PIECE : (number + 1) * PIECE]:
            each = tape[k]
            for value in each.arguments:
                if value not in known:
                    known.add(value)
                    lines.append(f"const Vector t{value} = {free.get(value) or f'kept[{kept[value]}]'};")
            names = [f"t{value}" for value in each.arguments]
            if each.operation == ca.OP_OUTPUT:
                lines.append(f"out[{each.place}] = {names[0]};")
                continue
            known.add(k)
            lines.append(f"const Vector t{k} = {EXPRESSIONS[each.operation].format(*names, f='v_')};")
            if k in kept:
                lines.append(f"kept[{kept[k]}] = t{k};")
        lines.append("}")
    calls = " ".join(f"{name}_{number}(in, out, kept);" for number in range(pieces))
    lines.append(f"static void {name}(const Vector* in, Vector* out) {{ Vector kept[{len(kept) + 1}]; {calls} }}")
    return "\n".join(lines)


def format_number(value: float) -> str:
    """Return a double as C++, to the last bit."""
    if math.isnan(value):
        return "NAN"
    if math.isinf(value):
        return "INFINITY" if value > 0 else "-INFINITY"
    return repr(float(value))
