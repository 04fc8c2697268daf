"""Robots with other masses, lengths and soles."""

import math
from pathlib import Path

import numpy as np
import pytest

from nlp_gait.errors import InputError, RobotDataError, UnknownNameError
from nlp_gait.robots import load_robot
from nlp_gait.robots.leg import make_leg
from nlp_gait.robots.perturbation import name_perturbed, perturb, split_name
from tests.robots.crooked import crooked

NAO = load_robot("nao-v5")


def test_masses_and_inertias_scale() -> None:
    heavy = perturb(NAO, {"mass": 1.1, "LThigh.mass": 2.0})
    assert heavy.links["RTibia"].mass_kg == pytest.approx(1.1 * NAO.links["RTibia"].mass_kg)
    assert heavy.links["LThigh"].mass_kg == pytest.approx(2.2 * NAO.links["LThigh"].mass_kg)
    own, other = (robot.links["LThigh"].inertia_com_kgm2 for robot in (NAO, heavy))
    assert other == pytest.approx([2.2 * value for value in own])
    assert heavy.links["LThigh"].com_m == NAO.links["LThigh"].com_m


def test_the_legs_of_any_robot_get_longer(tmp_path: Path) -> None:
    robot = load_robot(str(crooked(tmp_path)))
    tall = perturb(robot, {"thigh_m": 0.01, "tibia_m": -0.005})
    for side in robot.feet:
        before, after = (make_leg(each, side) for each in (robot, tall))
        steps = [[math.dist(leg.points[k], leg.points[k - 1]) for k in range(1, 6)] for leg in (before, after)]
        assert np.subtract(steps[1], steps[0]) == pytest.approx([0, 0, 0.01, -0.005, 0], abs=1e-12)


def test_a_shifted_sole_keeps_its_size_and_shape() -> None:
    shifted = perturb(NAO, {"sole_x_m": 0.002, "sole_y_m": -0.001})
    for side, foot in NAO.feet.items():
        other = shifted.feet[side]
        assert other.front_m + other.back_m == pytest.approx(foot.front_m + foot.back_m)
        assert (other.front_m, other.left_m) == pytest.approx((foot.front_m + 0.002, foot.left_m - 0.001))


def test_a_name_carries_the_changes() -> None:
    changes = {"mass": 1.05, "thigh_m": 1 / 3000}
    name = name_perturbed("nao-v5", changes)
    assert split_name(name) == ("nao-v5", changes)
    robot = load_robot(name)
    assert robot.name == name
    assert robot.mass_kg == pytest.approx(1.05 * NAO.mass_kg)
    assert split_name("nao-v5") == ("nao-v5", {})
    assert split_name("my@robots/nao.json") == ("my@robots/nao.json", {})


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        ({"LTigh.mass": 1.1}, UnknownNameError, "LThigh.mass"),
        ({"mass": 0.0}, RobotDataError, "mass_kg must be > 0"),
        ({"thigh_m": -0.2}, InputError, "leaves no length"),
        ({"sole_x_m": 0.2}, RobotDataError, "back_m must be >= 0"),
    ],
)
def test_impossible_changes_are_refused(changes: dict[str, float], error: type[Exception], message: str) -> None:
    with pytest.raises(error, match=message):
        perturb(NAO, changes)
