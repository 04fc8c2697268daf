"""A problem's kernel, and C++ source: CasADi's generated code over a vector type, and a loop over the rows of a batch."""

import re
from dataclasses import dataclass

import casadi as ca
import numpy as np

from nlp_gait.backends.exact import ExactModel, build_exact_model, check_row_bounds
from nlp_gait.backends.kernel.compiler import read_native_source
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.locking import lock_casadi

SYMBOLS = ("nlp_gait_rows_memory", "nlp_gait_evaluate_rows")


@dataclass(frozen=True, kw_only=True, eq=False)
class Kernel:
    """The part of the exact model that is evaluated for each candidate, and the part that depends on parameters only."""

    function: ca.Function  #: (x, p) to cost and g (m,)
    bounds: ca.Function  #: p to lower and upper (m,)
    weights: Array  #: (m,) 1 / scale of each row
    model: ExactModel

    @lock_casadi
    def row_bounds(self, problem: GaitProblem) -> tuple[Array, Array]:
        """Return lower and upper bounds (m,) of the rows for the problem's parameter values."""
        lower, upper = (np.array(bound, dtype=float).ravel() for bound in self.bounds(problem.p))
        check_row_bounds(problem, self.model.row_names, lower, upper)
        return lower, upper


def build_kernel(problem: GaitProblem) -> Kernel:
    """Return the kernel of a problem, built once for all copies that differ in parameter values only."""
    return problem.build_once(_build)


def _build(problem: GaitProblem) -> Kernel:
    model = build_exact_model(problem)
    x, p = model.function.mx_in()
    cost, _, g, lower, upper, _ = model.function.call([x, p], True, False)
    function = ca.Function("kernel", [x, p], [cost, g])
    bounds = ca.Function("bounds", [p], [lower, upper])
    return Kernel(function=function, bounds=bounds, weights=1.0 / model.row_scales, model=model)


def write_rows_source(function: ca.Function, *, objective: bool = False) -> str:
    """Return the C++ source of a function named ``kernel`` with dense results; the lane count is the macro LANES.

    With ``objective``, the function is (x, p) to (cost, g), and the code also computes the violation, see ``rows.hpp``.
    """
    inputs = [str(function.numel_in(i)) for i in range(function.n_in())]
    outputs = [str(function.numel_out(i)) for i in range(function.n_out())] + ["1"] * objective
    sources = [
        "#include <utility>",
        read_native_source("nlp_gait.backends.kernel", "lanes.hpp"),
        _generate_lane_code(function),
        *["#define OBJECTIVE"] * objective,
        f"enum {{ INPUTS = {len(inputs)}, OUTPUTS = {len(outputs)} }};",
        f"static const long long input_size[] = {{{', '.join(inputs)}}};",
        f"static const long long output_size[] = {{{', '.join(outputs)}}};",
        read_native_source("nlp_gait.backends.kernel", "rows.hpp"),
    ]
    return "\n".join(sources)


def _generate_lane_code(function: ca.Function) -> str:
    """Return CasADi's C code of a function, over the numbers of lanes.hpp."""
    generator = ca.CodeGenerator("kernel", {"casadi_real": "Lanes"})
    generator.add(function)
    entry = r"(\(\*\w+\+\+\)|\w+(?:\[i\])?)"  # of a vector, in a loop
    code = re.sub(rf"\({entry}\?{entry}:0\)", r"if_else_zero(\1,\2)", generator.dump())
    if function.is_a("SXFunction"):  # no argument or result is left out
        code = re.sub(r"(arg\[\d+\])\? (\1\[\d+\]) : 0", r"\2", re.sub(r"if \(res\[\d+\]!=0\) ", "", code))
    code = code.replace("x<0 ? -1 : x>0 ? 1 : x", "sign_of(x)")
    return f"#define __STDC_VERSION__ 199901L  // so that the generated code calls fmin, fmax and fabs of lanes.hpp\n{code}"
