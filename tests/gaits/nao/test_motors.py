"""Real motors in the NAO problems, against numbers by hand from the time histories."""

import json
import math
from importlib import resources
from pathlib import Path

import numpy as np
import pytest
from scipy.integrate import trapezoid

from nlp_gait import load
from nlp_gait.errors import InputError
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


def test_both_are_simulated_with_the_rotors_of_the_plan() -> None:
    for name in ("nao-ssp", "nao-dsp", "nao-cycle"):
        plain, heavy = load(name).display.simulation_model, load(name, motors="rotor").display.simulation_model
        assert plain is not None and not any(joint.armature_kgm2 for joint in plain.robot.joints.values())
        assert heavy is not None and heavy.robot.joint("LKneePitch").armature_kgm2 == pytest.approx(4.2e-7 * 130.85**2)
        assert heavy.robot.joint("RAnkleRoll").armature_kgm2 == pytest.approx(4.2e-7 * 201.3**2)
        assert heavy.robot.joint("LHipYawPitch").armature_kgm2 == pytest.approx(
            4.2e-7 * 201.3**2 / 2
        )  # one motor for two


def test_a_robot_whose_rotors_are_unknown_is_refused(tmp_path: Path) -> None:
    data = json.loads((resources.files("nlp_gait.robots") / "data" / "nao-v5.json").read_text())
    del data["joints"]["LKneePitch"]["motor"]["rotor_inertia_gcm2"]
    path = tmp_path / "unknown.json"
    path.write_text(json.dumps(data))
    load("nao-ssp", robot=str(path), motors="limits")
    with pytest.raises(InputError, match="'LKneePitch' has no rotor_inertia_gcm2"):
        load("nao-ssp", robot=str(path), motors="rotor")


def test_a_cycle_pays_for_its_rotors_and_real_motors() -> None:
    """Energy of the cycle from its time histories: with free braking and rotors, phase by phase."""
    problem = load("nao-cycle", motors="rotor,free-braking", intervals=4)
    x = (problem.lower + problem.upper) / 2
    x[problem.names.index("single_support_time_s")] = 0.4  # accelerations large enough for rotors to matter
    signals = problem.signals(x)
    torque, rate, t = (signals.arrays[name] for name in ("tau", "qd", "t"))
    power = (np.maximum(torque * rate, 0.0) + 0.025 * torque**2).sum(axis=1)
    single = evaluated(problem, x).indexes["ssp_power_W"]
    assert single == pytest.approx(float(mean(power[:5])), rel=1e-9)
    assert t[4] == pytest.approx(0.4)
    light = evaluated(load("nao-cycle", motors="free-braking", intervals=4), x).indexes["ssp_power_W"]
    assert abs(single / light - 1.0) > 0.01
