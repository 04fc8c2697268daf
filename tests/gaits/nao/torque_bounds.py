"""Affine bounds of NAO's torques and ZMP over boxes of gaits: dynamics in world coordinates against the recursion.

Boxes around the best known gait, in variables in which the geometry does not depend on the time: hip height, half sums and half
differences of w = v T at both ends, swing height, T.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from casadi import DM, SX

import nlp_gait
from nlp_gait.formulation import InstantPoint
from nlp_gait.gaitbench.facts import load_facts
from nlp_gait.gaits.biped.curves import HIP_CURVES, move_hip
from nlp_gait.gaits.biped.support_phases import place_stance, swing_foot
from nlp_gait.gaits.nao.body import ARM_SWING, GRAVITY, find_upright_links, make_nao, move_arms
from nlp_gait.gaits.nao.joints import ARM_JOINTS, JOINTS, LEG_JOINTS, measure_leg
from nlp_gait.gaits.nao.least_power.world_frame import Frame, make_chain_frames, make_leg_frames, make_upright_frame
from nlp_gait.proofs.affine import AffineFunction
from nlp_gait.robots import Robot
from nlp_gait.robots.tree import TreeBody, make_tree
from nlp_gait.symbolic.balance import zmp_of_wrench
from nlp_gait.symbolic.dynamics import Wrench, newton_euler
from nlp_gait.symbolic.nonsmooth import Exact
from nlp_gait.symbolic.trajectories import Motion, add_motions, constant_motion, cubic_of_sums, resting_point, stack

STEP_M, PHASE, REACH_MARGIN = 0.06, 0.3, 0.01


class Errors(NamedTuple):
    """Largest errors of affine forms of a torque [Nm] and of the ZMP [m], and the number of operations of one sample."""

    torque_Nm: float
    zmp_m: float
    operations: int


def upright_frames(
    robot: Robot,
    hip: Motion,
    ankles: Mapping[str, Motion],
    arms: Mapping[str, Motion],
    largest_cosine: float = 1.0,
) -> dict[str, Frame]:
    """Return the frames of all links in the motion that ``NaoBody`` plans; see ``make_leg_frames``."""
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
    """Compute the joint torques of a tree whose first body stands still, equal to those of ``dynamics.newton_euler``.

    Args:
        tree: bodies, parents first.
        frames: of all links by name.
        qdd: joint accelerations by name, where rotors have inertia [rad/s^2].
        gravity: magnitude, acting along -z [m/s^2].
        shares: factors on mass and inertia of links by name.

    Returns:
        Torques by joint name [Nm], and the wrench of the ground on the first body about its reference point.

    Source:
        Gupta, Pratihar, Deb (2023), eqs. (15)-(18): a joint's moment is the sum over the links that it carries.
    """
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


def enclose_sample(edge: float) -> tuple[Errors, Errors]:
    """Return the errors of the recursion and of the world frame, over a box with this part of every range."""
    problem, x = nlp_gait.load("nao-ssp"), np.array(load_facts()["ssp-v5"].best_x)
    time, ranges = x[-1], problem.upper - problem.lower
    halves = np.array([[0.5, 0.5], [0.5, -0.5]])
    middle = np.concatenate([x[:1], *(time * halves @ x[k : k + 2] for k in (1, 3, 5)), x[7:]])
    width = np.concatenate([ranges[:1], problem.upper[-1] * ranges[1:7], ranges[7:]]) * edge / 2
    box = np.stack([middle - width, middle + width], -1)[None]
    found = []
    for in_world in (False, True):
        function = _sample(in_world, problem.names)
        forms = AffineFunction(function)(box, np.arange(len(x)))
        error, n = forms.error[0], len(JOINTS)
        found.append(Errors(float(error[:n].max()), float(error[n:].max()), function.n_instructions()))
    return found[0], found[1]


def _sample(in_world: bool, names: tuple[str, ...]) -> ca.Function:
    body = make_nao("nao-v5")
    robot = body.robot
    stance, foot, tree = place_stance(body, STEP_M), robot.feet["left"], make_tree(robot, robot.feet["left"].link)
    z = SX.sym("z", len(names))
    time, phase = z[-1], SX(PHASE)
    sums = [part / time for k in (1, 3, 5) for part in (z[k] + z[k + 1], z[k] - z[k + 1])]
    at = InstantPoint.of(ca.vertcat(z[0], *sums, z[-2], time), SX(0, 1), names, ())
    if in_world:  # without the quotients, which cancel
        ends = ((z[0], z[0]), stance.hip_x, stance.hip_y)
        parts = [
            _timed(cubic_of_sums(*end, z[k], z[k + 1], phase), time) for end, k in zip(ends, (1, 3, 5), strict=True)
        ]
        hip = stack(parts[1], parts[2], parts[0])
    else:
        still = dict.fromkeys(HIP_CURVES, constant_motion(0.0))
        hip = move_hip(at, still, stance.hip_x, stance.hip_y, time, phase)
    path = (SX(end) for end in stance.swing_x)
    swing = swing_foot(*path, stance.swing_y, robot.feet["right"].ankle_height_m, z[-2], time, phase)
    ankles = {"L": resting_point((*stance.support_xy, foot.ankle_height_m)), "R": swing}
    arms = move_arms(ARM_SWING["ssp"], time, phase)
    if in_world:
        frames = upright_frames(robot, hip, ankles, arms, 1 - REACH_MARGIN)
        torques, wrench = world_frame_dynamics(tree, frames, {}, GRAVITY)
    else:
        joints = body.plan(hip, arms, ankles, SX(REACH_MARGIN), Exact()).joints
        q, qd, qdd = ({name: joint[order] for name, joint in joints.items()} for order in range(3))
        torques, wrench = newton_euler(tree, q, qd, qdd, GRAVITY, upright=find_upright_links(robot))
    zmp = zmp_of_wrench(wrench, foot.ankle_height_m, robot.mass_kg * GRAVITY)
    return ca.Function("sample", [z], [ca.cse(ca.vertcat(*(torques[name] for name in JOINTS), zmp))])


def _timed(motion: Motion, time: SX) -> Motion:
    """Return a motion of unit time in another time."""
    return Motion(motion.position, motion.velocity / time, motion.acceleration / time**2)
