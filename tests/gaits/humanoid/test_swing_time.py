"""Bounds on times and velocities from the joints that swing a robot's legs."""

import numpy as np
import pytest

from nlp_gait.backends.plan_walk import describe_own_bounds
from nlp_gait.formulation import load
from nlp_gait.gaits.biped.body import Support, make_hip_variables, make_time_variable, make_usual_bounds
from nlp_gait.gaits.humanoid.body import Humanoid, make_humanoid
from nlp_gait.robots.biped import compare_swing, find_least_swing_time
from tests.robots.crooked import crooked

pytest.importorskip("lxml")


@pytest.fixture(scope="module")
def body(tmp_path_factory: pytest.TempPathFactory) -> Humanoid:
    return make_humanoid(crooked(tmp_path_factory.mktemp("crooked")))


def test_the_least_swing_is_within_speed_and_torque_of_the_hip(body: Humanoid) -> None:
    """Sampled angles of the swing of a rod: one of the two limits is reached, none is exceeded."""
    leg, time = body.biped.legs["left"], find_least_swing_time(body.biped)
    joints = [body.biped.model.joint(name) for name in leg.joints]
    hip = max(joints[:3], key=lambda joint: abs(leg.axes[leg.joints.index(joint.name)][1]))
    s = np.linspace(0.0, 1.0, 1001)
    angle = 2 * 0.06 / 0.2029 * (3 * s**2 - 2 * s**3)
    rate = np.gradient(angle, s * time)
    mass = sum(body.biped.model.links[joint.child].mass_kg for joint in joints)
    torque = mass * leg.length_m**2 / 3 * np.gradient(rate, s * time)
    shares = np.abs(rate).max() / hip.velocity_limit_rad_s, np.abs(torque).max() / hip.torque_limit_Nm
    assert max(shares) == pytest.approx(1.0, rel=0.01)


def test_bounds_of_a_robot_of_other_size_are_wider_and_those_of_naos_size_the_papers(body: Humanoid) -> None:
    faster = compare_swing(body.biped)
    assert faster > 1.0 and body.swing_speed == faster
    time, nao = make_time_variable(body, Support.SINGLE), make_humanoid("nao-v5")
    assert time.lower == pytest.approx(body.scale_time(0.4) / faster, rel=1e-3)
    assert time.upper == body.scale_time(4.0)
    assert nao.swing_speed == 1.0 and make_time_variable(nao, Support.SINGLE).lower == pytest.approx(0.4)
    for variable in (*make_hip_variables(body), time):
        usual = make_usual_bounds(body, variable)
        assert variable.lower <= usual.lower < usual.upper <= variable.upper
    assert make_usual_bounds(body, time).lower == pytest.approx(body.scale_time(0.4), rel=1e-3)


def test_an_infeasible_walk_names_the_bounds_that_are_not_the_robots() -> None:
    problem = load("humanoid-cycle", intervals=2)
    x = problem.by_name((problem.lower + problem.upper) / 2)
    assert describe_own_bounds(problem, x) == []
    x["single_support_time_s"] = 0.4
    assert describe_own_bounds(problem, x) == [
        "it reaches bounds of this package, not of the robot: single_support_time_s.lower=0.4; --set moves them"
    ]
