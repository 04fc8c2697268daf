"""Numbers of a simulation, from a trace made by hand of which each is known."""

import math
from dataclasses import replace

import numpy as np
import pytest

pytest.importorskip("mujoco")

from nlp_gait.formulation import Signals, make_vector_columns  # noqa: E402
from nlp_gait.robots import load_robot  # noqa: E402
from nlp_gait.simulation.drive import Drive  # noqa: E402
from nlp_gait.simulation.measurements import _measure_walked_distance, average_pressure, measure  # noqa: E402
from nlp_gait.simulation.plan import Plan  # noqa: E402
from nlp_gait.simulation.simulate import Simulation  # noqa: E402

ROBOT = load_robot("nao-v5")
JOINTS = ("LKneePitch", "LHipRoll")
STEP_S = 0.0005
PHASE_S, WHOLE_S = 1.0, 1.2
LANDED_S = 0.9
TORQUE = np.array([1.0, -0.5])
ZMP = np.array([0.01, 0.05])


def swing(t):
    """A sole that goes 0.12 m ahead and 20 mm up, over one phase."""
    return np.stack([0.12 * t - 0.06, np.full(len(t), -0.05), 0.08 * t * (1.0 - t)], axis=1)


def still(t, place):
    return np.tile(place, (len(t), 1))


def planned():
    """The left foot stands, the right one swings; one joint moves at 0.5 rad/s, under constant torques."""
    t = np.linspace(0.0, PHASE_S, 101)
    arrays = {
        "t": t,
        "q": np.stack([0.5 * t, 0.0 * t], axis=1),
        "qd": still(t, [0.5, 0.0]),
        "tau": still(t, TORQUE),
        "zmp": still(t, ZMP),
        "hip": still(t, [0.0, 0.0, 0.3]),
        "left_foot": still(t, [0.0, 0.05, 0.0]),
        "right_foot": swing(t),
    }
    columns = {"zmp": make_vector_columns("m", "xy")} | {
        name: make_vector_columns("m") for name in ("hip", "left_foot", "right_foot")
    }
    signals = Signals(joints=JOINTS, arrays=arrays, columns=columns)
    return Plan(robot=ROBOT, full_robot=ROBOT, signals=signals, heat_loss=0.1, gravity=9.81)


def traced(**changed):
    """What would be seen of it: the first joint 0.01 rad ahead, the sole on the ground from 0.9 s on, pressure 5 mm off."""
    t = np.arange(round(WHOLE_S / STEP_S) + 1) * STEP_S
    during = np.minimum(t, PHASE_S)
    landed = t >= LANDED_S - 1e-9
    right = swing(during) + (0.003, -0.004, 0.0)
    right[:, 2] = np.maximum(0.05 * (LANDED_S - t), 0.0)  # 50 mm/s down to the ground
    left = still(t, [0.0, 0.05, 0.0])
    loads = np.where(landed[:, None], [30.0, 20.0], [50.0, 0.0])
    fields = {
        "t": t,
        "plan_t": t,
        "states": np.zeros((len(t), 0)),
        "q": np.stack([0.5 * during + 0.01, 0.0 * t], axis=1),
        "qd": still(t, [0.5, 0.2]),
        "torque": still(t, TORQUE),
        "set_points": still(t, [0.0, 0.0]),
        "torso": still(t, [0.0, 0.0, 0.3]),
        "tilt": np.where(t > PHASE_S, 0.2, 0.1),
        "heading": 0.0 * t,
        "feet": np.stack([left, right], axis=1),
        "loads": loads,
        "risers": np.zeros((len(t), 2)),
        "pressure": still(t, ZMP + (0.003, 0.004)),
        "fell_at_s": None,
    }
    return Simulation(**(fields | changed))


def measured(**changed):
    return measure(planned(), traced(**changed), Drive())


