"""The planned step: continuity where its phases meet, and where the feet stand."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from casadi import SX

from nlp_gait.gaits.stairs.planar_biped import GRAVITY, link_angles, locate_points
from nlp_gait.gaits.stairs.planned_motion import (
    Stair,
    StairPlan,
    compute_landed_angles,
    compute_posture,
    compute_stair_height,
    locate_ankle,
    locate_ankle_on_toe,
    locate_hip,
    move_in_time,
)
from nlp_gait.gaits.stairs.stair import CASES
from nlp_gait.symbolic.nonsmooth import Exact

PLAN = dict(
    hip_height=0.69,
    hip_start=0.09,
    zmp_start=0.24,
    zmp_end=0.09,
    end_rate=0.7,
    torso_pitch=1.4,
    t1=0.5,
    t2=1.4,
    t_bc=2.2,
    foot_pitch=0.4,
    t3=3.5,
    sole_angle=np.pi / 6,
    toe_angle=np.pi / 6,
    catch_angle=0.01,
)
KNOTS = [[1, 0, 0, 0], [1, 1, 0, 0], [1, 1, 1, 0]]


def plan() -> StairPlan:
    return StairPlan(**{name: SX(value) for name, value in PLAN.items()})


def step(case: int) -> Stair[SX]:
    length, ratio = CASES[case]
    return Stair(SX(length / 2), SX(ratio * length / 2))


@pytest.fixture(params=CASES)
def ankle_motion(request: pytest.FixtureRequest) -> ca.Function:
    s, passing = SX.sym("s", 4), SX.sym("passing", 4)
    motion = move_in_time(locate_ankle(plan(), step(request.param), s), s, passing / plan().durations)
    return ca.Function("ankle", [s, passing], list(motion))


def test_ankle_velocity_is_continuous_at_every_knot(ankle_motion: ca.Function) -> None:
    for i, s in enumerate(KNOTS):
        before, after = (ankle_motion(s, np.eye(4)[j])[1] for j in (i, i + 1))
        assert np.abs(np.array(before - after)).max() < 1e-12


@pytest.mark.parametrize("case", CASES)
def test_the_foot_lands_so_that_it_will_stand_two_steps_on(case: int) -> None:
    s = SX.sym("s", 4)
    landing = ca.Function("landing", [s], [locate_ankle(plan(), step(case), s)])([1, 1, 1, 1])
    after = ca.Function("landed", [s], [locate_ankle_on_toe(*compute_landed_angles(plan(), s))])
    length, ratio = CASES[case]
    end = np.array([length, ratio * length])
    assert np.array(landing).ravel() == pytest.approx(end + np.array(after([0, 0, 0, 0])).ravel(), abs=1e-12)
    assert np.array(after([1, 1, 0, 0])).ravel() == pytest.approx([0.0, 0.0], abs=1e-12)


@pytest.mark.parametrize("case", CASES)
def test_hip_advances_one_step_and_rises_with_it(case: int) -> None:
    s = SX.sym("s", 4)
    at = ca.Function("hip", [s], [locate_hip(plan(), step(case), s)])
    first, last = (np.array(at(end)).ravel() for end in ([0, 0, 0, 0], [1, 1, 1, 1]))
    assert first == pytest.approx([PLAN["hip_start"], PLAN["hip_height"]], abs=1e-12)
    assert last - first == pytest.approx([float(size) for size in step(case)], abs=1e-12)


@pytest.mark.parametrize("speed", [1.0, 10.0])
@pytest.mark.parametrize("phase", range(4))
def test_the_hip_is_a_pendulum_over_the_planned_zmp(phase: int, speed: float) -> None:
    """Its acceleration is w^2 (x - zmp), also in a step so fast that neither of its exponentials has faded."""
    times = {name: PLAN[name] / speed for name in ("t1", "t2", "t_bc", "t3")}
    fast, stair = StairPlan(**{name: SX(value) for name, value in {**PLAN, **times}.items()}), step(2)
    s, passing = SX.sym("s", 4), SX.sym("passing", 4)
    motion = move_in_time(locate_hip(fast, stair, s), s, passing / fast.durations)
    at = ca.Function("hip", [s, passing], [motion.position[0], motion.acceleration[0], ca.dot(fast.durations, s)])
    x, acceleration, t = (float(part) for part in at([1.0] * phase + [0.3] + [0.0] * (3 - phase), np.eye(4)[phase]))
    way, passed = float(stair.tread) + PLAN["zmp_end"] - PLAN["zmp_start"], t / times["t3"]
    zmp = PLAN["zmp_start"] + way * passed**2 * (3 - 2 * passed)
    assert acceleration == pytest.approx(GRAVITY / PLAN["hip_height"] * (x - zmp), rel=1e-9, abs=1e-9)
    ends = [float(at([end] * 4, [0] * 4)[0]) for end in (0, 1)]
    assert ends == pytest.approx([PLAN["hip_start"], PLAN["hip_start"] + float(stair.tread)], abs=1e-12)


def test_forward_kinematics_of_the_posture_meets_hip_and_ankle() -> None:
    s, passing = SX.sym("s", 4), SX.sym("passing", 4)
    found = compute_posture(plan(), step(2), s, passing / plan().durations, SX(0.005), Exact())
    placed = locate_points(link_angles(found.q.position), SX(2, 1))
    errors = ca.vertcat(placed["H"] - found.hip.position, placed["A"] - found.ankle.position)
    rate_error = ca.jtimes(found.q.position, s, passing / plan().durations) - found.q.velocity
    check = ca.Function("check", [s, passing], [errors, rate_error, found.reach])
    for share in (0.2, 0.5, 0.8):
        for phase in range(4):
            fractions = [1.0] * phase + [share] + [0.0] * (3 - phase)
            error, rate, reach = (np.array(part) for part in check(fractions, np.eye(4)[phase]))
            assert reach.max() < 1.0
            assert np.abs(error).max() < 1e-12
            assert np.abs(rate).max() < 1e-9


def test_stair_profile_has_two_edges() -> None:
    x, stair = SX.sym("x"), Stair(SX(0.25), SX(0.17))
    height = ca.Function("height", [x], [compute_stair_height(x, stair, 0.06, 0.003)])
    assert [float(height(at)) for at in (-0.2, 0.0, 0.1, 0.25)] == pytest.approx([-0.17, 0.0, 0.0, 0.17], abs=1e-6)
    assert float(height(-0.06)) == pytest.approx(-0.085)
