"""An instance as plain C++ with a C header: no dependency but libc and libm."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from pathlib import Path

from nlp_gait.backends.kernel.compiler import BASE_FLAGS, read_native_source
from nlp_gait.backends.kernel.kernel_source import build_kernel, write_kernel_source
from nlp_gait.export.c_files import format_comment, write_c_files
from nlp_gait.formulation import Array
from nlp_gait.gaitbench.instance import Instance, OneSidedRows

# Name of each file by its template; the C++ file is put together from the kernel.
TEMPLATES = {
    "{prefix}.h": "objective.h.in",
    "main.c": "main.c.in",
    "{prefix}_mex.cpp": "mex.cpp.in",
    "{prefix}_example.m": "caller.m.in",
    "{prefix}_example.jl": "caller.jl.in",
    "build.sh": "build.sh.in",
}


def export_objective(instance: Instance, folder: Path) -> list[Path]:
    """Write source, header, example, callers and build line of an instance in physical units; raises OutputError."""
    instance = Instance(instance.id)
    sides = OneSidedRows(build_kernel(instance.gait_problem), instance.gait_problem)
    prefix = make_prefix(instance.id)
    words = _make_words(instance, sides, prefix)
    return write_c_files(folder, "nlp_gait.gaitbench", TEMPLATES, words, make_cpp_source(instance, sides))


def make_prefix(id: str) -> str:
    """Return the prefix of all C names, such as ``gaitbench_ssp_v5``."""
    return f"gaitbench_{id.replace('-', '_')}"


def make_cpp_source(instance: Instance, sides: OneSidedRows) -> str:
    """Return the C++ file: the kernel over lanes, the instance's constants, the functions of the header."""
    problem = instance.gait_problem
    kernel = build_kernel(problem)
    lower, upper = kernel.row_bounds(problem)
    prefix = make_prefix(instance.id)
    constants = {
        "instance_parameters": problem.p,
        "instance_lower": lower,
        "instance_upper": upper,
        "instance_weights": kernel.weights,
    }
    known = {"lower": instance.lower, "upper": instance.upper, "best_x": instance.best_x}
    names = {"variable_names": instance.names, "row_names": sides.names}
    return "\n".join(
        [
            f"// GaitBench instance {instance.id}; see {prefix}.h. Generated: change nothing here.",
            f'#pragma GCC visibility push(default)\n#include "{prefix}.h"\n#pragma GCC visibility pop',
            "#ifndef LANES\n#define LANES 1  // points at a time: 1, 2, 4 or 8\n#endif",
            "#include <math.h>\n#include <stdlib.h>\n#include <string.h>",
            "namespace {  // so that a program can have several instances",
            write_kernel_source(kernel.function).replace('extern "C" EXPORT', "static"),
            "}  // namespace",
            *(f"static const double {name}[] = {_numbers(values)};" for name, values in constants.items()),
            f"static const int instance_rows[] = {{{', '.join(map(str, sides.row.tolist()))}}};",
            f"static const char instance_upper_side[] = {{{', '.join('1' if s > 0 else '0' for s in sides.sign)}}};",
            *(f'extern "C" const double {prefix}_{name}[] = {_numbers(values)};' for name, values in known.items()),
            *(f'extern "C" const char* const {prefix}_{name}[] = {_texts(values)};' for name, values in names.items()),
            f"#define SIDES {len(sides.names)}",
            f"#define FUNCTION {prefix}_evaluate",
            read_native_source("nlp_gait.gaitbench", "objective.hpp"),
        ]
    )


def _make_words(instance: Instance, sides: OneSidedRows, prefix: str) -> Mapping[str, str]:
    problem, definition = instance.gait_problem, instance.definition
    unit = problem.objective.unit
    return {
        "ID": instance.id,
        "WHAT": definition.what,
        "SOURCE": definition.source,
        "BEST": repr(instance.best_known),
        "EVIDENCE": str(instance.evidence),
        "N": str(len(instance.names)),
        "M": str(len(sides.names)),
        "MEMORY": "100 kB" if len(sides.names) < 1000 else "1 MB",
        "UNIT": "" if unit == "1" else f" [{unit}]",
        "PREFIX": prefix,
        "GUARD": f"{prefix.upper()}_H",
        "FLAGS": " ".join(flag for flag in BASE_FLAGS if flag != "-w") + " -w",
        "BEST_X": ", ".join(map(repr, instance.best_x.tolist())),
        "VARIABLES": format_comment(
            f"{k:4d}  {v.name} [{v.unit}] from {low:g} to {high:g}: {v.description}"
            for k, (v, low, high) in enumerate(zip(problem.variables, instance.lower, instance.upper, strict=True))
        ),
        "PARAMETERS": format_comment(
            f"{q.name} = {value:g} [{q.unit}]: {q.description}"
            for q, value in zip(problem.own_parameters, problem.p, strict=False)
        ),
    }


def _numbers(values: Array) -> str:
    return "{" + ", ".join(repr(v).replace("inf", "INFINITY") for v in values.tolist()) + "}"


def _texts(values: Sequence[str]) -> str:
    return "{" + ", ".join(json.dumps(value) for value in values) + "}"
