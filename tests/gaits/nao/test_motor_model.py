"""Real motors: formulas at artificial samples against NumPy, and power in the NAO problems by hand."""

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import casadi as ca
import numpy as np
import pytest
from casadi import DM, MX
from scipy.integrate import trapezoid

from nlp_gait import load
from nlp_gait.errors import InputError, UnknownNameError
from nlp_gait.formulation import Array, Constraint, Grid
from nlp_gait.gaits.biped.limits import Limit
from nlp_gait.gaits.biped.motors import SUPPLY, Motors
from nlp_gait.gaits.biped.samples import Samples
from nlp_gait.gaits.nao.body import ANKLE_ROLL, JOINTS, YAW_PITCHES, parse_nao_motors
from nlp_gait.robots import load_robot
from nlp_gait.symbolic.nonsmooth import Exact
from tests.evaluation import evaluated

ROBOT = load_robot("nao-v5")
MOTORS = tuple(joint for joint in JOINTS if joint != "RHipYawPitch")
MOVING = tuple(joint for joint in reversed(MOTORS) if "Hip" in joint or "Knee" in joint or "Ankle" in joint)
COUNT = 4  # of samples
AT: Mapping[str, MX] = {"supply_share": MX(0.8), "heat_loss_W_per_Nm2": MX(0.03)}
RNG = np.random.default_rng(5)
TORQUE = RNG.normal(size=(len(JOINTS), COUNT))
POWER, Q, QD = (RNG.normal(size=(len(MOVING), COUNT)) for _ in range(3))
Q[:, 0], Q[:, 1] = -1.5, 1.2  # beyond both ends of the ankles' table
SAMPLES = Samples(
    joints=JOINTS,
    moving=MOVING,
    standing=("L",),
    grid=Grid(intervals=COUNT - 1),
    duration=MX(1.0),
    progress=MX(DM(np.linspace(0.0, 1.0, COUNT)).T),
    evaluate={
        Samples.torque: MX(DM(TORQUE)),
        Samples.power: MX(DM(POWER)),
        Samples.q: MX(DM(Q)),
        Samples.qd: MX(DM(QD)),
    }.__getitem__,
)


def number(value: MX | None) -> Array | None:
    return None if value is None else np.array(ca.evalf(value)).T.ravel()


def mean(samples: Array) -> Array:
    """By the trapezoidal rule over the last axis."""
    return np.asarray((samples[..., :-1] + samples[..., 1:]).sum(axis=-1) / 2 / (COUNT - 1))


def at_motors() -> Array:
    """Torques with those of both hip yaw-pitch joints at the left one's motor."""
    found = TORQUE.copy()
    found[JOINTS.index("LHipYawPitch")] += found[JOINTS.index("RHipYawPitch")]
    return np.delete(found, JOINTS.index("RHipYawPitch"), axis=0)


def ratings(name: str) -> Array:
    return np.array([getattr(ROBOT.joint(joint).motor, name) for joint in MOTORS])


def rows_of(limit: Limit) -> dict[str, Constraint]:
    return {row.name: row for row in limit.add(AT, SAMPLES, Exact())[0]}  # type: ignore[arg-type]


