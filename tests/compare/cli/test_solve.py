"""What `solve` prints: at most 40 lines, the dearest constraints first, and all of them with --all."""

from dataclasses import replace

import numpy as np
import pytest

import nlp_gait
from compare.cli import solve as command
from compare.cli.printing import Rows
from nlp_gait.formulation.solution import ActiveConstraint
from tests.backends.toys import corner, toy


@pytest.fixture(scope="module")
def solution() -> nlp_gait.Solution:
    """A solution of 30 variables with 50 active constraints, made from one of two."""
    solved = nlp_gait.solve(toy(corner, limit=1.5))
    variables = tuple(replace(solved.problem.variables[0], name=f"x{k}") for k in range(30))
    problem = replace(solved.problem, variables=variables)
    prices = tuple(
        ActiveConstraint(name=f"row{k}", side="lower", bound=0.0, unit="m", price=50.0 - k, price_unit="J per m")
        for k in range(50)
    )
    best = replace(solved.best, x=np.linspace(-1.0, 2.0, 30))
    return replace(solved, problem=problem, starts=(best,), active_constraints=prices)


def test_a_large_solution_is_shortened_largest_first(solution: nlp_gait.Solution) -> None:
    parts = list(command._describe(solution))
    x, constraints = (part for part in parts if isinstance(part, Rows))
    assert [row[0] for row in x.rows[:3]] == ["x29", "x28", "x27"] and "largest" in x.title
    assert [row[0] for row in constraints.rows] == [f"row{k}" for k in range(8)]
    assert "and 18 more variables and 42 more active constraints: --out FILE or --json" in parts
    # A table has its title, two lines above and one below its rows, and its header and rule.
    lines = sum(len(part.rows) + 5 if isinstance(part, Rows) else 1 for part in parts)
    assert lines + 5 <= 40  # with what is known about the optimum, and the file that was written
