"""Biped gait problems, written once as symbolic CasADi models.

``load`` makes a problem; ``solve`` gives it to IPOPT, or to another NLP solver (``make_solver``); ``compile_objective`` gives its
exact functions to search algorithms.
"""

from __future__ import annotations

# In place of typing's, whose import takes longer than all that Ctrl-C waits for; type checkers know the name.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from nlp_gait.backends.kernel.compiled import CompiledObjective, compile_objective
    from nlp_gait.backends.solve import solve
    from nlp_gait.backends.solvers.ipopt import IpoptSettings
    from nlp_gait.backends.solvers.registry import make_solver
    from nlp_gait.errors import GaitError
    from nlp_gait.formulation import GaitProblem, load, problem_names
    from nlp_gait.formulation.solution import Solution

# Imported when first used: a search needs no NLP solver, a solve no kernel, and the command line begins at once.
_LATER = {
    "GaitError": "nlp_gait.errors",
    "GaitProblem": "nlp_gait.formulation",
    "load": "nlp_gait.formulation",
    "problem_names": "nlp_gait.formulation",
    "CompiledObjective": "nlp_gait.backends.kernel.compiled",
    "compile_objective": "nlp_gait.backends.kernel.compiled",
    "IpoptSettings": "nlp_gait.backends.solvers.ipopt",
    "Solution": "nlp_gait.formulation.solution",
    "solve": "nlp_gait.backends.solve",
    "make_solver": "nlp_gait.backends.solvers.registry",
}

__all__ = [
    "CompiledObjective",
    "GaitError",
    "GaitProblem",
    "IpoptSettings",
    "Solution",
    "compile_objective",
    "load",
    "problem_names",
    "solve",
    "make_solver",
]


def __getattr__(name: str) -> Any:
    """Import or read a public name when it is first used."""
    from importlib import import_module

    if name == "__version__":
        from importlib.metadata import version

        return version("nlp-gait")
    if name not in _LATER:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(_LATER[name]), name)
