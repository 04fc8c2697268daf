"""Compiled functions and derivatives of an NLP for IPOPT.

Compiling takes long, and saves most of the time of each solve: it pays from about ``WORTHWHILE_SOLVES`` solves of one problem
on, or when the cache folder has the functions already (``benchmarks/`` measures all of it).
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from typing import Any

import casadi as ca
from casadi import MX

from nlp_gait.backends.kernel.compiler import find_compiler
from nlp_gait.backends.kernel.library_cache import load_library

# Solves of NAO's single support from which compilation pays: 0.2 s saved on each against some 6 s of compilation.
WORTHWHILE_SOLVES = 40
# Optimisation halves the time of a function and quadruples that of compilation.
FLAGS = ("-O0", "-fvisibility=hidden", "-DGCC_HASCLASSVISIBILITY", "-fno-math-errno", "-ffp-contract=off", "-w")
OPTIMISED_FLAGS = ("-O1", *FLAGS[1:])


def compiled_nlp(
    solver: ca.Function, nlp: Mapping[str, MX], *, optimise: bool = False
) -> tuple[dict[str, MX], dict[str, Any]]:
    """What a new solver needs to use compiled functions in place of those that another solver interprets.

    Args:
        solver: an ``nlpsol`` of the NLP, whose functions are taken.
        nlp: CasADi's dictionary that it was made from: x, p, f, g.
        optimise: compile for speed, which takes about four times as long and makes evaluations twice as fast.

    Returns:
        The NLP and the options to make the new solver with; the options make sensitivities to p unavailable.

    Raises:
        CompilerError: there is no compiler, or it fails.
    """
    derivatives = derivatives_of(solver)
    values = [solver.get_function(name) for name in ("nlp_f", "nlp_g")]
    f, g, *others = compiled_functions([*values, *derivatives.values()], optimise=optimise)
    x, p = nlp["x"], nlp["p"]
    options = {"no_nlp_grad": True, "calc_lam_p": False, **dict(zip(derivatives, others, strict=True))}
    return {"x": x, "p": p, "f": f(x, p), "g": g(x, p)}, options


def derivatives_of(solver: ca.Function) -> dict[str, ca.Function]:
    """Derivatives that an ``nlpsol`` has, by the option with which a new one takes them over."""
    names = {"grad_f": "nlp_grad_f", "jac_g": "nlp_jac_g", "hess_lag": "nlp_hess_l"}
    return {option: solver.get_function(name) for option, name in names.items() if solver.has_function(name)}


@contextmanager
def one_direction_at_a_time() -> Iterator[None]:
    """Derivatives that are made inside work in one direction a call, not in up to 64.

    Of a long function they are a twentieth of the code, which compiles in as much less time and stays in the CPU's caches.
    """
    before = ca.GlobalOptions.getMaxNumDir()
    ca.GlobalOptions.setMaxNumDir(1)
    try:
        yield
    finally:
        ca.GlobalOptions.setMaxNumDir(before)


def compiled_functions(functions: Sequence[ca.Function], *, optimise: bool = False) -> list[ca.Function]:
    """The same functions as machine code, built side by side, once, and kept in the cache folder.

    Args:
        functions: with inputs and outputs of any shape.
        optimise: compile for speed.

    Raises:
        CompilerError: there is no compiler, or it fails.
    """
    compiler, flags = find_compiler(), OPTIMISED_FLAGS if optimise else FLAGS
    sources = [_source(function) for function in functions]

    def library(function: ca.Function, source: str) -> str:
        return str(load_library(source, compiler, flags, (function.name(),))[1])

    with ThreadPoolExecutor() as pool:
        libraries = list(pool.map(library, functions, sources))
    return [ca.external(function.name(), file) for function, file in zip(functions, libraries, strict=True)]


def _source(function: ca.Function) -> str:
    generator = ca.CodeGenerator("functions")
    generator.add(function)
    return f'#include <math.h>\nextern "C" {{\n{generator.dump()}\n}}\n'
