"""An NLP with functions and derivatives in native code, for any solver of CasADi's ``nlpsol``.

The C++ source has the plan's tables, functions of one sample over lanes, and the code that executes the steps.
"""

import hashlib
from collections.abc import Iterable, Mapping, Sequence
from functools import cache
from importlib.metadata import version
from importlib.resources import files
from typing import Any

import casadi as ca
import numpy as np
from casadi import MX

from nlp_gait.backends.derivatives.assembly import NlpPlan, make_nlp_plan
from nlp_gait.backends.derivatives.plan import CODES, EXPRESSIONS, format_number, write_function
from nlp_gait.backends.derivatives.structure import split_nlp
from nlp_gait.backends.kernel.compiler import find_compiler, lane_flags, load_library, native_lanes, read_native_source
from nlp_gait.errors import CompilerError
from nlp_gait.formulation import Array

UNARY = ("exp", "log", "sqrt", "sin", "cos", "tan", "asin", "acos", "atan", "sinh", "cosh", "tanh", "floor", "ceil", "fabs",
         "log1p", "expm1")  # fmt: skip
BINARY = ("pow", "fmod", "copysign", "fmin", "fmax", "atan2", "hypot")


def write_nlp_sources(nlp_plan: NlpPlan) -> tuple[str, str]:
    """Return C++ of an NLP (see ``native/nlp.hpp``), and of its functions of one sample; the lane count is the macro LANES."""
    plan = nlp_plan.plan
    m, n = nlp_plan.jacobian.shape
    phases = dict(zip(("value", "first", "second"), plan.steps, strict=True))
    sizes = {
        "VARIABLES": n,
        "PARAMETERS": nlp_plan.parameters,
        "ROWS": m,
        "SIZE": plan.size,
        "MOST_IN": max((function.nnz_in() for function in plan.functions), default=1),
        "MOST_OUT": max((function.nnz_out() for function in plan.functions), default=1),
        "W": nlp_plan.w,
        "P": nlp_plan.p,
        "VALUE": nlp_plan.rows,
        "WEIGHT": nlp_plan.weights,
        "GRADIENT": nlp_plan.gradient,
        "HESSIAN": nlp_plan.hessian_place,
        "HESSIAN_NONZEROS": nlp_plan.hessian.nnz(),
        "JACOBIAN_NONZEROS": nlp_plan.jacobian.nnz(),
        "INITIALS": len(plan.initial),
        **{f"{phase.upper()}_STEPS": len(steps) for phase, steps in phases.items()},
    }
    cases = " ".join(
        f"case {CODES[operation]}: r = {expression.format('a', 'b', f='s_')}; break;"
        for operation, expression in EXPRESSIONS.items()
    )
    operations = [
        read_native_source("nlp_gait.backends.kernel", "lanes.hpp"),
        read_native_source("nlp_gait.backends.derivatives", "operations.hpp"),
        *(f"ONE_ARGUMENT({name})" for name in UNARY),
        *(f"TWO_ARGUMENTS({name})" for name in BINARY),
    ]
    functions = [write_function(f"function_{i}", function) for i, function in enumerate(plan.functions)]
    sources = [
        "#include <stdlib.h>\n#include <string.h>",
        *operations,
        *(f"enum {{ {name} = {size} }};" for name, size in sizes.items()),
        *(f"void function_{i}(const Vector*, Vector*);" for i in range(len(functions))),
        write_array("int", "initial_place", plan.initial),
        write_array("double", "initial_value", map(format_number, plan.initial.values())),
        write_array("int", "jacobian_place", nlp_plan.jacobian_places.tolist()),
        write_array("long long int", "jacobian_sparsity", _compress(nlp_plan.jacobian)),
        write_array("long long int", "hessian_sparsity", _compress(nlp_plan.hessian)),
        _write_rows("tape", 4, plan.tape),
        _write_rows("runs", 4, plan.runs),
        _write_rows("products", 5, plan.products),
        *(_write_rows(f"{phase}_steps", 3, steps) for phase, steps in phases.items()),
        _write_calls(nlp_plan),
        f"#define OPERATIONS {cases}",
        read_native_source("nlp_gait.backends.derivatives", "nlp.hpp"),
        read_native_source("nlp_gait.backends.derivatives", "casadi.hpp"),
    ]
    return "\n".join(sources), "\n".join([*operations, *functions])


