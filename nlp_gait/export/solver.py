"""Export of a problem's NLP with its derivatives as C++ with a C header, for a solver on board; needs only libc and libm."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path

import numpy as np

from nlp_gait.backends.derivatives.assembly import NlpPlan, make_nlp_plan
from nlp_gait.backends.derivatives.compiled import FLAGS
from nlp_gait.backends.derivatives.operations import format_number
from nlp_gait.backends.derivatives.source import write_array, write_nlp_source
from nlp_gait.backends.derivatives.structure import split_nlp
from nlp_gait.backends.kernel.compiler import read_native_source
from nlp_gait.backends.nlp import WIDTHS, NlpModel, build_nlp
from nlp_gait.export.c_files import format_comment, write_c_files
from nlp_gait.formulation import GaitProblem
from nlp_gait.formulation.locking import lock_casadi

# Name of each file by its template; the C++ file is assembled from the plan.
TEMPLATES = {"{prefix}.h": "solver.h.in", "main.c": "solver_main.c.in", "build.sh": "solver_build.sh.in"}
BOUNDS = {"w_lower": "lbx", "w_upper": "ubx", "g_lower": "lbg", "g_upper": "ubg"}


@lock_casadi
def export_solver(problem: GaitProblem, folder: Path) -> list[Path]:
    """Write source, header, example and build line of a problem's NLP with its parameter values; return the files.

    Raises:
        CompilerError: the NLP has an operation without C++ code.
        OutputError: the folder cannot be written to.
    """
    model = build_nlp(problem)
    found = make_nlp_plan(split_nlp(model.nlp))
    prefix = f"{problem.name.replace('-', '_')}_nlp"
    words = _words(problem, model, found, prefix)
    source = _source(problem, model, found, prefix)
    return write_c_files(folder, "nlp_gait.export", TEMPLATES, words, source)


def _source(problem: GaitProblem, model: NlpModel, found: NlpPlan, prefix: str) -> str:
    """Return the C++ file: the plan and its interpreter, constants, the functions of the header."""
    width = model.widths[-1]
    bounds = model.bounds(problem)
    constants = {
        "p": np.append(problem.p, width),
        "w_start": model.start(problem, (problem.lower + problem.upper) / 2, width),
        **{name: bounds[end] for name, end in BOUNDS.items()},
        "offset": model.offset,
        "scale": model.scale,
    }
    sparsities = {"jacobian": found.jacobian, "hessian": found.hessian}
    starts = {f"{name}_starts": sparsity.colind() for name, sparsity in sparsities.items()}
    rows = {f"{name}_rows": [*sparsity.row(), 0] for name, sparsity in sparsities.items()}
    return "\n".join(
        [
            f"// The NLP of {problem.address}; see {prefix}.h. Generated: change nothing here.",
            f'#pragma GCC visibility push(default)\n#include "{prefix}.h"\n#pragma GCC visibility pop',
            "#ifndef LANES\n#define LANES 1  // pairs of a sample and a direction at a time: 1, 2, 4 or 8\n#endif",
            "#include <math.h>\n#include <stdlib.h>\n#include <string.h>",
            "namespace {  // so that a program can have several problems",
            write_nlp_source(found).replace('extern "C" EXPORT', "static"),
            "}  // namespace",
            *(
                _constant("double", f"{prefix}_{name}", map(format_number, values.tolist()))
                for name, values in constants.items()
            ),
            *(_constant("long long", f"{prefix}_{name}", values) for name, values in {**starts, **rows}.items()),
            read_native_source("nlp_gait.export", "solver_functions.cpp.in").replace("@PREFIX@", prefix),
        ]
    )


def _constant(kind: str, name: str, values: Iterable[object]) -> str:
    return write_array(kind, name, values).replace("static const", 'extern "C" const', 1)


def _words(problem: GaitProblem, model: NlpModel, found: NlpPlan, prefix: str) -> Mapping[str, str]:
    m, n = found.jacobian.shape
    return {
        "WHAT": f"{problem.address}: {problem.title}",
        "N": str(n),
        "M": str(m),
        "K": str(found.parameters),
        "VARIABLES_COUNT": str(model.variables),
        "WIDTH": repr(WIDTHS[-1]),
        "JACOBIAN": str(found.jacobian.nnz()),
        "HESSIAN": str(found.hessian.nnz()),
        "PREFIX": prefix,
        "GUARD": f"{prefix.upper()}_H",
        "FLAGS": " ".join(FLAGS),
        "VARIABLES": format_comment(
            f"{k:4d}  {v.name} [{v.unit}]: {v.description}" for k, v in enumerate(problem.variables)
        ),
        "PARAMETERS": format_comment(
            f"{k:4d}  {q.name} = {value:g} [{q.unit}]: {q.description}"
            for k, (q, value) in enumerate(zip(problem.parameters, problem.p, strict=True))
        ),
    }
