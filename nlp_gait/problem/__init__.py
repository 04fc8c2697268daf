"""What a gait problem is, how to make or change one, and a gait of one that was found."""

from nlp_gait.problem.assembly import (
    Assembly,
    Constraint,
    InstantPoint,
    NumericPoint,
    Objective,
    Over,
    Parameter,
    Point,
    Stretch,
    Variable,
    parameters,
)
from nlp_gait.problem.gait_problem import GaitProblem, Start
from nlp_gait.problem.motion.grid import Grid
from nlp_gait.problem.motion.playback import Playback
from nlp_gait.problem.motion.signals import Array, Columns, Signals, in_space
from nlp_gait.problem.registry import load, maker, problem_names
from nlp_gait.problem.result import Result, load_result
from nlp_gait.problem.sampling import finely_sampled, sampled

__all__ = [
    "Array",
    "Assembly",
    "Columns",
    "Constraint",
    "GaitProblem",
    "Grid",
    "InstantPoint",
    "NumericPoint",
    "Objective",
    "Over",
    "Parameter",
    "Playback",
    "Point",
    "Result",
    "Signals",
    "Start",
    "Stretch",
    "Variable",
    "finely_sampled",
    "in_space",
    "load",
    "load_result",
    "maker",
    "parameters",
    "problem_names",
    "sampled",
]
