"""What a gait problem is, and how to make or change one."""

from nlp_gait.problem.assembly import Assembly, Constraint, Objective, Parameter, Point, Variable
from nlp_gait.problem.gait_problem import GaitProblem, Grid
from nlp_gait.problem.registry import load, maker, problem_names
from nlp_gait.problem.signals import Columns, Signals

__all__ = [
    "Assembly",
    "Columns",
    "Constraint",
    "GaitProblem",
    "Grid",
    "Objective",
    "Parameter",
    "Point",
    "Signals",
    "Variable",
    "load",
    "maker",
    "problem_names",
]
