"""The 12-joint walk: model, objective, constraints and options, and the exchange of legs, straight and in a circle."""

from typing import Any

import numpy as np
import pytest

import nlp_gait
from nlp_gait.gaits.walk12.walk12_model import ANKLE_HEIGHT_M, load_point_mass_biped
from nlp_gait.gaits.walk12.walk12_steps import JOINTS, compute_steps
from tests.evaluation import evaluated
from tests.gaits.walk12 import walk12_oracle as oracle

MOMENT_TOLERANCE = 1e-6  # [Nm]; the difference stencil alone is good to 1e-8
ANGLE_TOLERANCE = 1e-7  # [rad]; the arccosine of the printed (2) loses half the digits near its end
DEFAULT = nlp_gait.load("walk12")


def random_gaits(count: int, seed: int) -> list[Any]:
    """Reachable gaits, all over the bounds."""
    rng = np.random.default_rng(seed)
    found: list[Any] = []
    while len(found) < count:
        x = rng.uniform(DEFAULT.lower, DEFAULT.upper)
        if evaluated(DEFAULT, x).violation == 0.0:
            found.append(x)
    return found


def test_angles_equal_the_printed_inverse_kinematics() -> None:
    robot = load_point_mass_biped()
    for x in random_gaits(10, seed=1):
        arrays = compute_steps(robot, x, steps=1, intervals=20).arrays
        for t, q in zip(arrays["t"], arrays["q"], strict=True):
            stance, swing = oracle.legs(x, t)
            for leg, columns in ((stance, [0, 1, 2, 4, 5]), (swing, [11, 10, 9, 7, 6])):
                if np.linalg.norm(leg.hip - leg.ankle) ** 2 > robot.thigh_m**2 - robot.shank_m**2:
                    assert q[columns] == pytest.approx(leg.theta, abs=ANGLE_TOLERANCE)


def test_a_deeply_bent_leg_closes_where_the_printed_one_does_not() -> None:
    x = np.array([0.13, 0.13, 0.13, 0.13])  # the corner that (2) turns into a local maximum
    swing = oracle.legs(x, 0.5)[1]
    assert np.linalg.norm(oracle.hip_by_forward_kinematics(swing) - swing.hip) > 0.01
    arrays = compute_steps(load_point_mass_biped(), x, steps=1, intervals=2).arrays
    closed = oracle.Leg(swing.ankle, swing.hip, arrays["q"][1, [11, 10, 9, 7, 6]])
    assert oracle.hip_by_forward_kinematics(closed) == pytest.approx(swing.hip, abs=1e-12)


@pytest.mark.parametrize(("reading", "misprinted"), [("appendix", False), ("appendix-as-printed", True)])
def test_appendix_against_its_print(reading: Any, misprinted: bool) -> None:
    for x in random_gaits(5, seed=3):
        for t, zmp in zip(
            *(compute_steps(load_point_mass_biped(), x, steps=1, zmp=reading).arrays[k] for k in ("t", "zmp")),
            strict=True,
        ):
            stance, swing = oracle.legs(x, t)
            if np.linalg.norm(swing.hip - swing.ankle) ** 2 < oracle.D1**2 - oracle.D2**2:
                continue
            p, a = (
                oracle.points(x, t, shank=oracle.appendix_shank),
                oracle.accelerations(x, t, shank=oracle.appendix_shank),
            )
            sums = p.copy()
            if misprinted:
                sums[[6, 5], 0] = swing.ankle[0] - swing.hip[0] + p[[0, 1], 0]
                sums[[6, 5], 1] = -oracle.W - p[[0, 1], 1]
            inertia = oracle.MASSES @ (p[:, :2] * a[:, 2:] - p[:, 2:] * a[:, :2]) / oracle.GRAVITY
            expected = (oracle.MASSES @ sums[:, :2] + inertia) / oracle.MASSES.sum()
            assert zmp == pytest.approx(expected, abs=MOMENT_TOLERANCE)


# Gaits with nearly straight legs, near the worst for Gauss's rule by differential evolution.
STRAIGHT = ([0.098, 0.0255, 0.1299, 0.0013], [0.0517346, 0.12883558, 0.03921078, 0.0094602])


