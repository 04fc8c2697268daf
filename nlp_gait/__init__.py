"""Biped gait problems, written once as symbolic CasADi models.

``load`` makes a problem; ``solve`` gives it to IPOPT, or to another NLP ``solver``; ``compile_objective`` gives its exact
functions to search algorithms.
"""

from nlp_gait.backends.kernel.compiled import CompiledObjective, compile_objective
from nlp_gait.backends.solve import solve
from nlp_gait.backends.solvers.ipopt import IpoptSettings
from nlp_gait.backends.solvers.registry import solver
from nlp_gait.errors import GaitError
from nlp_gait.problem import GaitProblem, load, problem_names
from nlp_gait.problem.solution import Solution

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
    "solver",
]
