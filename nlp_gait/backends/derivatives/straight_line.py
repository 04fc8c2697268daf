"""Functions of scalar operations as straight C++ over lanes, in pieces that compile in a time proportional to their length."""

from __future__ import annotations

import math

import casadi as ca

from nlp_gait.backends.derivatives.operations import EXPRESSIONS, read_operations

# Operations of one piece: longer ones take the compiler longer for each operation, shorter ones pass more values by memory.
PIECE = 500


def straight_line(name: str, function: ca.Function) -> str:
    """C++ of ``void name(const Vector* in, Vector* out)``, with all inputs one after the other, and all outputs."""
    listed = list(read_operations(function))
    free = {
        k: f"in[{each.place}]" if each.operation == ca.OP_INPUT else literal(each.constant)
        for k, each in enumerate(listed)
        if each.operation in (ca.OP_INPUT, ca.OP_CONST)
    }
    body = [k for k in range(len(listed)) if k not in free]
    piece = {k: i // PIECE for i, k in enumerate(body)}
    kept: dict[int, int] = {}  # values that later pieces need, by their place in memory
    for k in body:
        for value in listed[k].arguments:
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
            each = listed[k]
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


def literal(value: float) -> str:
    """A constant over all lanes."""
    return f"v_number({number(value)})"


def number(value: float) -> str:
    """A double as C++ writes it, to the last bit."""
    if math.isnan(value):
        return "NAN"
    if math.isinf(value):
        return "INFINITY" if value > 0 else "-INFINITY"
    return repr(float(value))
