"""The zero-moment point by hand: forces and moments small enough to check on paper."""

import numpy as np
import pytest
from casadi import DM, SX

from nlp_gait.formulation import Array
from nlp_gait.symbolic.dynamics import LEAST_LOAD, Wrench, combine_zmps, ground_load, zmp_of_point_masses, zmp_of_wrench

WEIGHT = 100.0


def numbers(vector: SX | DM) -> Array:
    return np.array(DM(vector)).ravel()


def wrench(force: list[float], moment: list[float]) -> Wrench:
    return Wrench(SX(DM(force)), SX(DM(moment)))


def test_a_wrench_acts_where_its_moment_about_the_ground_vanishes() -> None:
    """From 2 m up, force (3, -5, 50) N and moment (7, 11, 13) Nm: x = -(11 + 6) / 50, y = (7 + 10) / 50."""
    zmp = zmp_of_wrench(wrench([3, -5, 50], [7, 11, 13]), 2.0, WEIGHT)
    assert zmp.shape == (2, 1)
    assert numbers(zmp) == pytest.approx([-0.34, 0.34])


def test_the_load_is_the_vertical_force_but_in_free_fall() -> None:
    assert float(ground_load(wrench([3, -5, 50], [0, 0, 0]), WEIGHT)) == 50.0
    for force in (0.0, -50.0):
        assert float(ground_load(wrench([1, 1, force], [0, 0, 0]), WEIGHT)) == LEAST_LOAD * WEIGHT
    assert numbers(zmp_of_wrench(wrench([1, 0, -9], [0, 0, 0]), 2.0, WEIGHT)) == pytest.approx([-20.0, 0.0])


def test_two_feet_share_the_zmp_by_their_loads() -> None:
    zmps, loads = [SX(DM([0.0, 0.1])), SX(DM([0.4, -0.1]))], [SX(30.0), SX(10.0)]
    assert numbers(combine_zmps(zmps, loads)) == pytest.approx([0.1, 0.05])


def points(vertical: tuple[float, float] = (0.0, 0.0)) -> tuple[DM, SX, SX]:
    """1 kg at (0, 1, 2) m pushed by 3 m/s^2 in x, and 3 kg at (4, 0, 1) m pushed by 2 m/s^2 in y."""
    m = DM([1.0, 3.0])
    p = SX(DM([[0.0, 4.0], [1.0, 0.0], [2.0, 1.0]]))
    a = SX(DM([[3.0, 0.0], [0.0, 2.0], list(vertical)]))
    return m, p, a


@pytest.mark.parametrize("static_load", [False, True])
def test_point_masses_in_level_motion(static_load: bool) -> None:
    """G = 10: x = (3 * 4 * 10 - 3 * 2) / 40, y = (10 - 3 * 2) / 40."""
    assert numbers(zmp_of_point_masses(*points(), 10.0, static_load=static_load)) == pytest.approx([2.85, 0.1])


def test_the_load_of_point_masses_in_free_fall_is_a_share_of_their_weight() -> None:
    falling = points((-10.0, -10.0))
    expected = np.array([-6.0, -6.0]) / (LEAST_LOAD * 40.0)
    assert numbers(zmp_of_point_masses(*falling, 10.0)) == pytest.approx(expected)
