"""C++ source of a problem's kernel: CasADi's generated code over a vector type, and a loop over candidates."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

import casadi as ca
import numpy as np

from nlp_gait.backends.exact import ExactModel, build_exact_model
from nlp_gait.backends.kernel.compiler import read_native_source
from nlp_gait.formulation import Array, GaitProblem
from nlp_gait.formulation.locking import one_at_a_time

SYMBOLS = ("nlp_gait_lanes", "nlp_gait_workspace_bytes", "nlp_gait_evaluate")


@dataclass(frozen=True, kw_only=True, eq=False)
class Kernel:
    """What is evaluated for each candidate, apart from what depends on parameters only.

    Attributes:
        function: (x, p) to cost and g (m,).
        bounds: p to lower and upper (m,).
        weights: (m,) 1 / scale of each row.
        model: the exact model that both are part of.
    """

    function: ca.Function
    bounds: ca.Function
    weights: Array
    model: ExactModel

    @one_at_a_time
    def row_bounds(self, problem: GaitProblem) -> tuple[Array, Array]:
        """Lower and upper bounds (m,) of the rows for the problem's parameter values."""
        lower, upper = (np.array(bound, dtype=float).ravel() for bound in self.bounds(problem.p))
        return lower, upper


def build_kernel(problem: GaitProblem) -> Kernel:
    """Kernel of a problem, built once for all copies that differ in parameter values only."""
    return problem.build_once(_kernel)


def _kernel(problem: GaitProblem) -> Kernel:
    model = build_exact_model(problem)
    x, p = model.function.mx_in()
    cost, _, g, lower, upper, _ = model.function.call([x, p], True, False)
    return Kernel(
        function=ca.Function("kernel", [x, p], [cost, g]),
        bounds=ca.Function("bounds", [p], [lower, upper]),
        weights=1.0 / model.row_scales,
        model=model,
    )


def write_kernel_source(function: ca.Function) -> str:
    """C++ source; the lane count is the macro LANES.

    Args:
        function: (x, p) to cost and g.
    """
    generator = ca.CodeGenerator("kernel", {"casadi_real": "Lanes"})
    generator.add(function)
    sizes = {
        "VARIABLES": function.size1_in(0),
        "PARAMETERS": function.size1_in(1),
        "ROWS": function.size1_out(1),
    }
    return assembled_source("lanes.hpp", generator.dump(), sizes, "batch.hpp")


def assembled_source(numbers: str, generated: str, sizes: Mapping[str, int], loop: str) -> str:
    """C++ source from CasADi's generated code.

    Args:
        numbers: header of the type that the code computes with.
        generated: by CasADi.
        sizes: macros.
        loop: header of the functions that call it.
    """
    return "\n".join(
        [
            read_native_source("nlp_gait.backends.kernel", numbers),
            f"#define __STDC_VERSION__ 199901L  // so that the generated code calls fmin, fmax and fabs of {numbers}",
            re.sub(r"\((\w+)\?(\w+):0\)", r"if_else_zero(\1,\2)", generated),
            *(f"#define {name} {size}" for name, size in sizes.items()),
            read_native_source("nlp_gait.backends.kernel", loop),
        ]
    )
