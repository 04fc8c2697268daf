"""Rows of limits and places of soles by hand, on samples small enough to check on paper."""

from dataclasses import replace
from typing import get_args

import casadi as ca
import numpy as np
import pytest
from casadi import DM, MX

from nlp_gait.formulation import Grid
from nlp_gait.gaits.biped.body import Body
from nlp_gait.gaits.biped.footholds import Flight
from nlp_gait.gaits.biped.limits import GOALS, GoalName, TorqueChange, compute_margins
from nlp_gait.gaits.biped.phase_problem import make_level_sole
from nlp_gait.gaits.biped.samples import Samples
from nlp_gait.gaits.biped.support_phases import make_support_box
from nlp_gait.gaits.nao.body import make_nao
from nlp_gait.robots import load_robot
from nlp_gait.symbolic.nonsmooth import Exact

# [Nm], [W] and [rad/s^2] of two joints at five samples.
TORQUE = np.array([[0.0, 1.0, 3.0, 6.0, 10.0], [5.0, 4.0, 2.0, 2.0, 1.0]])
POWER_W = np.array([[1.0, -2.0, 3.0, -4.0, 5.0], [0.0, 0.0, 0.0, 0.0, 0.0]])
ACCELERATION = np.array([[0.0, 1.0, 3.0, 6.0, 10.0], [2.0, 2.0, 2.0, 2.0, 2.0]])
# Of these samples, by hand: means by the trapezoidal rule, squared differences over 0.25 s.
OBJECTIVES = {
    "power": 3.0 + 0.1 * 33.25,
    "jerk": (1 + 4 + 9 + 16) * 16 / 4,
    "torque": (25 / 2 + 17 + 13 + 40 + 101 / 2) / 4,
    "torque-smoothness": (1 + 4 + 9 + 16 + 1 + 4 + 0 + 1) * 16 / 4,
}


def numbers(value: MX) -> np.ndarray:
    return np.array(ca.evalf(value)).ravel()


def make_samples() -> Samples:
    """Two joints at five samples of a second, two for each of two intervals."""
    values = {Samples.torque: TORQUE, Samples.power: POWER_W, Samples.qdd: ACCELERATION}
    return Samples(
        joints=("a", "b"),
        moving=("a", "b"),
        standing=("L",),
        grid=Grid(intervals=2, samples_per_interval=2),
        duration=MX(1.0),
        progress=MX(DM(np.linspace(0.0, 1.0, 5)).T),
        evaluate=lambda quantity: MX(DM(values[quantity])),
    )


def test_a_torque_changes_over_an_interval_not_over_a_sample() -> None:
    (row,), metrics = TorqueChange().add({"torque_change_limit_Nm": MX(1.2)}, make_samples(), Exact())
    assert numbers(row.value) == pytest.approx([3.0, -3.0, 5.0, -2.0, 7.0, -1.0])
    assert row.labels == ("a, 0", "b, 0", "a, 1", "b, 1", "a, 2", "b, 2")
    assert numbers(metrics["torque_change_Nm"]) == pytest.approx([7.0])


@pytest.mark.parametrize("name", GOALS)
def test_every_goal_by_hand(name: GoalName) -> None:
    assert set(OBJECTIVES) == set(GOALS) == set(get_args(GoalName)), (
        "add the goal to GoalName, and its value to OBJECTIVES"
    )
    objective, metrics = GOALS[name].evaluate({"heat_loss_W_per_Nm2": MX(0.1)}, make_samples(), Exact())
    assert numbers(objective) == pytest.approx([OBJECTIVES[name]])
    assert numbers(metrics["power_W"]) == pytest.approx([OBJECTIVES["power"]])


def test_margins_are_distances_to_the_edges_of_a_sole_that_is_not_symmetric() -> None:
    """From an ankle at (1, 2): 0.02 m behind the front, 0.01 m inside the right edge; then 0.03 m outside the left one."""
    body = make_lopsided(make_nao("nao-v5"))
    foot = body.robot.feet["left"]
    zmp = MX(DM([[1.0 + foot.front_m - 0.02, 1.0], [2.0 - foot.right_m + 0.01, 2.0 + foot.left_m + 0.03]]))
    along, across = (numbers(margin) for margin in Body.make_sole_margins(body, (1.0, 2.0))(zmp, {}, Exact()))
    assert along == pytest.approx([0.02, min(foot.front_m, foot.back_m)])
    assert across == pytest.approx([0.01, -0.03])


def test_the_box_around_both_soles_ends_at_their_outer_edges() -> None:
    body = make_lopsided(make_nao("nao-v5"))
    left, right = body.robot.feet["left"], body.robot.feet["right"]
    box = make_support_box(body.robot, {"L": (0.0, 0.05), "R": (0.06, -0.05)})
    assert box == pytest.approx((-left.back_m, 0.06 + right.front_m, -0.05 - right.right_m, 0.05 + left.left_m))
    assert numbers(compute_margins(box, MX(DM([[0.0], [0.0]])), Exact())[1]) == pytest.approx(
        [min(0.05 + left.left_m, 0.05 + right.right_m)]
    )


@pytest.mark.parametrize("side", ["left", "right"])
def test_a_drawn_sole_reaches_as_far_to_each_side_as_the_foot(side: str) -> None:
    robot = load_robot("nao-v5")
    foot = replace(robot.feet[side], **WIDTHS[side])
    robot = replace(robot, feet={**robot.feet, side: foot})
    sole = make_level_sole(robot, side, np.zeros((1, 3)))
    ends = [foot.front_m, foot.back_m, foot.left_m, foot.right_m]
    x, y = sole.corners[0, :, 0], sole.corners[0, :, 1]
    assert [x.max(), -x.min(), y.max(), -y.min()] == pytest.approx(ends)
    (turned,) = make_level_sole(robot, side, np.zeros((1, 3)), np.array([0.3])).corners
    assert turned[:, 0] + 1j * turned[:, 1] == pytest.approx(np.exp(0.3j) * (x + 1j * y))


def test_a_sole_stands_in_the_middle_of_its_tread() -> None:
    foot = load_robot("nao-v5").feet["left"]
    run = foot.back_m + foot.front_m + 0.04
    for k, tread in enumerate(Flight(rise_m=0.02, run_m=run, foot=foot).list_treads(3), start=1):
        ankle = k * run  # each step advances by one tread
        assert ankle - foot.back_m - tread.edge_m == pytest.approx(0.02)
        assert tread.edge_m + run - (ankle + foot.front_m) == pytest.approx(0.02)
        assert tread.height_m == pytest.approx(0.02 * k)


WIDTHS = {"left": {"left_m": 0.06, "right_m": 0.02}, "right": {"left_m": 0.03, "right_m": 0.05}}


def make_lopsided(body: Body) -> Body:
    """Return the body with soles that reach farther outward than inward, each by another amount."""
    feet = {side: replace(foot, **WIDTHS[side]) for side, foot in body.robot.feet.items()}
    return replace(body, robot=replace(body.robot, feet=feet))
