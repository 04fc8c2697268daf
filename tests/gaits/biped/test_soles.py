"""Soles that are drawn and on which robots stand: their sides, and their places on treads."""

from dataclasses import replace

import numpy as np
import pytest

from nlp_gait.gaits.biped.footholds import Flight
from nlp_gait.gaits.biped.phase_problem import make_level_sole
from nlp_gait.robots import load_robot
from tests.gaits.biped.lopsided import WIDTHS


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_drawn_sole_reaches_as_far_to_each_side_as_the_foot(side: str) -> None:
    robot = load_robot("nao-v5")
    foot = replace(robot.feet[side], **WIDTHS[side])
    sole = make_level_sole(replace(robot, feet={**robot.feet, side: foot}), side, np.zeros((1, 3)))
    ends = [foot.front_m, foot.back_m, foot.left_m, foot.right_m]
    x, y = sole.corners[0, :, 0], sole.corners[0, :, 1]
    assert [x.max(), -x.min(), y.max(), -y.min()] == pytest.approx(ends)


def test_a_sole_stands_in_the_middle_of_its_tread() -> None:
    foot = load_robot("nao-v5").feet["left"]
    run = foot.back_m + foot.front_m + 0.04
    for k, tread in enumerate(Flight(rise_m=0.02, run_m=run, foot=foot).list_treads(3), start=1):
        ankle = k * run  # each step advances by one tread
        assert ankle - foot.back_m - tread.edge_m == pytest.approx(0.02)
        assert tread.edge_m + run - (ankle + foot.front_m) == pytest.approx(0.02)
        assert tread.height_m == pytest.approx(0.02 * k)
