"""The climb of several stairs: its steps, places and joints; ``tests.simulation`` solves and simulates it."""

import numpy as np
import pytest

import nlp_gait
from nlp_gait.errors import InputError
from nlp_gait.formulation import Result
from nlp_gait.simulation.plan import make_plan
from tests.evaluation import evaluated

TREAD, RISE = 0.254, 0.254 * 0.70


def test_feet_alternate_from_the_floor_to_the_last_stair() -> None:
    problem = nlp_gait.load("stairs-climb", stairs=3, intervals=12)
    plan = make_plan(Result(problem=problem, x=problem.start_point(np.random.default_rng(1))))
    steps = plan.duration_s / 4 * np.arange(5)
    feet = {side: plan.at(f"{side}_foot", steps) for side in ("left", "right")}
    for side, levels in (("left", [0, 0, 2, 2, 3]), ("right", [0, 1, 1, 3, 3])):
        # A start point has noise: the swing foot lands centimetres off.
        np.testing.assert_allclose(feet[side][:, 0], np.multiply(TREAD, levels), atol=0.06)
        np.testing.assert_allclose(feet[side][:, 2], np.multiply(RISE, levels), atol=0.06)
    assert [tread.height_m for tread in plan.ground] == pytest.approx([RISE, 2 * RISE, 3 * RISE])


def test_the_effort_counts_every_step_and_no_step_is_computed_twice() -> None:
    two, five = (nlp_gait.load("stairs-climb", stairs=stairs, intervals=12) for stairs in (2, 5))
    x = two.start_point(np.random.default_rng(1))
    assert two.names == five.names
    one_more = nlp_gait.load("stairs-climb", stairs=3, intervals=12)
    efforts = [evaluated(problem, x).cost for problem in (two, one_more, five)]
    assert efforts[2] - efforts[1] == pytest.approx(2 * (efforts[1] - efforts[0]))


def test_a_search_and_a_single_stair_are_refused() -> None:
    with pytest.raises(InputError, match="use solve"):
        nlp_gait.compile_objective(nlp_gait.load("stairs-climb", stairs=2, intervals=12))
    with pytest.raises(InputError, match=">= 2"):
        nlp_gait.load("stairs-climb", stairs=1)
