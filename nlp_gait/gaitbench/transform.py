"""The same problem in other variables: x = A z + b, with the bounds of x as constraints.

Objective, feasible set and optimum stay what they are; only where they are in the box of z changes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from casadi import DM

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, Assembly, Constraint, GaitProblem, NumericPoint, Point, Signals, Variable
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


def change_variables(problem: GaitProblem, affine: AffineMap, names: Sequence[str] = ()) -> GaitProblem:
    """Return the problem in the variables z of an affine map, whose current bounds of x are rows.

    Args:
        problem: in x.
        affine: its box replaces the problem's bounds.
        names: (n,) of z; by default z1, z2, ...

    Raises:
        InputError: the map has another number of variables.
    """
    n = len(problem.names)
    if affine.matrix.shape != (n, n):
        raise InputError(f"an affine map of {problem.name} must be {n} x {n}, got {affine.matrix.shape}")
    old, low, scale = problem.names, problem.lower, problem.scale
    bounds = {
        f"{v}.{end}": float(at) for end in ("lower", "upper") for v, at in zip(old, getattr(problem, end), strict=True)
    }
    variables = tuple(
        Variable(name=name, unit="1", lower=float(a), upper=float(b), description=describe(problem, row))
        for name, a, b, row in zip(
            names or [f"z{k + 1}" for k in range(n)], affine.lower, affine.upper, affine.matrix.T, strict=True
        )
    )
    motion, start, base = problem.display.motion, problem.hints.start, problem.with_values()

    def map_point(point: PointOf[Expression], matrix: DM, offset: DM) -> PointOf[Expression]:
        parameters = {name: place for name, place in point.positions.items() if place[0] == "p"}
        return PointOf(
            x=matrix @ point.x + offset, p=point.p, positions=parameters | {v: ("x", i) for i, v in enumerate(old)}
        )

    def assemble(point: Point, ops: Nonsmooth) -> Assembly:
        inner = map_point(point, ca.sparsify(DM(affine.matrix)), DM(affine.offset))
        assembly = problem.assemble(inner, ops)
        within = Constraint(
            name=RANGE,
            labels=old,
            unit="1",
            scale=1.0,
            value=(inner.x - DM(low)) / DM(scale),
            lower=ca.MX(0),
            upper=ca.MX(DM((problem.upper - low) / scale)),
            over="once",
        )
        return replace(assembly, constraints=(*assembly.constraints, within))

    def signals(at: NumericPoint) -> Signals:
        assert motion is not None  # for the type checker
        return motion(map_point(at, DM(affine.matrix), DM(affine.offset)))

    def start_point(parameters: Mapping[str, float], rng: np.random.Generator) -> Array:
        values = {**parameters, **bounds}
        return affine.backward(draw_uniform(old, values, rng) if start is None else start(values, rng))

    def refine(factor: int) -> GaitProblem:
        finer = base.dense(factor)
        assert finer is not None  # for the type checker
        return change_variables(finer, affine, names)

    return replace(
        problem,
        variables=variables,
        assemble=assemble,
        refine=None if problem.refine is None else refine,
        rows_over_time=(),
        power_form=None,
        display=replace(problem.display, motion=None if motion is None else signals),
        hints=replace(problem.hints, start=start_point),
        values={name: value for name, value in problem.values.items() if name not in bounds},
    )


def describe(problem: GaitProblem, column: Array) -> str:
    """Return which variables of the problem a new one changes, by how much of their ranges for a unit of it."""
    parts = [
        f"{share:+.2f} {v.name}" for v, share in zip(problem.variables, column / problem.scale, strict=True) if share
    ]
    return f"moves {', '.join(parts)} (shares of their ranges)"
