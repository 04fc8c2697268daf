"""Instances as gait problems: variables that the suite holds constant become parameters, and equations narrow bands."""

from dataclasses import replace
from functools import lru_cache

import casadi as ca

from nlp_gait.formulation import Assembly, Constraint, GaitProblem, Point, load, maker
from nlp_gait.gaitbench.facts import Definition
from nlp_gait.gaitbench.generated import define, draw_box, is_generated
from nlp_gait.gaitbench.transform import change_variables, hold_constant
from nlp_gait.symbolic.nonsmooth import Nonsmooth

# No search satisfies an equation to the last bit: it becomes a band of this share of its row's scale to either side.
BAND = 1e-2


@maker
def gaitbench(*, instance: str = "ssp-v5") -> GaitProblem:
    """Make a problem of the suite by the id of its instance, of GaitBench 1 or generated; raises UnknownNameError.

    Source:
        GaitBench, whose instances name their papers.
    """
    return _make(instance)


@lru_cache(maxsize=64)
def _make(id: str) -> GaitProblem:
    definition = define(id)
    problem = _convert(load(definition.problem, **definition.options), definition)
    return change_variables(problem, draw_box(problem, id)) if is_generated(id) else problem


def _convert(base: GaitProblem, definition: Definition) -> GaitProblem:
    base = base.with_values(**definition.values)
    banded = hold_constant(base, definition.held).derive(
        name="gaitbench", title=f"GaitBench: {definition.what}", change=_widen_equations
    )
    problem = replace(banded, hints=replace(banded.hints, searchable=True))
    if (refine := base.refine) is None:
        return problem
    return replace(problem, refine=lambda factor: _convert(refine(factor), definition))


def _widen_equations(assembly: Assembly, point: Point, ops: Nonsmooth) -> Assembly:
    return replace(assembly, constraints=tuple(map(_widen, assembly.constraints)))


def _widen(constraint: Constraint) -> Constraint:
    lower, upper = constraint.lower, constraint.upper
    if lower is None or upper is None or lower.shape != upper.shape or not ca.is_equal(lower, upper, 2):
        return constraint
    width = BAND * constraint.scale
    return replace(constraint, lower=lower - width, upper=upper + width)