def test_angles_power_and_falls_are_those_of_the_phase() -> None:
    found = measured()
    assert (found.fallen, found.fell_at_s) == (False, None)
    assert found.largest_tilt_deg == pytest.approx(math.degrees(0.2))  # while settling
    assert found.tracking_max_rad == pytest.approx(0.01) and found.tracking_rms_rad == pytest.approx(0.01 / 2**0.5)
    assert (found.predicted.mechanical_W, found.predicted.signed_W) == pytest.approx((0.5, 0.5))
    assert (found.measured.mechanical_W, found.measured.signed_W) == pytest.approx((0.6, 0.4))
    assert (found.predicted.heat_W, found.measured.heat_W) == pytest.approx((0.125, 0.125))
    assert found.measured.total_W == pytest.approx(0.725)
    slipped = traced()
    slipped.feet[1900:, 0, 0] = 0.02
    assert measure(planned(), slipped, Drive()).slip_m == pytest.approx(0.02)
    stepped = measure(planned(), replace(slipped, stepped_at_s=0.9), Drive())
    assert (stepped.slip_m, stepped.stepped_at_s) == (0.0, 0.9)
    fallen = measured(fell_at_s=1.1)
    assert (fallen.fallen, fallen.fell_at_s) == (True, 1.1)


def test_limits_that_are_met_are_named_with_their_share() -> None:
    trace, limit = traced(), ROBOT.joint("LHipRoll").torque_limit_Nm
    torque, q = trace.torque.copy(), trace.q.copy()
    torque[:500, 1] = -limit  # of the phase's 2,001 samples
    torque[-100:, 0] = 99.0  # while settling: not of the phase
    q[600, 1], q[-1, 0] = ROBOT.joint("LHipRoll").limits_rad[1] + 0.01, 9.0
    found = measured(torque=torque, q=q)
    assert found.saturated == {"LHipRoll": pytest.approx(500 / 2001)} and found.joint_limits == ("LHipRoll",)
    assert measured().saturated == found.beyond_limit == {} and measured().joint_limits == ()
    plan = planned()
    tau = plan.signals.arrays["tau"].copy()
    tau[50] = 2.0 * limit, -1.5 * limit  # at one moment
    strained = replace(plan, signals=replace(plan.signals, arrays={**plan.signals.arrays, "tau": tau}))
    expected = {"LHipRoll": 1.5, "LKneePitch": 2.0 * limit / ROBOT.joint("LKneePitch").torque_limit_Nm}
    found = measure(strained, traced(), Drive()).beyond_limit
    assert found == {name: pytest.approx(share) for name, share in expected.items() if share > 1.0}


def test_a_foot_lands_where_the_ground_first_carries_it_for_3_ms() -> None:
    loads = traced().loads.copy()
    for brush, samples in ((0.3, 40), (0.7, 5)):  # in the first half of the swing, and 2.5 ms
        begin = round(brush / STEP_S)
        loads[begin : begin + samples, 1] = 20.0
    found = measured(loads=loads)
    (touchdown,) = found.touchdowns
    assert (touchdown.side, touchdown.planned_s) == ("right", pytest.approx(PHASE_S, abs=2 * STEP_S))
    assert touchdown.measured_s == pytest.approx(LANDED_S)
    assert touchdown.speed_m_s == found.landing_speed_m_s == pytest.approx(0.05)
    assert found.earliest_landing_s == touchdown.planned_s - touchdown.measured_s
    loads[round(0.7 / STEP_S) + 5, 1] = 20.0  # 3 ms
    assert measured(loads=loads).touchdowns[0].measured_s == pytest.approx(0.7)
    loads[:, 1] = 0.0
    never = measured(loads=loads)
    assert (never.touchdowns, never.earliest_landing_s, never.landing_speed_m_s) == ((), None, None)
    assert found.landing_errors_m == {"right": pytest.approx(0.005)}  # 3 mm ahead, 4 mm to the right


