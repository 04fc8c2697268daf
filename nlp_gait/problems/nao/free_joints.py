"""Motion of NAO on its left foot with free joints between the paper's ends.

Each joint's angle is a cubic between the ends plus a spline that leaves the ends alone. At both ends the robot is where the paper
puts it: torso upright at the paper's hip positions with the hip's velocities as variables, both soles flat and at rest, arms at
rest. In between every joint of the legs is free, the coupled yaw-pitch of the hips with them, and so are those of the arms that
the paper swings: the torso leans and turns, the swing foot tilts and leaves its line.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import DM, MX, SX

from nlp_gait.problem.gait_problem import Array, Point, Signals
from nlp_gait.problems.nao.body import HELD_ARM_ANGLES, JOINTS, PLANNED_JOINTS
from nlp_gait.problems.nao.curves import Splines, Trajectory
from nlp_gait.problems.nao.phase import Loader, Phase, Plan, Planner, Samples
from nlp_gait.problems.nao.single_support import ARM_SWING
from nlp_gait.robots import Robot
from nlp_gait.robots.tree import Body as TreeBody
from nlp_gait.robots.tree import tree_from
from nlp_gait.symbolic.economy import economical, tabulated
from nlp_gait.symbolic.kinematics import Pose, forward_kinematics
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.symbolic.splines import fitted
from nlp_gait.symbolic.trajectories import Motion, constant, cubic, plus

YAW_PITCH = "HipYawPitch"  # one motor turns both hips
YAW_PITCHES = tuple(f"{side}{YAW_PITCH}" for side in "LR")
CURVES = (YAW_PITCH, *PLANNED_JOINTS, *ARM_SWING)
MOVING = (*YAW_PITCHES, *CURVES[1:])
KNEES = ("LKneePitch", "RKneePitch")


class Body(NamedTuple):
    """Where the free parts are.

    Attributes:
        torso: (3,) origin of the torso [m].
        ankle: (3,) of the right foot [m].
        corners: (3, 4) of the right sole [m].
    """

    torso: SX
    ankle: SX
    corners: SX


class FreeSamples(NamedTuple):
    """A phase at N + 1 samples; columns are samples.

    Attributes:
        samples: what every phase has.
        others: (5, N + 1) angles of the hips' yaw-pitch and of the arms, rows as ``OTHERS`` [rad].
        along: (1, N + 1) x of the right ankle [m].
        heights: (4, N + 1) of the right sole's corners above the ground [m].
        sides: (2, N + 1) y of its left corners [m].
    """

    samples: Samples
    others: MX
    along: MX
    heights: MX
    sides: MX


OTHERS = (YAW_PITCHES[0], *ARM_SWING)


@dataclass(frozen=True, kw_only=True, eq=False)
class FreeMotion:
    """Joint angles as splines.

    Attributes:
        robot: with links welded that never move.
        splines: on every curve.
        paper: the paper's motion from its own variables, which come first in x; its ends are taken.
        loads: torques and ZMP.
        support: (3,) the left ankle, which stands [m].
        duration: of the phase [s] from x (n,).
    """

    robot: Robot
    splines: Splines
    paper: Planner
    loads: Loader
    support: tuple[float, float, float]
    duration: Callable[[SX], SX]

    def joints(self, x: SX, margin: SX, phase: SX, ops: Nonsmooth) -> dict[str, Motion]:
        """Motion of every joint [rad]."""
        duration = self.duration(x)
        start, end = (self.paper(x[: self.splines.first], margin, SX(at), ops).joints for at in (0, 1))
        more = self.splines.motions(x, duration, phase)
        moved: dict[str, Motion] = {}
        for name in MOVING:
            a, b = start[name], end[name]
            hermite = cubic(a.position, b.position, a.velocity, b.velocity, duration, phase)
            moved[name] = plus(hermite, more[YAW_PITCH if name in YAW_PITCHES else name])
        return {**start, **moved}

    def plan(self, x: SX, margin: SX, phase: SX, ops: Nonsmooth) -> Plan:
        """Motion of the whole robot."""
        joints = self.joints(x, margin, phase, ops)
        body = self.body({name: motion.position for name, motion in joints.items()})
        return Plan(
            joints=joints,
            hip=body.torso,
            ankles={"L": SX(DM(self.support)), "R": body.ankle},
            reach=ca.vertcat(*(ca.cos(joints[knee].position) for knee in KNEES)),
        )

    def _by_joint(self, rows: MX) -> dict[str, MX]:
        """Rows of a matrix (15, N + 1) by joint name."""
        found = dict(zip(CURVES, ca.vertsplit(rows), strict=True))
        return {name: found[YAW_PITCH if name in YAW_PITCHES else name] for name in MOVING}

    def body(self, q: Mapping[str, SX]) -> Body:
        """Where torso and right foot are, from angles by joint name."""
        poses = self._poses(q)
        torso = poses[self.robot.root]
        entry = next(body.joint for body in self._tree if body.link.name == self.robot.root)
        assert entry is not None  # the torso is not the fixed link; for the type checker
        foot = self.robot.feet["right"]
        ankle = poses[foot.link]
        corners = [
            (along, across, -foot.ankle_height_m)
            for along in (-foot.back_m, foot.front_m)
            for across in (-foot.right_m, foot.left_m)
        ]
        return Body(
            torso.position - torso.rotation @ DM(entry.origin_m),
            ankle.position,
            ca.repmat(ankle.position, 1, 4) + ankle.rotation @ DM(np.array(corners).T),
        )

    def samples(self, phase: Phase, point: Point, ops: Nonsmooth) -> FreeSamples:
        """The phase at N + 1 equidistant samples.

        The joints' motion is tied, for torques are far from linear in it and it is linear in most of the many variables; and so
        is what follows from it at each sample alone, before limits join samples.
        """
        n = phase.steps + 1
        x, margin, s = SX.sym("x", phase.variables), SX.sym("margin"), SX.sym("s")
        joints = self.joints(x, margin, s, ops)
        moved = ca.vertcat(*(joints[name][order] for order in range(3) for name in MOVING[1:]))
        motion = ca.Function("motion", [x, margin, s], [ca.cse(moved)])
        motion, table = tabulated(motion, DM(np.linspace(0.0, 1.0, n)).T)
        values = motion.map(n)(ca.repmat(point.x, 1, n), ca.repmat(point["reach_margin"], 1, n), table)
        motions = tied(values, ops)
        torque, zmp, along, heights, sides = (tied(part, ops) for part in self._instant.map(n)(motions))
        q, qd = (self._by_joint(part) for part in ca.vertsplit(motions, len(CURVES))[:2])
        samples = Samples(
            planned=ca.vertcat(*(q[name] for name in PLANNED_JOINTS)),
            reach=ca.cos(ca.vertcat(*(q[knee] for knee in KNEES))),
            torque=torque,
            power=ca.vertcat(*(qd[name] * torque[JOINTS.index(name), :] for name in MOVING)),
            zmp=zmp,
        )
        return FreeSamples(samples, ca.vertcat(*(q[name] for name in OTHERS)), along, heights, sides)

    @cached_property
    def _instant(self) -> ca.Function:
        """One sample: from angles, velocities and accelerations (45,) to torques, ZMP, and where ankle and sole are."""
        rows = len(CURVES)
        v = SX.sym("v", 3 * rows)
        joints = {name: constant(angle) for name, angle in HELD_ARM_ANGLES.items()}
        for row, curve in enumerate(CURVES):
            motion = Motion(*(v[order * rows + row] for order in range(3)))
            joints |= dict.fromkeys(YAW_PITCHES if curve == YAW_PITCH else (curve,), motion)
        body = self.body({name: motion.position for name, motion in joints.items()})
        loads = self.loads(joints, body.torso, {"L": SX(DM(self.support[:2]))})
        torque = ca.vertcat(*(loads.torques[name] for name in JOINTS))
        left = body.corners[1, 1::2]
        return ca.Function("instant", [v], economical([torque, loads.zmp, body.ankle[0], body.corners[2, :].T, left.T]))

    @cached_property
    def _tree(self) -> tuple[TreeBody, ...]:
        return tree_from(self.robot, self.robot.feet["left"].link)

    def _poses(self, q: Mapping[str, SX]) -> dict[str, Pose]:
        poses = forward_kinematics(self._tree, q, SX(DM(self.support)))
        return {body.link.name: pose for body, pose in zip(self._tree, poses, strict=True)}


def free_splines(trajectory: Trajectory, first: int) -> Splines:
    """Splines on every joint."""
    return Splines(trajectory=trajectory, units=dict.fromkeys(CURVES, "rad"), first=first)


def tied(values: MX, ops: Nonsmooth) -> MX:
    """A matrix of which each entry is a variable of its own to a solver (see ``Nonsmooth.tie``)."""
    return ca.reshape(ops.tie(ca.vec(values)), *values.shape)


def joint_coefficients(signals: Signals, spans: int) -> Array:
    """Coefficients, curve by curve, of the free motion that is nearest to another one with the same ends.

    Args:
        signals: of the other motion, the more samples the better.
        spans: of the splines; 0 for none.
    """
    if spans == 0:
        return np.zeros(0)
    t, q, qd = (signals.arrays[name] for name in ("t", "q", "qd"))
    phases, s = t / t[-1], SX.sym("s")
    start, end, v0, v1 = (SX(DM(row)) for row in (q[0], q[-1], qd[0], qd[-1]))
    hermite = ca.Function("hermite", [s], [cubic(start, end, v0, v1, SX(float(t[-1])), s).position])
    straight = np.array(hermite.map(len(phases))(DM(phases).T).full())
    columns = dict(zip(signals.joints, fitted(q - straight.T, spans, phases).T, strict=True))
    columns[YAW_PITCH] = np.mean([columns[name] for name in YAW_PITCHES], axis=0)
    return np.concatenate([columns[curve] for curve in CURVES])
