"""Instances as gait problems: variables that the suite holds constant become parameters, and equations narrow bands."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache

import casadi as ca
import numpy as np

from nlp_gait.formulation import (
    Array,
    Assembly,
    Constraint,
    GaitProblem,
    NumericPoint,
    Parameter,
    Point,
    Signals,
    load,
    maker,
)
from nlp_gait.gaitbench.definitions import Definition
from nlp_gait.gaitbench.generated import define, draw_box, is_generated
from nlp_gait.gaitbench.transform import change_variables
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
    refine = base.refine
    if refine is None:
        return problem
    return replace(problem, refine=lambda factor: _convert(refine(factor), definition))


def hold_constant(problem: GaitProblem, values: Mapping[str, float]) -> GaitProblem:
    """Return the same problem with some variables as parameters, which have these values.

    Raises:
        UnknownNameError: no such variable.
        InputError: a value outside its bounds.
    """
    if not values:
        return problem
    problem.fix(**values)  # raises
    names = problem.names
    free = [i for i, name in enumerate(names) if name not in values]
    constants = tuple(
        Parameter(
            name=v.name,
            unit=v.unit,
            default=values[v.name],
            description=v.description,
            minimum=v.lower,
            maximum=v.upper,
        )
        for v in problem.variables
        if v.name in values
    )
    bounds = {f"{name}.{end}": value for name, value in values.items() for end in ("lower", "upper")}
    motion, start = problem.display.motion, problem.hints.start

    def assemble(point: Point, ops: Nonsmooth) -> Assembly:
        return problem.assemble(point.select(names), ops)

    def signals(at: NumericPoint) -> Signals:
        assert motion is not None  # for the type checker
        return motion(at.select(names))

    def start_point(parameters: Mapping[str, float], rng: np.random.Generator) -> Array:
        assert start is not None
        return start({**parameters, **bounds}, rng)[free]

    return replace(
        problem,
        variables=tuple(problem.variables[i] for i in free),
        own_parameters=(*problem.own_parameters, *constants),
        assemble=assemble,
        display=replace(problem.display, motion=None if motion is None else signals),
        hints=replace(problem.hints, start=None if start is None else start_point),
        values={name: value for name, value in problem.values.items() if name.rpartition(".")[0] not in values},
    )


def _widen_equations(assembly: Assembly, point: Point, ops: Nonsmooth) -> Assembly:
    return replace(assembly, constraints=tuple(map(_widen, assembly.constraints)))


def _widen(constraint: Constraint) -> Constraint:
    lower, upper = constraint.lower, constraint.upper
    if lower is None or upper is None or lower.shape != upper.shape or not ca.is_equal(lower, upper, 2):
        return constraint
    width = BAND * constraint.scale
    return replace(constraint, lower=lower - width, upper=upper + width)
