"""Real motors in the NAO problems, against numbers by hand from the time histories."""

from __future__ import annotations

import math

import numpy as np
import pytest
from casadi import MX, Function
from scipy.integrate import trapezoid

from nlp_gait import load, solve
from nlp_gait.backends.exact import exact_model
from nlp_gait.errors import InputError, UnknownNameError
from nlp_gait.problem import GaitProblem
from nlp_gait.problems.nao.motors import ANKLE_ROLL, ankle_roll
from nlp_gait.robots import load_robot

X = np.array([0.31, -0.002, 0.0034, 0.008, 0.0025, 0.0243, -0.0256, 0.015, 4.0])


def exact(problem: GaitProblem, x: np.ndarray) -> tuple[float, dict[str, float]]:
    """Objective, and values of all rows by name."""
    model = exact_model(problem)
    at = model.at(x, problem.p)
    return at.cost, dict(zip(model.row_names, at.g.tolist(), strict=True))


def mean(samples: np.ndarray) -> np.ndarray:
    return trapezoid(samples, axis=0) / (len(samples) - 1)


def test_without_features_it_is_the_same_problem() -> None:
    plain, empty = load("nao-ssp"), load("nao-ssp", motors="")
    assert plain.options == empty.options and "motors" not in plain.options
    assert exact(plain, X) == exact(empty, X)


@pytest.mark.parametrize("features", ["free-braking", "regeneration", "heat", "heat,free-braking"])
def test_power_is_that_of_the_time_histories(features: str) -> None:
    problem = load("nao-ssp", motors=features)
    assert problem.signals is not None
    signals = problem.signals(X)
    torque, rate = signals.arrays["tau"], signals.arrays["qd"]
    driven = torque * rate
    if "free-braking" in features:
        driven = np.maximum(driven, 0.0)
    elif "regeneration" not in features:
        driven = np.abs(driven)
    if "heat" in features:
        robot = load_robot("nao-v5")
        heat = np.zeros(len(torque))
        shared = torque[:, signals.joints.index("LHipYawPitch")] + torque[:, signals.joints.index("RHipYawPitch")]
        for k, joint in enumerate(signals.joints):
            motor = robot.joint(joint).motor
            assert motor is not None
            at_motor = {"LHipYawPitch": shared, "RHipYawPitch": 0.0 * shared}.get(
                joint, torque[:, k]
            ) / motor.gear_ratio
            # R I^2 with I = torque / k_t, k_t = V / no-load speed and R = k_t V / stall torque, at any voltage.
            voltage = 21.6
            k_t = voltage / (motor.no_load_rpm * math.tau / 60.0)
            resistance = k_t * voltage / (motor.stall_torque_mNm / 1000.0)
            heat += resistance * (at_motor / k_t) ** 2
    else:
        heat = 0.025 * (torque**2).sum(axis=1)
    power, _ = exact(problem, X)
    assert power == pytest.approx(float(mean(driven.sum(axis=1) + heat)), rel=1e-9)


def test_limits_are_those_of_the_data_sheet() -> None:
    problem = load("nao-ssp", motors="limits")
    assert problem.signals is not None
    signals = problem.signals(X)
    knee = signals.joints.index("LKneePitch")
    torque, rate = signals.arrays["tau"][:, knee], signals.arrays["qd"][:, knee]
    motor = load_robot("nao-v5").joint("LKneePitch").motor
    assert motor is not None
    assert motor.stall_torque_Nm == pytest.approx(8.5053, abs=1e-4)
    assert motor.no_load_rad_s == pytest.approx(6.9626, abs=1e-4)
    _, rows = exact(problem, X)
    slope = motor.stall_torque_Nm / motor.no_load_rad_s
    for k in (0, 5, 10):
        assert rows[f"joint_speed[LKneePitch, {k}]"] == pytest.approx(rate[k], abs=1e-12)
        assert rows[f"torque_forwards[LKneePitch, {k}]"] == pytest.approx(torque[k] + slope * rate[k])
        assert rows[f"torque_backwards[LKneePitch, {k}]"] == pytest.approx(torque[k] - slope * rate[k])
    assert rows["continuous_torque[LKneePitch]"] == pytest.approx(math.sqrt(mean(torque**2)))


def test_a_flat_battery_binds() -> None:
    """At a fifth of the voltage the knee's torque at the optimum is beyond what its motor gives."""
    problem = load("nao-dsp", motors="limits")
    weak = solve(problem.with_values(supply_share=0.18))
    assert weak.success
    assert any(a.name.startswith("torque_") and "[" in a.name for a in weak.active_constraints)
    assert weak.objective > solve(problem).objective + 1e-4


def test_the_ankles_roll_follows_the_table() -> None:
    pitch = MX.sym("pitch")
    for column in (1, 2):
        line = Function("line", [pitch], [ankle_roll(pitch, column)])
        for row in ANKLE_ROLL:
            assert float(line(row[0])) == pytest.approx(row[column], abs=1e-9)
        middle = (ANKLE_ROLL[2][0] + ANKLE_ROLL[3][0]) / 2
        expected = (ANKLE_ROLL[2][column] + ANKLE_ROLL[3][column]) / 2
        assert float(line(middle)) == pytest.approx(expected, abs=1e-9)
        assert float(line(-3.0)) == pytest.approx(ANKLE_ROLL[0][column])


def test_ankle_rows_mirror() -> None:
    _, rows = exact(load("nao-ssp", motors="ankle"), X)
    for side in "LR":
        assert all(rows[f"{side}AnkleRoll_least[{k}]"] > 0.0 for k in range(11))
        assert all(rows[f"{side}AnkleRoll_greatest[{k}]"] < 0.0 for k in range(11))


def test_an_index_keeps_the_papers_power() -> None:
    problem = load("nao-ssp", motors="heat")
    model = exact_model(problem)
    indexes = model.at(X, problem.p).indexes
    assert indexes["paper_power_W"] == pytest.approx(exact(load("nao-ssp"), X)[0])
    assert indexes["power_W"] == exact(problem, X)[0]


@pytest.mark.parametrize(
    ("features", "error", "said"),
    [
        ("limit", UnknownNameError, "limits"),
        ("regeneration,free-braking", InputError, "either"),
    ],
)
def test_nonsense_is_refused(features: str, error: type[Exception], said: str) -> None:
    with pytest.raises(error, match=said):
        load("nao-ssp", motors=features)


def test_another_objective_has_no_power_to_change() -> None:
    with pytest.raises(InputError, match="objective is joint_jerk"):
        load("nao-dsp", objective="jerk", motors="heat")
