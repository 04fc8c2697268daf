"""Set-points of drives: linear or held between two of them, shifted by the feed-forward."""

from dataclasses import FrozenInstanceError, replace

import numpy as np
import pytest

import nlp_gait.robots
from nlp_gait.errors import InputError
from nlp_gait.simulation.drive import DRIVES, Drive

ROBOT = nlp_gait.robots.load_robot("nao-v5")
JOINTS = [ROBOT.joint(name) for name in ("LKneePitch", "LHipRoll")]
TIMES = np.linspace(0.0, 1.0, 2001)[:-1]


def planned(name, times):
    """A sine, its rate, and torques of another scale."""
    phase = np.array([0.0, 1.0])
    waves = {"q": np.sin(times[:, None] + phase), "qd": np.cos(times[:, None] + phase)}
    return waves[name] if name in waves else 3.0 * np.cos(2.0 * times[:, None] + phase)


def set_points(**settings):
    return Drive(**settings).set_points(planned, TIMES, JOINTS)


def test_linear_set_points_lie_on_the_chords_and_held_ones_on_steps():
    linear, held = (set_points(period_s=0.04, feed_forward="none", interpolation=name) for name in ("linear", "held"))
    knots = np.arange(26) * 0.04
    for column in range(2):
        on_chords = np.interp(TIMES, knots, planned("q", knots)[:, column])
        np.testing.assert_allclose(linear[:, column], on_chords, atol=1e-12)
    before = np.repeat(planned("q", knots[:-1]), 80, axis=0)
    np.testing.assert_allclose(held, before, atol=1e-12)


def test_a_servo_without_error_gives_the_planned_torque():
    """Stiffness (set-point - angle) - damping rate is the torque of the feed-forward, at every set-point."""
    drive = Drive()
    at = np.round(np.arange(100) * 0.01 / 0.0005).astype(int)
    stiffness, damping = (np.array([f(joint) for joint in JOINTS]) for f in (drive.stiffness, drive.damping))
    q, qd, tau = (planned(name, TIMES[at]) for name in ("q", "qd", "tau"))
    np.testing.assert_allclose(stiffness * (set_points()[at] - q) - damping * qd, tau, atol=1e-9)
    only_velocity = stiffness * (set_points(feed_forward="velocity")[at] - q) - damping * qd
    np.testing.assert_allclose(only_velocity, 0.0, atol=1e-9)


def test_drives_by_name_and_settings_that_do_not_exist():
    assert DRIVES["feed-forward"] == Drive()
    assert (DRIVES["held"].period_s, DRIVES["held"].interpolation, DRIVES["held"].feed_forward) == (
        0.04,
        "held",
        "none",
    )
    with pytest.raises(InputError, match="feed forward of a drive must be one of torque, velocity, none, got 'all'"):
        replace(Drive(), feed_forward="all")
    with pytest.raises(FrozenInstanceError):  # drives by name are everybody's
        DRIVES["held"].period_s = 0.01
    with pytest.raises(InputError, match="interpolation of a drive must be one of linear, held, got 'cubic'"):
        Drive(interpolation="cubic")


def test_a_drive_is_as_stiff_as_its_motor_is_strong_and_its_limit_is_the_requested_one():
    joint = ROBOT.joint("LKneePitch")
    bare = replace(joint, motor=None)
    limits = {name: Drive(torque_limits=name).torque_limit(joint) for name in ("urdf", "stall", "continuous")}
    stall = joint.motor.stall_torque_Nm
    assert limits == {"urdf": joint.torque_limit_Nm, "stall": stall, "continuous": joint.motor.continuous_torque_Nm}
    assert len(set(limits.values())) == 3
    assert all(Drive(torque_limits=name).torque_limit(bare) == joint.torque_limit_Nm for name in limits)
    assert Drive().stiffness(joint) == stall / 0.08 and Drive().stiffness(bare) == joint.torque_limit_Nm / 0.08
    assert Drive().damping(joint) == Drive().stiffness(joint) * 0.02
    assert Drive().make_corrector(None, None) is None