def test_limits() -> None:
    (limit,) = parse_nao_motors("limits, rotor", ROBOT).limits
    assert limit.parameters == (SUPPLY,)
    assert (SUPPLY.default, SUPPLY.minimum, SUPPLY.maximum) == (1.0, 0.05, 2.0)
    found = rows_of(limit)
    assert list(found) == ["joint_speed", "torque_forwards", "torque_backwards", "continuous_torque"]
    instants = [str(k) for k in range(COUNT)]
    for name, joints, unit in (("joint_speed", MOVING, "rad/s"), ("torque_forwards", MOTORS, "Nm")):
        assert found[name].labels == tuple(f"{joint}, {k}" for k in instants for joint in joints)
        assert (found[name].unit, found[name].over) == (unit, "instant")

    speed = np.array([ROBOT.joint(joint).velocity_limit_rad_s for joint in MOVING])
    np.testing.assert_array_equal(number(found["joint_speed"].value), QD.T.ravel())
    for bound, sign in ((found["joint_speed"].lower, -1.0), (found["joint_speed"].upper, 1.0)):
        np.testing.assert_allclose(number(bound), sign * np.tile(speed, COUNT), rtol=1e-15)

    rate = np.zeros((len(MOTORS), COUNT))
    rate[[MOTORS.index(joint) for joint in MOVING]] = QD
    stall = ratings("stall_torque_Nm")
    drop = (stall / ratings("no_load_rad_s"))[:, None] * rate
    for name, sign in (("torque_forwards", 1.0), ("torque_backwards", -1.0)):
        value = at_motors() + sign * drop
        np.testing.assert_allclose(number(found[name].value), value.T.ravel(), rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(number(found[name].upper), 0.8 * np.tile(stall, COUNT), rtol=1e-14)
        np.testing.assert_allclose(number(found[name].lower), -0.8 * np.tile(stall, COUNT), rtol=1e-14)

    warm = found["continuous_torque"]
    assert (warm.labels, warm.lower, warm.over) == (MOTORS, None, "root-mean-square")
    np.testing.assert_allclose(number(warm.value), np.sqrt(mean(at_motors() ** 2)), rtol=1e-12)
    np.testing.assert_allclose(number(warm.upper), ratings("continuous_torque_Nm"), rtol=1e-15)


def test_ankles() -> None:
    (limit,) = parse_nao_motors("ankle", ROBOT).limits
    found, corners = rows_of(limit), np.array(ANKLE_ROLL)
    assert len(found) == 4
    for side, sign, least, greatest in (("L", 1.0, 1, 2), ("R", -1.0, 2, 1)):
        pitch, roll = (Q[MOVING.index(f"{side}Ankle{axis}")] for axis in ("Pitch", "Roll"))
        for name, column in (("least", least), ("greatest", greatest)):
            row = found[f"{side}AnkleRoll_{name}"]
            assert (row.unit, row.labels, row.over) == ("rad", tuple(str(k) for k in range(COUNT)), "instant")
            line = sign * np.interp(pitch, corners[:, 0], corners[:, column])
            np.testing.assert_allclose(number(row.value), roll - line, rtol=0, atol=1e-14)
            lower, upper = number(row.lower), number(row.upper)
            assert (lower, upper) == ((0.0, None) if name == "least" else (None, 0.0))


def test_the_ankles_table_is_round_in_degrees() -> None:
    """Pitch, least and greatest roll in degrees, in which the table was apparently written."""
    table = [
        *((-68.15, -2.86, 4.30), (-48.13, -10.31, 9.74), (-40.11, -22.80, 12.61), (-25.78, -22.80, 44.06)),
        *((5.73, -22.80, 44.06), (20.05, -22.80, 31.54), (52.87, 0.0, 2.86)),
    ]
    np.testing.assert_allclose(np.degrees(ANKLE_ROLL), table, rtol=0, atol=5e-5)


def test_features() -> None:
    assert len(parse_nao_motors("ankle, limits", ROBOT).limits) == 2
    heavy = parse_nao_motors("rotor", ROBOT)
    assert (
        heavy.limits == ()
        and heavy.power is None
        and {j.name for j in heavy.model.joints.values() if j.armature_kgm2} == set(JOINTS)
    )
    with pytest.raises(UnknownNameError, match="feature in motors 'ankle'"):
        Motors(features=("ankle",), robot=ROBOT, joints=JOINTS)
    with pytest.raises(InputError, match="either draws nothing"):
        parse_nao_motors("regeneration, free-braking", ROBOT)


def test_joints_that_share_a_motor() -> None:
    torque: Any = MX(DM(TORQUE))
    assert Motors(features=("heat",), robot=ROBOT, joints=JOINTS).sum_by_motor(torque) is torque
    shared = np.array(
        ca.evalf(Motors(features=("heat",), robot=ROBOT, joints=JOINTS, shared=YAW_PITCHES).sum_by_motor(torque))
    )
    np.testing.assert_allclose(np.delete(shared, JOINTS.index("RHipYawPitch"), axis=0), at_motors(), rtol=1e-15)
    assert not shared[JOINTS.index("RHipYawPitch")].any()
    inertia = {
        name: motors.model.joint("LHipYawPitch").armature_kgm2
        for name, motors in (
            ("one each", Motors(features=("rotor",), robot=ROBOT, joints=JOINTS)),
            ("one for two", parse_nao_motors("rotor", ROBOT)),
        )
    }
    assert inertia["one each"] == 2 * inertia["one for two"] > 0.0


def test_a_robot_without_motors_or_rotors_is_refused() -> None:
    knee = ROBOT.joint("LKneePitch")
    bare = replace(ROBOT, joints={**ROBOT.joints, "LKneePitch": replace(knee, motor=None)})
    assert parse_nao_motors("", bare).model is bare and parse_nao_motors("ankle", ROBOT).model is ROBOT
    with pytest.raises(InputError, match="'LKneePitch' has no motor data"):
        parse_nao_motors("limits", bare)
    assert knee.motor is not None
    rotorless = replace(knee, motor=replace(knee.motor, rotor_inertia_gcm2=None))
    with pytest.raises(InputError, match="'LKneePitch' has no rotor_inertia_gcm2"):
        parse_nao_motors("rotor", replace(ROBOT, joints={**ROBOT.joints, "LKneePitch": rotorless}))


X = np.array([0.31, -0.002, 0.0034, 0.008, 0.0025, 0.0243, -0.0256, 0.015, 4.0])


def average(samples: np.ndarray) -> np.ndarray:
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
    assert evaluated(problem, x).cost == pytest.approx(float(average(driven.sum(axis=1) + heat)), rel=1e-9)
