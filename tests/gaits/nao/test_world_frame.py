"""Dynamics in the world frame: the recursion's torques and wrench for any motion, and far narrower bounds over a box."""

from __future__ import annotations

import casadi as ca
import numpy as np
import pytest
from casadi import SX

from nlp_gait.gaits.nao.body import make_nao
from nlp_gait.gaits.nao.joints import ARM_JOINTS
from nlp_gait.gaits.nao.least_power.world_frame import compute_leg_rates
from nlp_gait.robots.tree import make_tree
from nlp_gait.symbolic.dynamics import newton_euler
from nlp_gait.symbolic.kinematics import leg_angles
from nlp_gait.symbolic.nonsmooth import Exact
from nlp_gait.symbolic.trajectories import Motion
from tests.gaits.nao.torque_bounds import enclose_sample, upright_frames, world_frame_dynamics

SEED = 11
GRAVITY = 9.8
# Of torques of up to 50 Nm in double precision.
ROUNDING = 1e-12
SPREADS = (0.01, 0.1, 0.5)  # of positions [m], velocities [m/s] and accelerations [m/s^2]


def moving(name: str, size: int) -> Motion:
    return Motion(*(SX.sym(f"{name}{order}", size) for order in range(3)))


@pytest.mark.parametrize("robot", ["nao-v4", "nao-v6"])
@pytest.mark.parametrize("share", [1.0, 0.3])
def test_torques_and_wrench_are_the_recursions(robot: str, share: float) -> None:
    body = make_nao(robot)
    model = body.robot
    hip, swing = moving("hip", 3), moving("swing", 3)
    stance = Motion(SX.sym("stance", 3), SX(3, 1), SX(3, 1))
    arms = {f"{side}{name}": moving(f"{side}{name}", 1) for side in "LR" for name in ARM_JOINTS}
    ankles = {"L": stance, "R": swing}
    tree, shares = make_tree(model, model.feet["left"].link), {model.root: SX(share)}
    plan = body.plan(hip, arms, ankles, SX(0.01), Exact())
    q, qd, qdd = ({name: joint[order] for name, joint in plan.joints.items()} for order in range(3))
    expected = newton_euler(tree, q, qd, qdd, GRAVITY, shares)
    found = world_frame_dynamics(tree, upright_frames(model, hip, ankles, arms), qdd, GRAVITY, shares)
    both = [ca.vertcat(*(torques[n] for n in expected[0]), *wrench) for torques, wrench in (expected, found)]
    symbols = [*hip, stance.position, *swing, *(part for arm in arms.values() for part in arm)]
    function, rng = ca.Function("both", symbols, both), np.random.default_rng(SEED)
    for _ in range(20):
        centres = ((0.01, 0.01, 0.27), (-0.01, -0.05, 0.05))
        paths = [
            [(centre if order == 0 else 0.0) + rng.normal(0.0, spread, 3) for order, spread in enumerate(SPREADS)]
            for centre in (np.array(c) for c in centres)
        ]
        swung = [rng.normal(0.0, 1.0, 1) for _ in range(3 * len(arms))]
        a, b = function(*paths[0], np.array([0.03, 0.05, 0.045]), *paths[1], *swung)
        np.testing.assert_allclose(np.array(a.full()), np.array(b.full()), atol=50 * ROUNDING)


def test_rates_of_a_leg_are_those_of_its_angles() -> None:
    thigh, tibia = 0.1, 0.1029
    apart = moving("apart", 3)
    angles = leg_angles(apart, thigh, tibia, SX(0.01), Exact())
    rates, distance_squared = compute_leg_rates(apart, thigh, tibia, 0.99)
    both = ca.Function("both", [*apart], [angles.joints.velocity, ca.vertcat(*rates), distance_squared])
    rng = np.random.default_rng(SEED)
    for _ in range(20):
        place = np.array([0.02, 0.01, -0.17]) + rng.normal(0.0, 0.01, 3)
        expected, found, squared = both(place, rng.normal(0.0, 0.1, 3), np.zeros(3))
        np.testing.assert_allclose(found.full(), expected.full(), atol=10 * ROUNDING)
        assert float(squared) == pytest.approx(place @ place)


def test_over_a_box_bounds_of_torques_are_a_tenth_as_wide() -> None:
    recursion, world = enclose_sample(2.0**-5)
    assert world.torque_Nm < 0.1 * recursion.torque_Nm
    assert world.zmp_m < 0.01 * recursion.zmp_m
