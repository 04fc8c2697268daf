"""C++ source of an NLP's plan: tables, functions of one sample over lanes, and the code that executes the steps."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import casadi as ca

from nlp_gait.backends.derivatives.assembly import NlpPlan
from nlp_gait.backends.derivatives.operations import CODES, EXPRESSIONS, format_number, write_function
from nlp_gait.backends.derivatives.plan import FIRST, SECOND, VALUES
from nlp_gait.backends.kernel.compiler import read_native_source

UNARY = ("exp", "log", "sqrt", "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "floor", "ceil", "fabs",
         "log1p", "expm1")  # fmt: skip
BINARY = ("pow", "fmod", "copysign", "fmin", "fmax", "atan2", "hypot")


def write_nlp_source(found: NlpPlan) -> str:
    """Return C++ of an NLP's functions (see ``native/nlp.hpp``); the lane count is the macro LANES."""
    plan = found.plan
    m, n = found.jacobian.shape
    sizes = {
        "VARIABLES": n,
        "PARAMETERS": found.parameters,
        "ROWS": m,
        "SIZE": plan.size,
        "INITIALS": len(plan.initial),
        "MOST_IN": max((function.nnz_in() for function in plan.functions), default=1),
        "MOST_OUT": max((function.nnz_out() for function in plan.functions), default=1),
        "W": found.w,
        "P": found.p,
        "VALUE": found.rows,
        "WEIGHT": found.weights,
        "GRADIENT": found.gradient,
        "HESSIAN": found.hessian_place,
        "JACOBIAN_NONZEROS": found.jacobian.nnz(),
        "HESSIAN_NONZEROS": found.hessian.nnz(),
        "VALUE_STEPS": len(plan.steps[VALUES]),
        "FIRST_STEPS": len(plan.steps[FIRST]),
        "SECOND_STEPS": len(plan.steps[SECOND]),
    }
    cases = " ".join(
        f"case {CODES[operation]}: r = {expression.format('a', 'b', f='s_')}; break;"
        for operation, expression in EXPRESSIONS.items()
    )
    return "\n".join(
        [
            "#include <stdlib.h>\n#include <string.h>",
            read_native_source("nlp_gait.backends.kernel", "lanes.hpp"),
            read_native_source("nlp_gait.backends.derivatives", "operations.hpp"),
            *(f"ONE_ARGUMENT({name})" for name in UNARY),
            *(f"TWO_ARGUMENTS({name})" for name in BINARY),
            *(f"enum {{ {name} = {size} }};" for name, size in sizes.items()),
            f"#define HAS_SECOND {int(bool(plan.steps[SECOND]))}",
            *(write_function(f"function_{i}", function) for i, function in enumerate(plan.functions)),
            write_array("int", "initial_place", plan.initial),
            write_array("double", "initial_value", map(format_number, plan.initial.values())),
            write_array("int", "jacobian_place", found.jacobian_places.tolist()),
            write_array("long long int", "jacobian_sparsity", _compress(found.jacobian)),
            write_array("long long int", "hessian_sparsity", _compress(found.hessian)),
            _write_rows("tape", 4, plan.tape),
            _write_rows("runs", 4, plan.runs),
            _write_rows("products", 5, plan.products),
            _write_rows("value_steps", 3, plan.steps[VALUES]),
            _write_rows("first_steps", 3, plan.steps[FIRST]),
            _write_rows("second_steps", 3, plan.steps[SECOND]),
            _write_calls(found),
            f"#define OPERATIONS {cases}",
            read_native_source("nlp_gait.backends.derivatives", "nlp.hpp"),
        ]
    )


def write_casadi_source(found: NlpPlan) -> str:
    """Return the same with CasADi's interface."""
    return f"{write_nlp_source(found)}\n{read_native_source('nlp_gait.backends.derivatives', 'casadi.hpp')}"


def _write_rows(name: str, width: int, rows: Iterable[Sequence[int]]) -> str:
    text = ",\n".join(_braces(row) for row in rows)
    return f"static const int {name}[][{width}] = {{{text or '{0}'}}};"


def _braces(row: Iterable[object]) -> str:
    return f"{{{','.join(map(str, row))}}}"


def write_array(kind: str, name: str, values: Iterable[object]) -> str:
    """Return the definition of a constant array."""
    return f"static const {kind} {name}[] = {{{','.join(map(str, values)) or '0'}}};"


def _compress(sparsity: ca.Sparsity) -> Sequence[int]:
    return [*sparsity.shape, *sparsity.colind(), *sparsity.row()]


def _write_calls(found: NlpPlan) -> str:
    lines = [
        "struct Block { int base, sample, length, step, direction; };",
        "struct Call {\n  void (*function)(const Vector*, Vector*);\n  int count;\n  const int* directions;\n"
        "  const Block *inputs, *outputs, *end;\n};",
    ]
    rows = []
    for i, call in enumerate(found.plan.calls):
        lines.append(write_array("Block", f"blocks_{i}", [_braces(block) for block in call.inputs + call.outputs]))
        if call.directions is not None:
            lines.append(write_array("int", f"directions_{i}", call.directions.tolist()))
        directions = "nullptr" if call.directions is None else f"directions_{i}"
        split, end = len(call.inputs), len(call.inputs + call.outputs)
        rows.append(
            f"{{function_{call.function},{call.samples},{directions},blocks_{i},blocks_{i}+{split},blocks_{i}+{end}}}"
        )
    lines.append(f"static const Call calls[] = {{{','.join(rows) or '{}'}}};")
    return "\n".join(lines)
