"""What holds an optimum back: limits and fixed variables have prices, equations of the problem do not appear."""

from __future__ import annotations

from dataclasses import replace

import pytest
from casadi import MX

from nlp_gait.backends.solve import solve
from nlp_gait.formulation import Constraint
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from tests.backends.toys import row, toy


def on_a_line(x: MX, y: MX, limit: MX, ops: Nonsmooth) -> tuple[MX, tuple[Constraint, ...]]:
    """Distance from (1, 1) squared where x + y equals the limit, and x may not pass 0.2 below it."""
    return (x - 1) ** 2 + (y - 1) ** 2, (
        row(x + y, lower=limit, upper=limit),
        replace(row(x, upper=limit - 0.3), name="most"),
    )


@pytest.mark.parametrize(("fix", "expected"), [({}, "most"), ({"x": 0.1}, "bounds[x]")])
def test_equations_are_left_out(fix: dict[str, float], expected: str) -> None:
    solution = solve(toy(on_a_line), x0=[0.1, 0.1], fix=fix)
    assert solution.converged, solution.status
    assert [(bound.name, bound.side) for bound in solution.active_constraints] == [(expected, "upper")]