@pytest.mark.parametrize("x", STRAIGHT)
def test_no_rule_but_simpsons_on_few_intervals_errs_where_legs_are_straight(x: list[float]) -> None:
    stable = {"lambda": 1.0}
    f = {
        quadrature: evaluated(nlp_gait.load("walk12", quadrature=quadrature).with_values(**stable), x).cost
        for quadrature in ("gauss", "simpson", "runge-kutta")
    }
    assert f["gauss"] == pytest.approx(f["runge-kutta"], abs=2e-7)
    assert abs(f["simpson"] - f["runge-kutta"]) > 1e-3


@pytest.mark.parametrize(
    ("step_time", "x", "per_step", "per_second"),
    [
        (2.0, [0.126, 0.12, 0.014, 0.0215], 203, 1107),
        (1.5, [0.130, 0.11, 0.014, 0.0220], 253, 801),
        (0.8, [0.130, 0.12, 0.014, 0.0200], 373, 335),
        (0.5, [0.129, 0.11, 0.014, 0.0210], 296, 148),
    ],
)
def test_f1_at_the_rows_of_table_4(step_time: float, x: list[float], per_step: float, per_second: float) -> None:
    for horizon, expected in (("step", per_step), ("1s", per_second)):
        problem = nlp_gait.load("walk12", intervals=400, horizon=horizon).with_values(step_time_s=step_time)
        assert evaluated(problem, x).metrics["f1_per_m2s"] == pytest.approx(expected, abs=0.6)


def test_an_ankle_above_the_ground_shifts_the_zmp_by_the_horizontal_inertia() -> None:
    for x in random_gaits(3, seed=5):
        low, high = (
            compute_steps(load_point_mass_biped(), x, steps=1, zmp=reading).arrays
            for reading in ("exact", "raised-ankle")
        )
        for t, before, after in zip(low["t"], low["zmp"], high["zmp"], strict=True):
            inertia = oracle.MASSES @ oracle.accelerations(x, t)[:, :2]
            shift = -ANKLE_HEIGHT_M * inertia / (oracle.GRAVITY * oracle.MASSES.sum())
            assert after - before == pytest.approx(shift, abs=MOMENT_TOLERANCE)


X = np.array([0.13, 0.109, 0.014, 0.020])
N = 20
EXCHANGED = [11, 10, 9, 8, 7, 6, 5, 4, 3, 2, 1, 0]
ROLLS = [JOINTS.index(name) for name in ("theta_1", "theta_6", "theta_7", "theta_12")]


def test_the_second_step_mirrors_the_first() -> None:
    arrays = compute_steps(load_point_mass_biped(), X, intervals=N).arrays
    signs = np.ones(12)
    signs[ROLLS] = -1.0
    for name in ("q", "qd", "qdd"):
        first, second = arrays[name][1 : N + 1], arrays[name][N + 1 :]
        assert second == pytest.approx(first[:, EXCHANGED] * signs, abs=1e-12)
    assert arrays["left_stance"].tolist() == [1.0] * (N + 1) + [0.0] * N
    assert arrays["t"][-1] == 2.0


def test_angles_and_feet_go_on_where_steps_meet() -> None:
    arrays = compute_steps(load_point_mass_biped(), X, steps=3, intervals=2000).arrays
    for name in ("q", "waist", "left_ankle", "right_ankle", "com"):
        assert np.abs(np.diff(arrays[name], axis=0)).max() < 2e-3, name
    assert arrays["left_ankle"][-1] == pytest.approx([X[0], 0.0, 0.0], abs=1e-12)
    assert arrays["right_ankle"][-1] == pytest.approx([1.5 * X[0], -0.12, 0.0], abs=1e-12)


def test_each_step_of_a_circle_turns_by_k() -> None:
    turn, steps = np.radians(7.5), 48
    arrays = compute_steps(load_point_mass_biped(), X, steps=steps + 1, intervals=2, turn_rad=turn).arrays
    assert arrays["q"][:3, JOINTS.index("theta_9")] == pytest.approx(turn)
    assert arrays["q"][3:5, JOINTS.index("theta_4")] == pytest.approx(turn)
    assert not arrays["q"][:3, JOINTS.index("theta_4")].any()
    # 48 steps of 7.5 degrees: the left foot stands again where and as it stood.
    assert arrays["left_ankle"][2 * steps + 1] == pytest.approx(arrays["left_ankle"][1], abs=1e-9)
    span = np.ptp(arrays["waist"][:, 0])
    assert span == pytest.approx(X[0] / turn, rel=0.15)  # diameter of a polygon of chords s / 2
