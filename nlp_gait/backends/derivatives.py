"""Compiled versions of CasADi functions, such as the derivatives that IPOPT asks for."""

from __future__ import annotations

from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor

import casadi as ca

from nlp_gait.backends.compiler import find_compiler
from nlp_gait.backends.library_cache import load_library

FLAGS = ("-O1", "-fvisibility=hidden", "-DGCC_HASCLASSVISIBILITY", "-fno-math-errno", "-ffp-contract=off", "-w")


def compiled_functions(functions: Sequence[ca.Function]) -> list[ca.Function]:
    """The same functions as machine code, built once and kept in the cache folder.

    Raises:
        CompilerError: there is no compiler, or it fails.
    """
    compiler = find_compiler()

    def compiled(function: ca.Function) -> ca.Function:
        generator = ca.CodeGenerator("functions")
        generator.add(function)
        source = f'#include <math.h>\nextern "C" {{\n{generator.dump()}\n}}\n'
        _, library = load_library(source, compiler, FLAGS, (function.name(),))
        return ca.external(function.name(), str(library))

    with ThreadPoolExecutor() as pool:
        return list(pool.map(compiled, functions))