def test_where_no_foot_stands_throughout_slip_is_that_of_each_support() -> None:
    plan = planned()
    t = plan.signals.arrays["t"]
    first, second = swing(np.clip(2 * t, 0.0, 1.0)), swing(np.clip(2 * t - 1, 0.0, 1.0))
    feet = {"left_foot": first * (1, -1, 1), "right_foot": second}
    walking = replace(plan, signals=replace(plan.signals, arrays={**plan.signals.arrays, **feet}))
    assert walking.supports == ()
    trace = traced()
    paths = np.stack([walking.at(name, trace.t) for name in feet], axis=1)
    assert measure(walking, replace(trace, feet=paths), Drive()).slip_m < 3e-4  # of splines
    paths[1:, 1, 0] += (
        0.005  # the right foot stands in the first half: here 5 mm ahead of where it began, then 10 behind
    )
    paths[200:900, 1, 0] -= 0.015
    assert measure(walking, replace(trace, feet=paths), Drive()).slip_m == pytest.approx(0.010, abs=3e-4)


def test_distance_is_along_the_planned_way_and_to_its_left() -> None:
    feet = np.zeros((2, 2, 3))
    feet[1, :, :2] = 0.5, 2.0  # both feet
    assert _measure_walked_distance(traced(feet=feet), (3.0, 4.0)) == pytest.approx((1.9, 0.8))


def test_the_planned_attitude_is_that_of_the_nearest_sample() -> None:
    plan = planned()
    half = 0.1 * plan.signals.arrays["t"] / 2
    leaning = np.stack([np.cos(half), 0 * half, 0 * half, np.sin(half)], axis=1)
    arrays = {**plan.signals.arrays, "attitude": leaning}
    columns = {**plan.signals.columns, "attitude": make_vector_columns("1", "wxyz")}
    turned = replace(plan, signals=replace(plan.signals, arrays=arrays, columns=columns))
    assert turned.heading(np.array([0.304, 0.306, 2.0])) == pytest.approx([0.03, 0.031, 0.1])


def test_pressure_is_compared_with_the_plan() -> None:
    found = measured()
    assert (found.pressure_rms_m, found.pressure_middle_rms_m) == pytest.approx((0.005, 0.005)) and found.slip_m == 0.0
    feet = traced().feet.copy()
    feet[500:, 0, :2] += (0.003, 0.004)  # the supporting foot slips, and the pressure goes with it
    slipped = measured(feet=feet)
    assert slipped.slip_m == pytest.approx(0.005) and slipped.pressure_rms_m == pytest.approx(0.005)
    pressure = traced().pressure.copy()
    pressure[:200] += 0.1  # the first tenth of the phase is not its middle
    rough = measured(pressure=pressure)
    assert rough.pressure_middle_rms_m == pytest.approx(0.005)
    assert rough.pressure_rms_m == pytest.approx((0.1 * (0.103**2 + 0.104**2) + 0.9 * 0.005**2) ** 0.5, rel=1e-2)
    flight = measured(loads=np.zeros((len(traced().t), 2)), pressure=np.full((len(traced().t), 2), np.nan))
    assert flight.pressure_rms_m is flight.pressure_middle_rms_m is None


def test_pressure_is_averaged_over_a_period_by_load() -> None:
    trace = traced()
    pressure, loads = trace.pressure.copy(), trace.loads.copy()
    loads[1000], pressure[1000] = (100.0, 50.0), (1.0, 0.0)  # three times the load of the other nine samples
    x, y = average_pressure(replace(trace, pressure=pressure, loads=loads), 10 * STEP_S)[1000]
    usual = ZMP + (0.003, 0.004)
    assert (x, y) == pytest.approx(((9 * usual[0] + 3 * 1.0) / 12, 9 * usual[1] / 12))
    for load, nothing in ((0.45, True), (0.55, False)):  # of each foot; 1 N in all is the least that counts
        light = average_pressure(replace(trace, loads=np.full_like(loads, load)), 10 * STEP_S)
        assert np.isnan(light).all() == np.isnan(light).any() == nothing
