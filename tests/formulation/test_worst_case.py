"""One motion for several scenarios."""

import pytest
from casadi import MX

from compare.questions.robust_gait import make_worst_case
from nlp_gait import solve
from nlp_gait.errors import InputError
from nlp_gait.formulation import Constraint, GaitProblem
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from tests.backends.toys import Mathematics, row, toy


def target(at: float, least: float) -> Mathematics:
    """|x - at| + y^2 with y >= least: non-smooth itself, as power is."""

    def mathematics(x: MX, y: MX, limit: MX, ops: Nonsmooth) -> tuple[MX, tuple[Constraint, ...]]:
        return ops.abs(x - at) + y**2, (row(y, lower=MX(least)),)

    return mathematics


def test_the_worst_scenario_is_optimised() -> None:
    """Between targets at -1 and 1 x is 0; the strictest limit holds in all scenarios."""
    problem = make_worst_case([toy(target(-1.0, 0.0)), toy(target(1.0, 0.5)), toy(target(0.5, 0.2))])
    found = solve(problem, starts=3)
    assert found.converged
    assert found.x["x"] == pytest.approx(0.0, abs=1e-6)
    assert found.x["y"] == pytest.approx(0.5, abs=1e-6)
    assert found.objective == pytest.approx(1.25, abs=1e-6)
    assert [a.name for a in found.active_constraints if a.name.startswith("row")] == ["row@1"]


def test_maximised_or_different_scenarios_are_refused() -> None:
    def hill(x: MX, y: MX, limit: MX, ops: Nonsmooth) -> tuple[MX, tuple[Constraint, ...]]:
        return -(x**2), ()

    refused: list[tuple[list[GaitProblem], str]] = [
        ([], "at least one"),
        ([toy(hill, sense="maximise")], "maximised"),
    ]
    for scenarios, said in refused:
        with pytest.raises(InputError, match=said):
            make_worst_case(scenarios)
