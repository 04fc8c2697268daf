"""Biped gait problems, written once as symbolic CasADi models.

``load`` makes a problem; ``solve`` gives it to IPOPT, or to another NLP solver (``make_solver``); ``compile_objective`` gives its
exact functions to search algorithms.
"""

from __future__ import annotations

from nlp_gait.providers import PROBLEMS, import_object

# In place of typing's, whose import takes longer than all that Ctrl-C waits for; type checkers know the name.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from compare.report.compared_study import compare as compare
    from nlp_gait.backends.kernel.compiled import CompiledObjective as CompiledObjective
    from nlp_gait.backends.kernel.compiled import compile_objective as compile_objective
    from nlp_gait.backends.plan_walk import WalkPlan as WalkPlan
    from nlp_gait.backends.plan_walk import WalkSettings as WalkSettings
    from nlp_gait.backends.plan_walk import plan_climb as plan_climb
    from nlp_gait.backends.plan_walk import plan_route as plan_route
    from nlp_gait.backends.plan_walk import plan_walk as plan_walk
    from nlp_gait.backends.solve import solve as solve
    from nlp_gait.backends.solvers.ipopt import IpoptSettings as IpoptSettings
    from nlp_gait.backends.solvers.registry import make_solver as make_solver
    from nlp_gait.errors import GaitError as GaitError
    from nlp_gait.formulation import GaitProblem as GaitProblem
    from nlp_gait.formulation import list_problems as list_problems
    from nlp_gait.formulation.plain_problem import problem as problem
    from nlp_gait.formulation.solution import Solution as Solution

__version__ = "0.2.0"
# Imported on first use: a search needs no NLP solver, a solve no kernel, and the command line starts quickly.
_PUBLIC = {
    "nlp_gait.errors": "GaitError",
    "nlp_gait.formulation": "GaitProblem list_problems",
    "nlp_gait.formulation.plain_problem": "problem",
    "nlp_gait.formulation.solution": "Solution",
    "nlp_gait.backends.kernel.compiled": "CompiledObjective compile_objective",
    "nlp_gait.backends.plan_walk": "WalkPlan WalkSettings plan_climb plan_route plan_walk",
    "nlp_gait.backends.solve": "solve",
    "nlp_gait.backends.solvers.ipopt": "IpoptSettings",
    "nlp_gait.backends.solvers.registry": "make_solver",
}
_PLACES = {name: f"{module}:{name}" for module, names in _PUBLIC.items() for name in names.split()}
__all__ = sorted([*_PLACES, "compare", "load"])


def load(name: str, /, **options: str | int | float | bool) -> GaitProblem:
    """Return a problem, see ``find_maker``, or an instance of GaitBench, ``load("ssp-v5")`` or ``load("gb2:ssp:3")``, by name.

    It is built with the given options; the others keep their defaults. A problem of this package with equal options is made
    once, unless they name a file. Raises UnknownNameError, and InputError for a value that the option does not allow, or user
    code that fails.
    """
    from nlp_gait.formulation.registry import load as load_problem

    if isinstance(name, str) and name not in PROBLEMS:
        from nlp_gait.gaitbench.generated import resolve_name

        name, instance = resolve_name(name)
        options = {**instance, **options}
    return load_problem(name, **options)


def __getattr__(name: str) -> Any:
    """Import or read a public name when it is first used."""
    if name == "compare":
        from compare.report.compared_study import compare

        return compare
    if name not in _PLACES:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return import_object(_PLACES[name])
