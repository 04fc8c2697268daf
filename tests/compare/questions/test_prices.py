"""Prices of limits and of errors in the robot's data, as command and as function."""

from pathlib import Path

import pytest

from compare.questions.prices import AGREEMENT, Prices
from compare.questions.question import Work, find
from compare.study.memo import Memo
from nlp_gait import load, make_solver
from nlp_gait.errors import InputError

pytestmark = pytest.mark.usefixtures("coarse_pictures")


@pytest.fixture(scope="module")
def folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A folder with the stored solves of the question that the tests have in common."""
    return tmp_path_factory.mktemp("prices")


def test_slopes_agree_with_solving_again_where_it_can_be_done(folder: Path) -> None:
    found = find(Prices(problem=load("walk12"), starts=2), Work(memo=Memo(folder)))
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
    found = find(Prices(problem=load("walk12").fix(step_length_m=0.1), starts=1))
    price = next(price for price in found.limits if price.name == "step_length_m")
    assert price.x is not None and price.x["step_length_m"] == pytest.approx(1.0)
    assert price.error is not None and price.error < AGREEMENT
    assert not any(other.name.startswith("step_length_m.") for other in found.limits)
