"""When NLP solvers use compiled functions, and how one takes over the derivatives of another."""

from __future__ import annotations

import casadi as ca

from nlp_gait.backends.derivatives.compiled import CompiledNlp, is_built
from nlp_gait.backends.nlp import nlp_model
from nlp_gait.errors import CompilerError
from nlp_gait.problem import GaitProblem

__all__ = ["CompiledNlp", "derivatives_of", "worthwhile"]

# Solves of NAO's single support from which compilation pays: 0.2 s saved on each against 2.5 s of compilation.
WORTHWHILE_SOLVES = 12


def worthwhile(problem: GaitProblem, solves: int, *, second: bool) -> bool:
    """Whether compiled functions pay: one solve takes long, or there are many, or the cache folder has them already."""
    if problem.long_derivatives or solves >= WORTHWHILE_SOLVES:
        return True
    try:
        return is_built(nlp_model(problem).nlp, second=second)
    except CompilerError:
        return False


def derivatives_of(solver: ca.Function) -> dict[str, ca.Function]:
    """Derivatives that an ``nlpsol`` has, by the option with which a new one takes them over."""
    names = {"grad_f": "nlp_grad_f", "jac_g": "nlp_jac_g", "hess_lag": "nlp_hess_l"}
    return {option: solver.get_function(name) for option, name in names.items() if solver.has_function(name)}
