"""Real motors in the NAO problems, against numbers by hand from the time histories."""

import math

import numpy as np
import pytest
from scipy.integrate import trapezoid

from nlp_gait import load
from nlp_gait.robots import load_robot
from tests.evaluation import evaluated

X = np.array([0.31, -0.002, 0.0034, 0.008, 0.0025, 0.0243, -0.0256, 0.015, 4.0])


def mean(samples: np.ndarray) -> np.ndarray:
    return trapezoid(samples, axis=0) / (len(samples) - 1)


@pytest.mark.parametrize(
    ("name", "features"),
    [
        ("nao-ssp", "free-braking"),
        ("nao-ssp", "regeneration"),
        ("nao-ssp", "heat"),
        ("nao-ssp", "heat,free-braking"),
        ("nao-dsp", "heat,free-braking"),
    ],
)
def test_power_is_that_of_the_time_histories(name: str, features: str) -> None:
    problem = load(name, motors=features)
    x = X if name == "nao-ssp" else (problem.lower + problem.upper) / 2
    signals = problem.signals(x)
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
    assert evaluated(problem, x).cost == pytest.approx(float(mean(driven.sum(axis=1) + heat)), rel=1e-9)
