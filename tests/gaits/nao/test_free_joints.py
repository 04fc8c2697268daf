"""Single support with free joints against Pinocchio, and what it shares with planned motions."""

from functools import cache

import numpy as np
import pytest

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, GaitProblem, load
from nlp_gait.gaits.nao.free_joints import fit_joints
from nlp_gait.robots import load_robot
from tests.backends.toys import row_violations
from tests.evaluation import check_power, evaluated
from tests.pinocchio_oracle import check_standing, floating_model

# Joint angles of a cubic hip and foot are smooth: with 8 spans a fit is this near in power.
FIT_SHARE = 0.01
OWN = 9
PAPER = (0.305, -0.00122, 0.00350, 0.01243, 0.001, 0.02369, -0.02307, 0.015, 4.0)


@cache
def problem_of(order: str = "spline-2") -> GaitProblem:
    return load("nao-ssp-free", trajectory=order, samples_per_interval=1)


def leaning(seed: int) -> Array:
    """A motion in which torso, swing foot and the hips' yaw-pitch all turn."""
    problem = problem_of()
    x = np.zeros(len(problem.names))
    x[:OWN] = PAPER
    x[OWN:] = 0.3 * np.random.default_rng(seed).normal(size=len(x) - OWN)
    return x


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_torques_zmp_and_poses_are_those_of_a_floating_base_with_the_foot_held(seed: int) -> None:
    robot = load_robot("nao-v5")
    model, signals = floating_model(robot), problem_of().signals(leaning(seed))
    ankle = np.array([0.06, 0.05, robot.feet["left"].ankle_height_m])
    check_standing(signals, model, ankle, range(11), "com", "hip")


@pytest.mark.slow
def test_the_objective_is_the_power_of_the_signals() -> None:
    check_power(problem_of(), map(leaning, range(2)))


@pytest.mark.slow
def test_both_yaw_pitch_joints_are_one_and_the_held_arm_joints_stay() -> None:
    signals = problem_of().signals(leaning(0))
    q = dict(zip(signals.joints, signals.arrays["q"].T, strict=True))
    np.testing.assert_array_equal(q["LHipYawPitch"], q["RHipYawPitch"])
    assert np.abs(q["LHipYawPitch"]).max() > 0.01
    assert all(np.ptp(q[name]) == 0.0 for name in ("LShoulderRoll", "RElbowYaw", "LWristYaw"))


@pytest.mark.slow
def test_a_planned_motion_is_a_free_one_nearly() -> None:
    planned, free = load("nao-ssp"), problem_of("spline-8")
    x = fit_joints("spline-8", planned, np.array(PAPER))
    power, expected = (evaluated(p, v).cost for p, v in ((free, x), (planned, PAPER)))
    assert power == pytest.approx(expected, rel=FIT_SHARE)
    started = free.start_point(np.random.default_rng(0))
    assert len(started) == len(free.names) and np.isfinite(started).all()


@pytest.mark.slow
@pytest.mark.parametrize(
    ("joint", "value", "rows"),
    [
        ("RAnklePitch", 1.0, ("foot_height[front ",)),
        ("RAnkleRoll", 1.0, ("foot_height[back left", "foot_height[back right")),
        ("RHipRoll", 2.0, ("feet_apart[back left",)),
        ("HipYawPitch", -3.0, ("other_angle[LHipYawPitch",)),
        ("LElbowRoll", 3.0, ("other_angle[LElbowRoll",)),
    ],
)
def test_what_a_plan_keeps_by_construction_is_a_limit(joint: str, value: float, rows: tuple[str, ...]) -> None:
    problem = problem_of("quintic")
    x = np.zeros(len(problem.names))
    x[:OWN] = PAPER
    x[[problem.variable_index(f"{joint}_rad[{k}]") for k in range(2)]] = value
    found = [row.name for row in row_violations(problem, x)]
    assert any(name.startswith(rows) for name in found), found[:20]


def test_a_grid_without_a_middle_is_refused() -> None:
    with pytest.raises(InputError, match="must be even, got 55"):
        load("nao-ssp-free", intervals=11, samples_per_interval=5)
