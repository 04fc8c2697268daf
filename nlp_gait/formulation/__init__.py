"""What a gait problem is, how to make or change one, and a gait of one that was found."""

from nlp_gait.formulation.assembly import Assembly as Assembly
from nlp_gait.formulation.assembly import Constraint as Constraint
from nlp_gait.formulation.assembly import Grid as Grid
from nlp_gait.formulation.assembly import InstantPoint as InstantPoint
from nlp_gait.formulation.assembly import NumericPoint as NumericPoint
from nlp_gait.formulation.assembly import Objective as Objective
from nlp_gait.formulation.assembly import Over as Over
from nlp_gait.formulation.assembly import Parameter as Parameter
from nlp_gait.formulation.assembly import Point as Point
from nlp_gait.formulation.assembly import RowsOverTime as RowsOverTime
from nlp_gait.formulation.assembly import Variable as Variable
from nlp_gait.formulation.assembly import parameters as parameters
from nlp_gait.formulation.display import Display as Display
from nlp_gait.formulation.display import SimulationModel as SimulationModel
from nlp_gait.formulation.gait_problem import GaitProblem as GaitProblem
from nlp_gait.formulation.gait_problem import SolverHints as SolverHints
from nlp_gait.formulation.gait_problem import Start as Start
from nlp_gait.formulation.registry import load as load
from nlp_gait.formulation.registry import maker as maker
from nlp_gait.formulation.registry import problem_names as problem_names
from nlp_gait.formulation.result import Result as Result
from nlp_gait.formulation.result import load_result as load_result
from nlp_gait.formulation.result import sample_finely as sample_finely
from nlp_gait.formulation.result import sample_signals as sample_signals
from nlp_gait.formulation.signals import Array as Array
from nlp_gait.formulation.signals import Columns as Columns
from nlp_gait.formulation.signals import Signals as Signals
from nlp_gait.formulation.signals import vector_columns as vector_columns

__all__ = (
    "Array Assembly Columns Constraint Display GaitProblem Grid InstantPoint NumericPoint Objective Over Parameter Point Result "
    "RowsOverTime Signals SimulationModel SolverHints Start Variable sample_finely vector_columns load load_result maker "
    "parameters problem_names sample_signals"
).split()
