"""Small problems with known solutions."""

from collections.abc import Callable
from typing import Literal

from casadi import MX

from nlp_gait.backends.exact import build_exact_model
from nlp_gait.formulation import Array, Assembly, Constraint, GaitProblem, Objective, Parameter, Point, Variable
from nlp_gait.formulation.solution import ConstraintValue
from nlp_gait.symbolic.nonsmooth import Nonsmooth

# From the two variables, the parameter "limit" and an interpretation, to the objective and the constraints.
Mathematics = Callable[[MX, MX, MX, Nonsmooth], tuple[MX, tuple[Constraint, ...]]]


def toy(
    mathematics: Mathematics, sense: Literal["minimise", "maximise"] = "minimise", limit: float = 0.5
) -> GaitProblem:
    """A problem of x in [-2, 2] m and y in [-1, 3] m with a parameter ``limit`` [m]."""

    def assemble(point: Point, ops: Nonsmooth) -> Assembly:
        objective, constraints = mathematics(point["x"], point["y"], point["limit"], ops)
        return Assembly(objective=objective, constraints=constraints, metrics={"cost": objective})

    return GaitProblem(
        name="toy",
        title="Toy",
        options={},
        variables=(
            Variable(name="x", unit="m", lower=-2.0, upper=2.0, description="first"),
            Variable(name="y", unit="m", lower=-1.0, upper=3.0, description="second"),
        ),
        own_parameters=(
            Parameter(name="limit", unit="m", default=limit, description="of the constraint", minimum=-9.0),
        ),
        objective=Objective(name="cost", unit="J", sense=sense),
        assemble=assemble,
    )


def row_violations(problem: GaitProblem, x: Array) -> tuple[ConstraintValue, ...]:
    """Rows that the exact functions find violated at x, worst first."""
    exact = build_exact_model(problem)
    return exact.find_violated(exact.at(x, problem.p))


def row(value: MX, lower: MX | None = None, upper: MX | None = None) -> Constraint:
    """A constraint named ``row``."""
    return Constraint(name="row", unit="m", scale=0.1, value=value, lower=lower, upper=upper)


def corner(x: MX, y: MX, limit: MX, ops: Nonsmooth) -> tuple[MX, tuple[Constraint, ...]]:
    """|x - 1| + 2 |y - 1| with min(x, y) >= limit: 0 at (1, 1) up to limit 1, then 3 (limit - 1) at (limit, limit)."""
    return ops.abs(x - 1) + 2 * ops.abs(y - 1), (row(ops.min(x, y), lower=limit),)
