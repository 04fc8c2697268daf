"""Motion of NAO on its left foot with free joints between the paper's ends.

Each joint's angle is a cubic between the ends plus a spline that leaves the ends alone. At both ends the robot is where the paper
puts it: torso upright at the paper's hip positions with the hip's velocities as variables, both soles flat and at rest, arms at
rest. In between every joint of the legs is free, the coupled yaw-pitch of the hips with them, and so are those of the arms that
the paper swings: the torso leans and turns, the swing foot tilts and leaves its line.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import casadi as ca
import numpy as np
from casadi import DM, MX, SX

from nlp_gait.formulation import Array, Constraint, InstantPoint, Point, Signals
from nlp_gait.formulation.blocks import labels
from nlp_gait.gaits.biped.curves import Splines, Trajectory
from nlp_gait.gaits.biped.instant import Loader, PlannedInstant, Planner
from nlp_gait.gaits.biped.parts import (
    REACH_MARGIN,
    Contribution,
    Part,
    halfway_rows,
    limit_rows,
    rows,
)
from nlp_gait.gaits.biped.phase import Phase
from nlp_gait.gaits.biped.recorded.stance import FreeParts, free_parts
from nlp_gait.gaits.biped.samples import Samples
from nlp_gait.gaits.nao.body import HELD_ARM_ANGLES, JOINTS, PLANNED_JOINTS
from nlp_gait.gaits.nao.single_support import ARM_SWING, LIFT
from nlp_gait.robots import Robot
from nlp_gait.robots.tree import Body, tree_from
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.symbolic.simplification import simplify, tabulate_last_input
from nlp_gait.symbolic.splines import fit_spline
from nlp_gait.symbolic.trajectories import Motion, add_motions, constant_motion, cubic

YAW_PITCH = "HipYawPitch"  # one motor turns both hips
YAW_PITCHES = tuple(f"{side}{YAW_PITCH}" for side in "LR")
CURVES = (YAW_PITCH, *PLANNED_JOINTS, *ARM_SWING)
MOVING = (*YAW_PITCHES, *CURVES[1:])
KNEES = ("LKneePitch", "RKneePitch")


OTHERS = (YAW_PITCHES[0], *ARM_SWING)


@dataclass(frozen=True, kw_only=True, eq=False)
class FreeMotion:
    """Joint angles as splines.

    Attributes:
        robot: with links welded that never move.
        splines: on every curve.
        paper: the paper's motion, whose ends are taken.
        loads: torques and ZMP.
        support: (3,) the left ankle, which stands [m].
        duration: of the phase [s].
    """

    robot: Robot
    splines: Splines
    paper: Planner
    loads: Loader
    support: tuple[float, float, float]
    duration: Callable[[InstantPoint], SX]

    def joints(self, at: InstantPoint, phase: SX, ops: Nonsmooth) -> dict[str, Motion]:
        """Motion of every joint [rad]."""
        duration = self.duration(at)
        start, end = (self.paper(at, SX(instant), ops).joints for instant in (0, 1))
        more = self.splines.motions(at, duration, phase)
        moved: dict[str, Motion] = {}
        for name in MOVING:
            a, b = start[name], end[name]
            hermite = cubic(a.position, b.position, a.velocity, b.velocity, duration, phase)
            moved[name] = add_motions(hermite, more[YAW_PITCH if name in YAW_PITCHES else name])
        return {**start, **moved}

    def plan(self, at: InstantPoint, phase: SX, ops: Nonsmooth) -> PlannedInstant:
        """Motion of the whole robot."""
        joints = self.joints(at, phase, ops)
        body = self.body({name: motion.position for name, motion in joints.items()})
        return PlannedInstant(
            joints=joints,
            hip=body.torso,
            ankles={"L": SX(DM(self.support)), "R": body.ankle},
            reach=ca.vertcat(*(ca.cos(joints[knee].position) for knee in KNEES)),
        )

    def body(self, q: Mapping[str, SX]) -> FreeParts:
        """Where torso and right foot are, from angles by joint name."""
        return free_parts(self.robot, self._tree, q, self.support)

    @cached_property
    def instant(self) -> ca.Function:
        """One sample: from angles, velocities and accelerations (45,) to torques, ZMP, and where ankle and sole are."""
        rows = len(CURVES)
        v = SX.sym("v", 3 * rows)
        joints = {name: constant_motion(angle) for name, angle in HELD_ARM_ANGLES.items()}
        for row, curve in enumerate(CURVES):
            motion = Motion(*(v[order * rows + row] for order in range(3)))
            joints |= dict.fromkeys(YAW_PITCHES if curve == YAW_PITCH else (curve,), motion)
        body = self.body({name: motion.position for name, motion in joints.items()})
        loads = self.loads(joints, body.torso, {"L": SX(DM(self.support[:2]))}, SX(0, 1))
        torque = ca.vertcat(*(loads.torques[name] for name in JOINTS))
        left = body.corners[1, 1::2]
        return ca.Function("instant", [v], simplify([torque, loads.zmp, body.ankle[0], body.corners[2, :].T, left.T]))

    @cached_property
    def _tree(self) -> tuple[Body, ...]:
        return tree_from(self.robot, self.robot.feet["left"].link)


@dataclass(frozen=True, kw_only=True, eq=False)
class FreePhase(Phase):
    """A phase on the left foot whose joints are free.

    Attributes:
        free: the motion.
    """

    free: FreeMotion

    def samples_at(self, at: Point, ops: Nonsmooth, phases: MX | None) -> Samples:
        """The phase at its samples, or at other phases (1, k); traces are ``others``, ``along``, ``heights`` and ``sides``.

        The joints' motion is tied, for torques are far from linear in it and it is linear in most of the many variables; and so
        is what follows from it at each sample alone, before limits join samples. Traces: ``others`` (5, N + 1), angles of the
        hips' yaw-pitch and of the arms, rows as ``OTHERS`` [rad]; ``along`` (1, N + 1), x of the right ankle [m]; ``heights``
        (4, N + 1) of the right sole's corners above the ground [m]; ``sides`` (2, N + 1), y of its left corners [m].
        """
        n = self.grid.parts + 1 if phases is None else int(phases.shape[1])
        x, margin, s = SX.sym("x", len(self.variables)), SX.sym("margin"), SX.sym("s")
        joints = self.free.joints(InstantPoint.of(x, margin, self.names, [REACH_MARGIN]), s, ops)
        moved = ca.vertcat(*(joints[name][order] for order in range(3) for name in MOVING[1:]))
        motion = ca.Function("motion", [x, margin, s], [ca.cse(moved)])
        motion, table = (
            tabulate_last_input(motion, DM(np.linspace(0.0, 1.0, n)).T) if phases is None else (motion, phases)
        )
        values = motion.map(n)(ca.repmat(at.x, 1, n), ca.repmat(at[REACH_MARGIN], 1, n), table)
        motions = tied(values, ops)
        torque, zmp, along, heights, sides = (tied(part, ops) for part in self.free.instant.map(n)(motions))
        q, qd, qdd = (by_joint(part) for part in ca.vertsplit(motions, len(CURVES)))
        return Samples(
            joints=JOINTS,
            moving=MOVING,
            per_interval=self.grid.samples_per_interval if phases is None else 1,
            duration=at[self.duration],
            planned=ca.vertcat(*(q[name] for name in PLANNED_JOINTS)),
            reach=ca.cos(ca.vertcat(*(q[knee] for knee in KNEES))),
            torque=torque,
            power=ca.vertcat(*(qd[name] * torque[JOINTS.index(name), :] for name in MOVING)),
            zmp=zmp,
            motion=tuple(ca.vertcat(*part.values()) for part in (q, qd, qdd)),
            traces={
                "others": ca.vertcat(*(q[name] for name in OTHERS)),
                "along": along,
                "heights": heights,
                "sides": sides,
            },
        )


def by_joint(rows: MX) -> dict[str, MX]:
    """Rows of a matrix (15, N + 1) by joint name."""
    found = dict(zip(CURVES, ca.vertsplit(rows), strict=True))
    return {name: found[YAW_PITCH if name in YAW_PITCHES else name] for name in MOVING}


class FreeLimits(Part):
    """Limits that planned motions keep by construction: joints, the swing foot's height, and its side of the other foot.

    Args:
        robot: whose limits they are.
        path_middle: x of the swing foot halfway [m].
        inner_edge: y of the supporting sole's inner edge [m].
    """

    def __init__(self, robot: Robot, path_middle: float, inner_edge: float) -> None:
        self._robot, self._path_middle, self._inner_edge = robot, path_middle, inner_edge

    def contribute(self, at: Point, samples: Samples, ops: Nonsmooth) -> Contribution:
        """Rows between the ends; the number of samples is odd, for one of them is the middle."""
        traces, middle = samples.traces, samples.steps // 2
        heights, corners = traces["heights"], ("back right", "back left", "front right", "front left")
        halfway = halfway_rows(traces["along"][middle], self._path_middle, heights[:, middle], at[LIFT], corners)
        return Contribution(
            rows=(
                limit_rows("other_angle", self._robot, OTHERS, traces["others"][:, 1:-1]),
                _corner_rows("foot_height", heights[:, 1:-1], corners),
                *halfway,
                _corner_rows("feet_apart", self._inner_edge - traces["sides"][:, 1:-1], corners[1::2]),
            )
        )


def _corner_rows(name: str, values: MX, corners: Sequence[str]) -> Constraint:
    """Values (c, N - 1) of a sole's corners between the ends that must not be negative [m]."""
    names = labels(corners, range(1, values.shape[1] + 1))
    return rows(name, "m", ca.vec(values), MX(0.0), None, names, "instant")


def free_splines(trajectory: Trajectory) -> Splines:
    """Splines on every joint."""
    return Splines(trajectory=trajectory, units=dict.fromkeys(CURVES, "rad"))


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
    columns = dict(zip(signals.joints, fit_spline(q - straight.T, spans, phases).T, strict=True))
    columns[YAW_PITCH] = np.mean([columns[name] for name in YAW_PITCHES], axis=0)
    return np.concatenate([columns[curve] for curve in CURVES])
