"""Biped gait problems, written once as symbolic CasADi models.

``load`` makes a problem; ``solve`` gives it to IPOPT, or to another NLP solver (``make_solver``); ``compile_objective`` gives its
exact functions to search algorithms, and ``compile_function`` compiles any CasADi function for batches.
"""

from __future__ import annotations

from nlp_gait.providers import FILE_HASHES, FUNCTIONS, PROBLEMS, import_object

# In place of typing's, whose import takes longer than all that Ctrl-C waits for; type checkers know the name.
TYPE_CHECKING = False
if TYPE_CHECKING:
    from typing import Any

    from nlp_gait.backends.functions.compiled_function import CompiledFunction, compile_function
    from nlp_gait.backends.kernel.compiled import CompiledObjective, compile_objective
    from nlp_gait.backends.onboard.replanner import Replan, Replanner, replanner
    from nlp_gait.backends.optima.gait_library import GaitLibrary, LibraryGait, load_library
    from nlp_gait.backends.plan_walk import WalkPlan, plan_walk
    from nlp_gait.backends.solve import solve
    from nlp_gait.backends.solvers.ipopt import IpoptSettings
    from nlp_gait.backends.solvers.registry import make_solver
    from nlp_gait.errors import GaitError
    from nlp_gait.formulation import GaitProblem, load, problem_names
    from nlp_gait.formulation.solution import Solution

# Imported on first use: a search needs no NLP solver, a solve no kernel, and the command line starts quickly.
_LAZY = {
    "GaitError": "nlp_gait.errors:GaitError",
    "GaitProblem": "nlp_gait.formulation:GaitProblem",
    "load": "nlp_gait.formulation:load",
    "problem_names": "nlp_gait.formulation:problem_names",
    "CompiledObjective": "nlp_gait.backends.kernel.compiled:CompiledObjective",
    "compile_objective": "nlp_gait.backends.kernel.compiled:compile_objective",
    "CompiledFunction": "nlp_gait.backends.functions.compiled_function:CompiledFunction",
    "compile_function": "nlp_gait.backends.functions.compiled_function:compile_function",
    "IpoptSettings": "nlp_gait.backends.solvers.ipopt:IpoptSettings",
    "Solution": "nlp_gait.formulation.solution:Solution",
    "WalkPlan": "nlp_gait.backends.plan_walk:WalkPlan",
    "plan_walk": "nlp_gait.backends.plan_walk:plan_walk",
    "solve": "nlp_gait.backends.solve:solve",
    "GaitLibrary": "nlp_gait.backends.optima.gait_library:GaitLibrary",
    "LibraryGait": "nlp_gait.backends.optima.gait_library:LibraryGait",
    "load_library": "nlp_gait.backends.optima.gait_library:load_library",
    "Replan": "nlp_gait.backends.onboard.replanner:Replan",
    "Replanner": "nlp_gait.backends.onboard.replanner:Replanner",
    "replanner": "nlp_gait.backends.onboard.replanner:replanner",
    "make_solver": "nlp_gait.backends.solvers.registry:make_solver",
}
# What lower packages use of higher ones, by name.
PROBLEMS.update(
    {
        "nao-ssp": "nlp_gait.gaits.nao.problems:nao_ssp",
        "nao-dsp": "nlp_gait.gaits.nao.problems:nao_dsp",
        "nao-walk": "nlp_gait.gaits.nao.problems:nao_walk",
        "nao-ssp-free": "nlp_gait.gaits.nao.problems:nao_ssp_free",
        "nao-dsp-free": "nlp_gait.gaits.nao.problems:nao_dsp_free",
        "nao-cycle": "nlp_gait.gaits.nao.problems:nao_cycle",
        "humanoid-ssp": "nlp_gait.gaits.humanoid.problems:humanoid_ssp",
        "humanoid-dsp": "nlp_gait.gaits.humanoid.problems:humanoid_dsp",
        "humanoid-cycle": "nlp_gait.gaits.humanoid.problems:humanoid_cycle",
        "humanoid-walk": "nlp_gait.gaits.humanoid.problems:humanoid_walk",
        "walk12": "nlp_gait.gaits.walk12.walk12_problem:walk12",
        "stairs-plan": "nlp_gait.gaits.stairs.plan:stairs_plan",
        "stairs-track": "nlp_gait.gaits.stairs.track:stairs_track",
        "stairs-ideal": "nlp_gait.gaits.stairs.ideal:stairs_ideal",
        "gaitbench": "nlp_gait.gaitbench.suite_problem:gaitbench",
    }
)
FILE_HASHES["robot"] = "nlp_gait.robots.loading:hash_robot"
FUNCTIONS["resolve_instance"] = "nlp_gait.gaitbench.generated:resolve_instance"
FUNCTIONS["load_generated"] = "nlp_gait.gaitbench.instance:load_generated"
FUNCTIONS["tabulate_sensitivities"] = "nlp_gait.backends.optima.sensitivities:tabulate_sensitivities"
FUNCTIONS["plot_gait"] = "compare.drawing.gait_figure:plot_gait"
FUNCTIONS["animate_gait"] = "compare.report.gait_page:animate_gait"

__all__ = [
    "CompiledFunction",
    "CompiledObjective",
    "GaitError",
    "GaitLibrary",
    "GaitProblem",
    "IpoptSettings",
    "LibraryGait",
    "Replan",
    "Replanner",
    "Solution",
    "WalkPlan",
    "compile_function",
    "compile_objective",
    "load",
    "load_library",
    "plan_walk",
    "problem_names",
    "replanner",
    "solve",
    "make_solver",
]


def __getattr__(name: str) -> Any:
    """Import or read a public name when it is first used."""
    if name == "__version__":
        from importlib.metadata import version

        return version("nlp-gait")
    if name not in _LAZY:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return import_object(_LAZY[name])
