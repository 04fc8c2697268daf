"""C++ source of a problem's kernel: CasADi's generated code over a vector type, and a loop over candidates."""

import re
from dataclasses import dataclass

import casadi as ca
import numpy as np

from nlp_gait.backends.exact import ExactModel, build_exact_model
from nlp_gait.backends.kernel.compiler import read_native_source
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.locking import lock_casadi

SYMBOLS = ("nlp_gait_lanes", "nlp_gait_workspace_bytes", "nlp_gait_evaluate")


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


def write_kernel_source(function: ca.Function) -> str:
    """Return the C++ source of a kernel (x, p) to (cost, g); the lane count is the macro LANES."""
    numbers, batch = (read_native_source("nlp_gait.backends.kernel", name) for name in ("lanes.hpp", "batch.hpp"))
    sizes = {"VARIABLES": function.size1_in(0), "PARAMETERS": function.size1_in(1), "ROWS": function.size1_out(1)}
    macros = (f"#define {name} {size}" for name, size in sizes.items())
    return "\n".join([numbers, generate_lane_code(function), *macros, batch])


def generate_lane_code(function: ca.Function) -> str:
    """Return CasADi's C code of a function named ``kernel``, over the numbers of lanes.hpp."""
    generator = ca.CodeGenerator("kernel", {"casadi_real": "Lanes"})
    generator.add(function)
    code = re.sub(r"\((\w+)\?(\w+):0\)", r"if_else_zero(\1,\2)", generator.dump())
    return f"#define __STDC_VERSION__ 199901L  // so that the generated code calls fmin, fmax and fabs of lanes.hpp\n{code}"
