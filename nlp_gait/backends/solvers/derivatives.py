"""When NLP solvers use compiled functions, and how one takes over the derivatives of another."""

from __future__ import annotations

import casadi as ca

from nlp_gait.backends.derivatives.compiled import DERIVATIVES
from nlp_gait.backends.nlp import build_nlp
from nlp_gait.formulation import GaitProblem

# Solves times the NLP's variables from which compilation pays. NAO's single support, 174 variables: 0.2 s saved on each solve
# against 2.5 s of compilation; its free joints, 3,900 variables: over a minute on each against 8 s.
WORTHWHILE_SIZE = 1500


def compilation_pays(problem: GaitProblem, solves: int) -> bool:
    """Whether solves take so long, or are so many, that compilation pays.

    What the cache folder holds has no say: compiled and interpreted functions differ in the last bits, and the same call gives
    the same result.
    """
    return solves * build_nlp(problem).nlp["x"].shape[0] >= WORTHWHILE_SIZE


def get_derivatives(solver: ca.Function) -> dict[str, ca.Function]:
    """Derivatives that an ``nlpsol`` has, by the option with which a new one takes them over."""
    return {option: solver.get_function(name) for option, name in DERIVATIVES.items() if solver.has_function(name)}
