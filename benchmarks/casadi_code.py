"""CasADi's own C code of functions, compiled: what our code is compared with."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import casadi as ca

from nlp_gait.backends.kernel.compiler import find_compiler, load_library

FLAGS = ("-fvisibility=hidden", "-DGCC_HASCLASSVISIBILITY", "-fno-math-errno", "-ffp-contract=off", "-w")


def compiled_functions(functions: Sequence[ca.Function], flags: Sequence[str] = ("-O1", *FLAGS)) -> list[ca.Function]:
    """The same functions as machine code, built side by side, once, and kept in the cache folder.

    Args:
        functions: with inputs and outputs of any shape.
        flags: of the compiler.

    Raises:
        CompilerError: there is no compiler, or it fails.
    """
    compiler = find_compiler()

    def library(function: ca.Function) -> str:
        return str(load_library(_source(function), compiler, flags, (function.name(),))[1])

    with ThreadPoolExecutor() as pool:
        libraries = list(pool.map(library, functions))
    return [ca.external(function.name(), file) for function, file in zip(functions, libraries, strict=True)]


def _source(function: ca.Function) -> str:
    generator = ca.CodeGenerator("functions")
    generator.add(function)
    return f'#include <math.h>\nextern "C" {{\n{generator.dump()}\n}}\n'
