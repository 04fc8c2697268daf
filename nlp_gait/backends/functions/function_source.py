"""C++ source of any CasADi function: CasADi's generated code over lanes, and a loop over the rows of a batch."""

from __future__ import annotations

import re
from collections.abc import Iterator
from contextlib import suppress
from typing import Any

import casadi as ca

from nlp_gait.backends.kernel.compiler import read_native_source
from nlp_gait.backends.kernel.kernel_source import generate_lane_code
from nlp_gait.errors import InputError

SYMBOLS = ("nlp_gait_rows_memory", "nlp_gait_evaluate_rows")
NAMES: dict[int, str] = {value: name for name, value in vars(ca).items() if name.startswith("OP_")}
_SCALAR = (
    "ASSIGN ADD SUB MUL DIV NEG EXP LOG POW CONSTPOW SQRT SQ TWICE SIN COS TAN ASIN ACOS ATAN LT LE EQ NE NOT AND OR FLOOR CEIL "
    "FMOD FABS SIGN COPYSIGN IF_ELSE_ZERO ERF FMIN FMAX INV SINH COSH TANH ASINH ACOSH ATANH ATAN2 CONST INPUT OUTPUT LOG1P "
    "EXPM1 HYPOT REMAINDER"
)
# Operations on whole matrices whose C code does the same for all lanes; others are expanded to scalar operations.
_MATRIX = (
    "CALL MTIMES TRANSPOSE DOT BILIN RANK1 HORZCAT VERTCAT DIAGCAT HORZSPLIT VERTSPLIT DIAGSPLIT RESHAPE SUBREF GETNONZEROS "
    "ADDNONZEROS SETNONZEROS PROJECT NORM2 NORM1 NORMF HORZREPMAT HORZREPSUM LIFT SPARSITY_CAST"
)
SCALAR = frozenset(getattr(ca, f"OP_{name}") for name in _SCALAR.split())
OPERATIONS = {"SXFunction": SCALAR, "MXFunction": SCALAR | {getattr(ca, f"OP_{name}") for name in _MATRIX.split()}}
# What expanding would leave out without a word.
NOT_EXPANDED = {f"the operation {name}" for name in ("assertion", "monitor", "printme", "dump")}
# Longer functions keep their loops and matrices: straight-line code is faster, but its compile time grows with its length.
MOST_EXPANDED = 5000
LOOPS = ("Map", "ThreadMap", "MapSum")


def make_kernel(function: ca.Function) -> ca.Function:
    """Return a function named ``kernel`` with the same arguments and dense results, of supported operations only.

    Raises:
        InputError: an argument is sparse, or an operation is not supported.
    """
    for i in range(function.n_in()):
        if not function.sparsity_in(i).is_dense():
            raise InputError(
                f"argument {function.name_in(i)} of {function.name()} is sparse; make it dense with casadi.densify"
            )
    if any(_find_unsupported(function)) or _count_operations(function) <= MOST_EXPANDED:
        function = _expand(function)
    symbols, results = apply_to_symbols(function)
    return ca.Function("kernel", symbols, [ca.densify(result) for result in results])


def apply_to_symbols(function: ca.Function) -> tuple[list[Any], list[Any]]:
    """Return symbols for the arguments, SX or MX as the function has them, and the results as expressions of these."""
    scalar = function.is_a("SXFunction")
    symbols: list[Any] = function.sx_in() if scalar else function.mx_in()
    return symbols, function.call(symbols, not scalar, False)


def _expand(function: ca.Function) -> ca.Function:
    unsupported = set(_find_unsupported(function))
    if not unsupported & NOT_EXPANDED:
        with suppress(RuntimeError):  # an operation has no form of scalar operations
            scalar = function.expand()
            unsupported = set(_find_unsupported(scalar))
            if not unsupported:
                return scalar
    raise InputError(
        f"{function.name()} cannot be compiled: {min(unsupported)} is not supported; compute it outside, or write it with "
        "arithmetic, comparisons and elementary functions"
    )


def _count_operations(function: ca.Function) -> int:
    """Return about how many scalar operations a supported function has."""
    if function.is_a("SXFunction"):
        return function.n_instructions()
    parts = function.find_functions(0)
    if function.class_name() in LOOPS:
        counts = [function.numel_in(i) // max(1, parts[0].numel_in(i)) for i in range(function.n_in())]
        return _count_operations(parts[0]) * max(counts)
    total = 0
    for k in range(function.n_instructions()):
        operation, node = function.instruction_id(k), function.instruction_MX(k)
        if operation == ca.OP_CALL:
            total += _count_operations(node.which_function())
        elif operation == ca.OP_MTIMES:
            total += 2 * node.nnz() * node.dep(1).size2()
        elif operation != ca.OP_OUTPUT:
            total += node.nnz()
    return total


def _find_unsupported(function: ca.Function) -> Iterator[str]:
    """Yield what is not supported, in words."""
    for part in (function, *function.find_functions()):
        kind = part.class_name()
        if kind in OPERATIONS:
            found = {part.instruction_id(k) for k in range(part.n_instructions())} - OPERATIONS[kind]
            yield from (f"the operation {NAMES[each][3:].lower()}" for each in sorted(found))
        elif kind not in LOOPS:
            yield f"the function {part.name()} ({kind})"


def write_rows_source(kernel: ca.Function) -> str:
    """Return the C++ source of a kernel from ``make_kernel``; the lane count is the macro LANES."""
    inputs = [str(kernel.numel_in(i)) for i in range(kernel.n_in())]
    outputs = [str(kernel.numel_out(i)) for i in range(kernel.n_out())]
    entry = r"(\(\*\w+\+\+\)|\w+(?:\[i\])?)"  # of a vector, in a loop
    code = re.sub(rf"\({entry}\?{entry}:0\)", r"if_else_zero(\1,\2)", generate_lane_code(kernel))
    if kernel.is_a("SXFunction"):  # no argument or result is left out
        code = re.sub(r"(arg\[\d+\])\? (\1\[\d+\]) : 0", r"\2", re.sub(r"if \(res\[\d+\]!=0\) ", "", code))
    return "\n".join(
        [
            "#include <utility>",
            read_native_source("nlp_gait.backends.kernel", "lanes.hpp"),
            read_native_source("nlp_gait.backends.functions", "operations.hpp"),
            code.replace("x<0 ? -1 : x>0 ? 1 : x", "sign_of(x)"),
            f"enum {{ INPUTS = {len(inputs)}, OUTPUTS = {len(outputs)} }};",
            f"static const long long input_size[] = {{{', '.join(inputs)}}};",
            f"static const long long output_size[] = {{{', '.join(outputs)}}};",
            read_native_source("nlp_gait.backends.functions", "rows.hpp"),
        ]
    )