def _write_rows(name: str, width: int, rows: Iterable[Sequence[int]]) -> str:
    text = ",\n".join(_format_braces(row) for row in rows)
    return f"static const int {name}[][{width}] = {{{text or '{0}'}}};"


def _format_braces(row: Iterable[object]) -> str:
    return f"{{{','.join(map(str, row))}}}"


def write_array(kind: str, name: str, values: Iterable[object]) -> str:
    """Return the definition of a constant array."""
    return f"static const {kind} {name}[] = {{{','.join(map(str, values)) or '0'}}};"


def _compress(sparsity: ca.Sparsity) -> Sequence[int]:
    return [*sparsity.shape, *sparsity.colind(), *sparsity.row()]


def _write_calls(nlp_plan: NlpPlan) -> str:
    lines = [
        "struct Block { int base, sample, length, step, direction; };",
        "struct Call {\n  void (*function)(const Vector*, Vector*);\n  int count;\n  const int* directions;\n"
        "  const Block *inputs, *outputs, *end;\n};",
    ]
    rows = []
    for i, call in enumerate(nlp_plan.plan.calls):
        lines.append(
            write_array("Block", f"blocks_{i}", [_format_braces(block) for block in call.inputs + call.outputs])
        )
        if call.directions is not None:
            lines.append(write_array("int", f"directions_{i}", call.directions.tolist()))
        directions = "nullptr" if call.directions is None else f"directions_{i}"
        first = f"blocks_{i}"
        split = len(call.inputs)
        end = len(call.inputs + call.outputs)
        rows.append(f"{{function_{call.function},{call.samples},{directions},{first},{first}+{split},{first}+{end}}}")
    lines.append(f"static const Call calls[] = {{{','.join(rows) or '{}'}}};")
    return "\n".join(lines)


# -Og: with -O1 the compiler takes 30 % longer, and the functions are not faster.
FLAGS = ("-std=c++17", "-Og", "-fvisibility=hidden", "-ffp-contract=off", "-fno-math-errno", "-w")
NLP_VALUES = ("nlp_f", "nlp_g")
DERIVATIVES = {"grad_f": "nlp_grad_f", "jac_g": "nlp_jac_g", "hess_lag": "nlp_hess_l"}
# Keeps IPOPT from deriving further functions, such as derivatives by the parameters.
NO_OTHERS: Mapping[str, bool] = {"no_nlp_grad": True, "calc_lam_p": False}
# Detects a wrong library, not rounding: derivatives are compared with differences over this step.
STEP, CHECK_TOLERANCE, CHECK_POINTS = 1e-6, 1e-3, 5
# Near a singular pose differences consist of rounding: they change with the step, and another point is drawn.
OTHER_STEP, MOST_POINTS = 1e-5, 50


