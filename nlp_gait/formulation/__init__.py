"""What a gait problem is, how to make or change one, and a gait of one that was found."""

from nlp_gait.formulation.assembly import (
    Assembly,
    Constraint,
    Grid,
    InstantPoint,
    NumericPoint,
    Objective,
    Over,
    Parameter,
    Point,
    RowsOverTime,
    Variable,
    make_parameters,
)
from nlp_gait.formulation.display import Display, SimulationModel
from nlp_gait.formulation.gait_problem import GaitProblem, SolverHints, Start
from nlp_gait.formulation.registry import list_problems, load, maker
from nlp_gait.formulation.signals import Array, Columns, Signals, make_vector_columns
from nlp_gait.formulation.solution import Result, load_result, sample_at_period, sample_finely, sample_signals

__all__ = [
    "Array",
    "Assembly",
    "Columns",
    "Constraint",
    "Display",
    "GaitProblem",
    "Grid",
    "InstantPoint",
    "NumericPoint",
    "Objective",
    "Over",
    "Parameter",
    "Point",
    "Result",
    "RowsOverTime",
    "Signals",
    "SimulationModel",
    "SolverHints",
    "Start",
    "Variable",
    "list_problems",
    "load",
    "load_result",
    "make_parameters",
    "make_vector_columns",
    "maker",
    "sample_at_period",
    "sample_finely",
    "sample_signals",
]
