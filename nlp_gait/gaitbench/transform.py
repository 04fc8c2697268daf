"""The same problem in other variables: with some held constant, or x = A z + b with the bounds of x as constraints."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import casadi as ca
import numpy as np
from casadi import DM

from nlp_gait.formulation import Array, Assembly, Constraint, GaitProblem, Point, Start, Variable, make_parameters
from nlp_gait.formulation.assembly import Expression, PointOf
from nlp_gait.formulation.gait_problem import draw_uniform
from nlp_gait.symbolic.nonsmooth import Nonsmooth

RANGE = "range"  # group of the rows that replace the bounds of x


@dataclass(frozen=True, kw_only=True, eq=False)
class AffineMap:
    """Variables z in a box, of which x = A z + b."""

    matrix: Array  #: (n, n) A, invertible
    offset: Array  #: (n,) b
    lower: Array  #: (n,) bounds of z
    upper: Array  #: (n,)

    def forward(self, z: Array) -> Array:
        """Return x (..., n) of z (..., n)."""
        return np.asarray(z @ self.matrix.T + self.offset)

    def backward(self, x: Array) -> Array:
        """Return z (..., n) of x (..., n)."""
        return np.asarray(np.linalg.solve(self.matrix, (x - self.offset).T).T)


def rotate_pairs(order: Sequence[int], angles: Sequence[float]) -> Array:
    """Return the matrix (n, n) that rotates the first two variables of an order, the next two, ..., by angles (n // 2,) [rad]."""
    matrix = np.eye(len(order))
    for i, j, angle in zip(order[::2], order[1::2], angles, strict=False):
        matrix[np.ix_([i, j], [i, j])] = [[math.cos(angle), -math.sin(angle)], [math.sin(angle), math.cos(angle)]]
    return matrix


def replace_variables(
    problem: GaitProblem, variables: Sequence[Variable], see: Callable[[Any], Any], start: Start | None, **changes: Any
) -> GaitProblem:
    """Return the problem in other variables, whose points ``see`` maps to those of the problem; ``changes`` are more fields."""
    motion = problem.display.motion

    def assemble(point: Point, ops: Nonsmooth) -> Assembly:
        return problem.assemble(see(point), ops)

    display = replace(problem.display, motion=None if motion is None else lambda point: motion(see(point)))
    hints = replace(problem.hints, start=start)
    moved = {"variables": tuple(variables), "assemble": assemble, "display": display, "hints": hints}
    return replace(problem, **{**moved, **changes})


def hold_constant(problem: GaitProblem, values: Mapping[str, float]) -> GaitProblem:
    """Return the same problem with some variables as parameters, which have these values; raises as ``GaitProblem.fix``."""
    if not values:
        return problem
    problem.fix(**values)  # raises
    names, start = problem.names, problem.hints.start
    held = [v for v in problem.variables if v.name in values]
    constants = make_parameters(*((v.name, v.unit, values[v.name], v.description, v.lower, v.upper) for v in held))
    bounds = {f"{name}.{end}": value for name, value in values.items() for end in ("lower", "upper")}

    def start_point(given: Mapping[str, float], rng: np.random.Generator) -> Array:
        assert start is not None  # for the type checker
        return start({**given, **bounds}, rng)[[i for i, name in enumerate(names) if name not in values]]

    return replace_variables(
        problem,
        [v for v in problem.variables if v.name not in values],
        lambda point: point.select(names),
        None if start is None else start_point,
        own_parameters=(*problem.own_parameters, *constants),
        values={name: value for name, value in problem.values.items() if name.rpartition(".")[0] not in values},
    )


def change_variables(problem: GaitProblem, affine: AffineMap) -> GaitProblem:
    """Return the problem in the variables z1, z2, ... of an affine map, whose current bounds of x are rows.

    Objective, feasible set and optimum stay what they are; only where they are in the box of z changes.
    """
    old, low, scale = problem.names, problem.lower, problem.scale
    bounds = {
        f"{v}.{end}": float(bound)
        for end in ("lower", "upper")
        for v, bound in zip(old, getattr(problem, end), strict=True)
    }
    columns = zip(affine.lower, affine.upper, affine.matrix.T, strict=True)
    variables = [
        Variable(name=f"z{k}", unit="1", lower=float(a), upper=float(b), description=describe(problem, column))
        for k, (a, b, column) in enumerate(columns, 1)
    ]
    start = problem.hints.start
    base = problem.with_values()
    matrix = ca.sparsify(DM(affine.matrix))

    def map_point(point: PointOf[Expression]) -> PointOf[Expression]:
        parameters = {name: place for name, place in point.positions.items() if place[0] == "p"}
        x = matrix @ point.x + DM(affine.offset)
        positions = parameters | {v: ("x", i) for i, v in enumerate(old)}
        return PointOf(x=x, p=point.p, positions=positions)

    def assemble(point: Point, ops: Nonsmooth) -> Assembly:
        inner = map_point(point)
        assembly = problem.assemble(inner, ops)
        value = (inner.x - DM(low)) / DM(scale)
        upper = ca.MX(DM((problem.upper - low) / scale))
        within = Constraint(
            name=RANGE, labels=old, unit="1", scale=1.0, value=value, lower=ca.MX(0), upper=upper, over="once"
        )
        return replace(assembly, constraints=(*assembly.constraints, within))

    def start_point(parameters: Mapping[str, float], rng: np.random.Generator) -> Array:
        values = {**parameters, **bounds}
        return affine.backward(draw_uniform(old, values, rng) if start is None else start(values, rng))

    def refine(factor: int) -> GaitProblem:
        finer = base.dense(factor)
        assert finer is not None  # for the type checker
        return change_variables(finer, affine)

    return replace_variables(
        problem,
        variables,
        map_point,
        start_point,
        assemble=assemble,
        refine=None if problem.refine is None else refine,
        rows_over_time=(),
        least_power=None,
        values={name: value for name, value in problem.values.items() if name not in bounds},
    )


def describe(problem: GaitProblem, column: Array) -> str:
    """Return which variables of the problem a new one changes, by how much of their ranges for a unit of it."""
    shares = zip(problem.names, column / problem.scale, strict=True)
    return f"moves {', '.join(f'{share:+.2f} {name}' for name, share in shares if share)} (shares of their ranges)"