class CompiledNlp:
    """Functions of an NLP in a library that is built once and stored in the cache folder.

    ``nlp`` is CasADi's dictionary of x, p, f, g, and ``options`` those with which ``nlpsol`` uses these derivatives;
    sensitivities to p are not available then. ``functions`` have the names that ``nlpsol`` gives them.
    """

    def __init__(self, nlp: Mapping[str, MX], p: Array, *, second: bool = True) -> None:
        """Build the library or load it, and check it at parameter values p (k,); CompilerError if the NLP cannot be compiled."""
        lanes = native_lanes()
        names = [*NLP_VALUES, *list(DERIVATIVES.values())[: 3 if second else 2]]
        graph = ca.Function("nlp", [nlp["x"], nlp["p"]], [nlp["f"], nlp["g"]]).serialize()
        # The library is found without generating its source, by what the source depends on.
        loaded, _ = load_library(
            "\0".join([graph, version("casadi"), _hash_generator(), str(second)]),
            find_compiler(),
            (*FLAGS, *lane_flags(lanes), f"-DLANES={lanes}"),
            names,
            lambda: write_nlp_sources(make_nlp_plan(split_nlp(nlp), second=second)),
        )
        library = loaded._name  # noqa: SLF001 (documented; what was checked, whatever the path names now)
        self.functions = {name: ca.external(name, library) for name in names}
        self._check(nlp, p, library)
        x, symbols = nlp["x"], nlp["p"]
        self.nlp = {"x": x, "p": symbols, **{key: self.functions[f"nlp_{key}"](x, symbols) for key in ("f", "g")}}
        derivatives = {key: self.functions[name] for key, name in DERIVATIVES.items() if name in self.functions}
        self.options: dict[str, Any] = {**NO_OTHERS, **derivatives}

    def _check(self, nlp: Mapping[str, MX], p: Array, library: str) -> None:
        """Compare values with the virtual machine's, and derivatives with differences; at most points they must agree."""
        machine = ca.Function("machine", [nlp["x"], nlp["p"]], [nlp["f"], nlp["g"]])
        rng = np.random.default_rng(0)
        n, m = nlp["x"].shape[0], nlp["g"].shape[0]
        agreeing = checked = 0
        for _ in range(MOST_POINTS):
            w, d, weights = rng.uniform(0.0, 1.0, n), rng.uniform(-1.0, 1.0, n), rng.uniform(-1.0, 1.0, m)
            slope, wider = (
                (_join_numbers(machine(w + step * d, p)) - _join_numbers(machine(w - step * d, p))) / (2 * step)
                for step in (STEP, OTHER_STEP)
            )
            if not _agree(slope, wider):
                continue
            (f, gradient), (g, J) = (self.functions[name](w, p) for name in ("nlp_grad_f", "nlp_jac_g"))
            pairs = [
                (_join_numbers(machine(w, p)), _join_numbers([f, g])),
                (slope, _join_numbers([ca.dot(gradient, d), J @ d])),
            ]
            if "nlp_hess_l" in self.functions:
                ahead, behind = (
                    [self.functions[name](w + step * d, p)[1] for name in ("nlp_grad_f", "nlp_jac_g")]
                    for step in (STEP, -STEP)
                )
                change = ahead[0] - behind[0] + (ahead[1] - behind[1]).T @ weights
                H = self.functions["nlp_hess_l"](w, p, 1.0, weights)
                pairs.append((_join_numbers([change / (2 * STEP)]), _join_numbers([ca.triu2symm(H) @ d])))
            agreeing += all(_agree(expected, value) for expected, value in pairs)
            if (checked := checked + 1) == CHECK_POINTS:
                break
        if 2 * agreeing <= checked:
            raise CompilerError(
                f"{library} computes other values than the virtual machine; delete it, and try another compiler (CXX)"
            )


@cache
def _hash_generator() -> str:
    digest = hashlib.sha256(files("nlp_gait.symbolic").joinpath("tape.py").read_bytes())
    backends = files("nlp_gait.backends")
    for folder in ("derivatives", "derivatives/native", "kernel/native"):
        for file in sorted(backends.joinpath(folder).iterdir(), key=lambda file: file.name):
            if file.name.endswith((".py", ".hpp")):
                digest.update(file.read_bytes())
    return digest.hexdigest()


def _join_numbers(matrices: Any) -> Array:
    return np.concatenate([ca.DM(matrix).full().ravel() for matrix in matrices])


def _agree(expected: Array, computed: Array) -> bool:
    """Return whether the numbers agree, relative to the largest one; NaN must agree, too."""
    scale = np.abs(expected[np.isfinite(expected)]).max(initial=1e-6)
    return bool(np.allclose(computed, expected, rtol=0.0, atol=CHECK_TOLERANCE * scale, equal_nan=True))
