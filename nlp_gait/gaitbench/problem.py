"""Instances as gait problems: what the suite holds constant is a parameter there, and equations are narrow bands."""

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
from nlp_gait.gaitbench.definitions import Definition, definition_of
from nlp_gait.symbolic.nonsmooth import Nonsmooth

# No search meets an equation to the last bit: it is a band of this share of its row's scale to either side.
BAND = 1e-2


@maker()
def gaitbench(*, instance: str = "ssp-v5") -> GaitProblem:
    """A problem of the suite, by the id of its instance; raises UnknownNameError."""
    return _made(instance)


@lru_cache(maxsize=64)
def _made(id: str) -> GaitProblem:
    definition = definition_of(id)
    base = load(definition.problem, **definition.options).with_values(**definition.values)
    return _instance(base, definition)


def _instance(base: GaitProblem, definition: Definition) -> GaitProblem:
    """The problem, or a finer one, as the suite has it."""
    banded = held(base, definition.held).derived(
        name="gaitbench", title=f"GaitBench: {definition.what}", change=_with_bands
    )
    problem = replace(banded, searchable=True)
    refine = base.refine
    if refine is None:
        return problem

    def finer(factor: int) -> GaitProblem:
        return _instance(refine(factor).with_values(**definition.values), definition)

    return replace(problem, refine=finer)


def held(problem: GaitProblem, values: Mapping[str, float]) -> GaitProblem:
    """The same problem with some variables as parameters, which have these values.

    Raises:
        UnknownNameError: no such variable.
        InputError: a value outside its bounds.
    """
    if not values:
        return problem
    problem.fix(**values)  # refuses what is not allowed
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
    motion, start = problem.motion, problem.start

    def assemble(point: Point, ops: Nonsmooth) -> Assembly:
        return problem.assemble(point.only(names), ops)

    def signals(at: NumericPoint) -> Signals:
        assert motion is not None  # only then is this called; for the type checker
        return motion(at.only(names))

    def start_point(parameters: Mapping[str, float], rng: np.random.Generator) -> Array:
        assert start is not None  # likewise
        return start({**parameters, **bounds}, rng)[free]

    return replace(
        problem,
        variables=tuple(problem.variables[i] for i in free),
        own_parameters=(*problem.own_parameters, *constants),
        assemble=assemble,
        motion=None if motion is None else signals,
        start=None if start is None else start_point,
        values={name: value for name, value in problem.values.items() if name.rpartition(".")[0] not in values},
    )


def _with_bands(assembly: Assembly, point: Point, ops: Nonsmooth) -> Assembly:
    """The assembly with a band in place of each equation."""
    return replace(assembly, constraints=tuple(_banded(constraint) for constraint in assembly.constraints))


def _banded(constraint: Constraint) -> Constraint:
    lower, upper = constraint.lower, constraint.upper
    if lower is None or upper is None or not _same(lower, upper):
        return constraint
    width = BAND * constraint.scale
    return replace(constraint, lower=lower - width, upper=upper + width)


def _same(lower: ca.MX, upper: ca.MX) -> bool:
    """Whether two bounds are one expression."""
    return lower.shape == upper.shape and bool(ca.is_equal(lower, upper, 2))
