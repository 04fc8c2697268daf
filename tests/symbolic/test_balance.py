"""The zero-moment point by hand: forces and moments small enough to check on paper."""

import numpy as np
import pytest
from casadi import DM, SX

from nlp_gait.formulation import Array
from nlp_gait.symbolic.dynamics import LEAST_LOAD, Wrench, ground_load, zmp_of_point_masses, zmp_of_wrench

WEIGHT = 100.0


def numbers(vector: SX | DM) -> Array:
    return np.array(DM(vector)).ravel()


def wrench(force: list[float], moment: list[float]) -> Wrench:
    return Wrench(SX(DM(force)), SX(DM(moment)))


def test_the_load_is_the_vertical_force_but_in_free_fall() -> None:
    assert float(ground_load(wrench([3, -5, 50], [0, 0, 0]), WEIGHT)) == 50.0
    for force in (0.0, -50.0):
        assert float(ground_load(wrench([1, 1, force], [0, 0, 0]), WEIGHT)) == LEAST_LOAD * WEIGHT
    assert numbers(zmp_of_wrench(wrench([1, 0, -9], [0, 0, 0]), 2.0, WEIGHT)) == pytest.approx([-20.0, 0.0])


def points(vertical: tuple[float, float] = (0.0, 0.0)) -> tuple[DM, SX, SX]:
    """1 kg at (0, 1, 2) m pushed by 3 m/s^2 in x, and 3 kg at (4, 0, 1) m pushed by 2 m/s^2 in y."""
    m = DM([1.0, 3.0])
    p = SX(DM([[0.0, 4.0], [1.0, 0.0], [2.0, 1.0]]))
    a = SX(DM([[3.0, 0.0], [0.0, 2.0], list(vertical)]))
    return m, p, a


def test_the_load_of_point_masses_in_free_fall_is_a_share_of_their_weight() -> None:
    falling = points((-10.0, -10.0))
    expected = np.array([-6.0, -6.0]) / (LEAST_LOAD * 40.0)
    assert numbers(zmp_of_point_masses(*falling, 10.0)) == pytest.approx(expected)
