"""Prices of limits and of errors in the robot's data, as command and as function."""

import pytest

from compare.questions.prices import AGREEMENT, Prices
from compare.questions.question import find
from nlp_gait import load, make_solver
from nlp_gait.errors import InputError
from tests.backends.toys import corner, toy


def test_slopes_agree_with_solving_again_where_it_can_be_done() -> None:
    found = find(Prices(problem=load("walk12"), starts=2))
    assert found.robot == found.weak == () and found.reason is None
    # f holds (1 - lambda) s / f2max, so that its slope is -(1 - 0.15) 0.13 / 0.13^2.
    assert found.limits[0].name == "f2max_m" and found.limits[0].slope == pytest.approx(-0.85 / 0.13, rel=1e-6)
    errors = [error for price in found.limits for error in (price.error, price.x_error) if error is not None]
    assert len(errors) > 6
    assert max(errors) < AGREEMENT
    # A turn cannot be less than none: only the other side can be solved again.
    turn = next(price for price in found.limits if price.name == "turn_rad")
    assert turn.error is None and turn.one_step is not None
    assert turn.one_step[0] is None and turn.one_step[1] == pytest.approx(turn.per_step, rel=0.05)


def test_a_solver_without_multipliers_has_no_prices() -> None:
    with pytest.raises(InputError, match="need multipliers, which slsqp does not return; solve with ipopt"):
        find(Prices(problem=load("walk12"), starts=2, solver=make_solver("slsqp")))


def test_a_fixed_variable_has_one_price() -> None:
    """|x - 1| + 2 |y - 1| with y above 1.5."""
    found = find(Prices(problem=toy(corner, limit=1.5).fix(x=1.7), starts=1))
    assert {price.name: price.slope for price in found.limits} == pytest.approx({"limit": 2.0, "x": 1.0})
    assert [price.x and price.x["x"] for price in found.limits] == pytest.approx([0.0, 1.0])
    assert all(price.error is not None and price.error < AGREEMENT for price in found.limits)
