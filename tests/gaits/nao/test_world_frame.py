"""Dynamics in the world frame: the recursion's torques and wrench for any motion."""

from collections.abc import Mapping, Sequence
from typing import Any

import casadi as ca
import numpy as np
import pytest
from casadi import DM, SX

from nlp_gait.gaits.nao.body import make_nao
from nlp_gait.gaits.nao.joints import ARM_JOINTS, LEG_JOINTS, measure_leg
from nlp_gait.gaits.nao.least_power.world_frame import (
    Frame,
    compute_leg_rates,
    make_chain_frames,
    make_leg_frames,
    make_upright_frame,
)
from nlp_gait.robots import Robot
from nlp_gait.robots.tree import TreeBody, make_tree
from nlp_gait.symbolic.dynamics import Wrench, newton_euler
from nlp_gait.symbolic.kinematics import leg_angles
from nlp_gait.symbolic.nonsmooth import Exact
from nlp_gait.symbolic.trajectories import Motion, add_motions, resting_point

SEED = 11
GRAVITY = 9.8
# Of torques of up to 50 Nm in double precision.
ROUNDING = 1e-12
SPREADS = (0.01, 0.1, 0.5)  # of positions [m], velocities [m/s] and accelerations [m/s^2]


def upright_frames(
    robot: Robot,
    hip: Motion,
    ankles: Mapping[str, Motion],
    arms: Mapping[str, Motion],
    largest_cosine: float = 1.0,
) -> dict[str, Frame]:
    """Return the frames of all links in the motion that ``NaoBody`` plans."""
    frames = {robot.root: make_upright_frame(hip)}
    for side, ankle in ankles.items():
        geometry, pelvis = measure_leg(robot, side), robot.joint(f"{side}HipYawPitch")
        at_hip, at_pelvis = (add_motions(hip, resting_point(place)) for place in (geometry.hip_m, pelvis.origin_m))
        leg = make_leg_frames(at_hip, ankle, geometry.thigh_m, geometry.tibia_m, largest_cosine)
        *turning, foot = (robot.joint(f"{side}{name}").child for name in LEG_JOINTS)
        frames |= {
            pelvis.child: make_upright_frame(at_pelvis),
            **dict(zip(turning, leg, strict=True)),
            foot: make_upright_frame(ankle),
        }
        frames |= make_chain_frames([robot.joint(f"{side}{name}") for name in ARM_JOINTS], arms, hip)
    return frames


def world_frame_dynamics(
    tree: Sequence[TreeBody],
    frames: Mapping[str, Frame],
    qdd: Mapping[str, SX],
    gravity: float,
    shares: Mapping[str, SX] | None = None,
) -> tuple[dict[str, SX], Wrench]:
    """Compute the joint torques of a tree whose first body stands still, equal to those of ``dynamics.newton_euler``."""
    shares = shares or {}
    below = _find_carried(tree)
    centres, forces, spins = [], [], []
    for body in tree:
        frame, share = frames[body.link.name], shares.get(body.link.name, 1.0)
        com, mass = DM(body.link.com_m), body.link.mass_kg
        centres.append(frame.origin.position + frame.axes.position @ com)
        acceleration = frame.origin.acceleration + frame.axes.acceleration @ com + SX(DM([0, 0, gravity]))
        forces.append(share * mass * acceleration)
        spins.append(share * _spin_rate(frame.axes, body.link.inertia_matrix))
    references = [_reference(body, frames) for body in tree]
    torques: dict[str, SX] = {}
    for i, body in enumerate(tree):
        if body.joint is None:
            continue
        axis = frames[body.link.name].axes.position @ DM(body.joint.axis)
        torque = SX(0)
        for k in below[i]:
            torque += ca.dot(axis, ca.cross(centres[k] - references[i], forces[k]) + spins[k])
        torques[body.joint.name] = body.direction * torque
        if body.armature_kgm2:
            torques[body.joint.name] += body.armature_kgm2 * qdd[body.joint.name]
    moments = (ca.cross(c - references[0], f) + s for c, f, s in zip(centres, forces, spins, strict=True))
    return torques, Wrench(sum(forces, SX(3, 1)), sum(moments, SX(3, 1)))


def _find_carried(tree: Sequence[TreeBody]) -> list[list[int]]:
    """Return the bodies that each body carries, itself included."""
    found: list[list[int]] = [[] for _ in tree]
    for k in range(len(tree)):
        at = k
        while at >= 0:
            found[at].append(k)
            at = tree[at].parent
    return found


def _reference(body: TreeBody, frames: Mapping[str, Frame]) -> SX:
    """Return (3,) the joint through which the tree reaches a body [m]."""
    frame = frames[body.link.name]
    offset = np.array(body.link.com_m) - np.array(body.com_offset_m)
    return frame.origin.position + frame.axes.position @ DM(offset)


def _spin_rate(axes: Motion, inertia: Any) -> SX:
    """Return (3,) the rate of a link's angular momentum about its centre of mass: sum of r x r'' over its matter [Nm]."""
    second = np.trace(inertia) / 2 * np.eye(3) - inertia
    bent = axes.acceleration @ DM(second)
    return sum((ca.cross(axes.position[:, j], bent[:, j]) for j in range(3)), SX(3, 1))


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
