"""What the NAO problems share: the robot's motion from hip, ankles and arms, sampled over a support phase."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, NamedTuple

import casadi as ca
import numpy as np
from casadi import DM, MX, SX

from nlp_gait.errors import InputError, UnknownNameError
from nlp_gait.problems.gait_problem import Array, Point, Signals
from nlp_gait.robots import Robot, load_robot
from nlp_gait.robots.tree import point_masses, tree_from, weld
from nlp_gait.symbolic.inverse_kinematics import leg_angles
from nlp_gait.symbolic.kinematics import centre_of_mass, forward_kinematics
from nlp_gait.symbolic.nonsmooth import Exact, Nonsmooth
from nlp_gait.symbolic.trajectories import Motion, constant, cubic

GRAVITY = 9.8  # [m/s^2], as in the paper, eq. (27)
LEAST_DURATION = 1e-3  # [s]; a shorter phase is evaluated as this one, so that rates stay finite

Derivatives = Literal["analytic", "finite-difference"]

LEG_JOINTS = ("HipRoll", "HipPitch", "KneePitch", "AnklePitch", "AnkleRoll")
ARM_JOINTS = ("ShoulderPitch", "ShoulderRoll", "ElbowYaw", "ElbowRoll", "WristYaw")
# Joints that enter the power (eq. 32): both legs with the hip yaw-pitch, and both arms.
JOINTS = tuple(
    f"{side}{joint}" for part in (("HipYawPitch", *LEG_JOINTS), ARM_JOINTS) for side in "LR" for joint in part
)
PLANNED_JOINTS = tuple(f"{side}{joint}" for side in "LR" for joint in LEG_JOINTS)
HEAD_JOINTS = ("HeadYaw", "HeadPitch")
HELD_ARM_ANGLES = {  # section 3.1 [rad]
    "LShoulderRoll": 0.26,
    "RShoulderRoll": -0.26,
    "LElbowYaw": -1.5,
    "RElbowYaw": 1.5,
    "LWristYaw": 0.0,
    "RWristYaw": 0.0,
}


class Plan(NamedTuple):
    """Motion of the whole robot at one instant.

    Attributes:
        joints: motion of every joint by name [rad].
        hip: (3,) position of the torso's origin [m].
        ankles: (3,) positions by side ``"L"``, ``"R"`` [m].
        reach: (2,) cosines of the left and the right knee.
    """

    joints: Mapping[str, Motion]
    hip: SX
    ankles: Mapping[str, SX]
    reach: SX


class Loads(NamedTuple):
    """What motors and ground must give at one instant.

    Attributes:
        torques: by joint name [Nm].
        zmp: (2,) in the world [m].
    """

    torques: Mapping[str, SX]
    zmp: SX


# From x (n,), the reach margin, the phase in [0, 1] and an interpretation of acos.
Planner = Callable[[SX, SX, SX, Nonsmooth], Plan]
# From joint motions by name and the hip's position (3,).
Loader = Callable[[Mapping[str, Motion], SX], Loads]


class Samples(NamedTuple):
    """A phase at N + 1 samples; columns are samples.

    Attributes:
        planned: (10, N + 1) leg angles, rows as PLANNED_JOINTS [rad].
        reach: (2, N + 1) cosines of the knees.
        torque: (22, N + 1), rows as JOINTS [Nm].
        power: (m, N + 1) mechanical power of the joints that move [W], signed.
        zmp: (2, N + 1) in the world [m].
    """

    planned: MX
    reach: MX
    torque: MX
    power: MX
    zmp: MX


def nao(robot: str, rotational_inertia: bool) -> Robot:
    """Robot of a NAO problem: head and neck one with the torso, links as point masses if asked for.

    Raises:
        InputError: the robot has not the joints that the gait moves.
    """
    loaded = load_robot(robot)
    try:
        for joint in (*JOINTS, *HEAD_JOINTS):
            loaded.joint(joint)
    except UnknownNameError as error:
        raise InputError(f"robot {loaded.name!r} does not suit the NAO problems: {error}") from error
    welded = weld(loaded, HEAD_JOINTS)
    return welded if rotational_inertia else point_masses(welded)


def leg_joints(robot: Robot, side: str, hip: Motion, ankle: Motion, margin: SX, ops: Nonsmooth) -> tuple[dict[str, Motion], SX]:
    """Joint motions of one leg under an upright torso, and the cosine of its knee."""
    hip_joint = DM(robot.joint(f"{side}HipYawPitch").origin_m)
    thigh = -robot.joint(f"{side}KneePitch").origin_m[2]
    tibia = -robot.joint(f"{side}AnklePitch").origin_m[2]
    hip_to_ankle = Motion(
        ankle.position - hip.position - hip_joint, ankle.velocity - hip.velocity, ankle.acceleration - hip.acceleration
    )
    leg = leg_angles(hip_to_ankle, thigh, tibia, margin, ops)
    rows = [Motion(*(part[i] for part in leg.joints)) for i in range(len(LEG_JOINTS))]
    joints = {f"{side}{name}": row for name, row in zip(LEG_JOINTS, rows, strict=True)}
    return {f"{side}HipYawPitch": constant(0.0), **joints}, leg.reach


def arm_joints(swing: Mapping[str, tuple[float, float]], duration: SX, phase: SX) -> dict[str, Motion]:
    """Joint motions of both arms: those named in ``swing`` as cubics from rest to rest [rad], the others held."""
    still = SX(0)
    moved = {name: cubic(SX(a), SX(b), still, still, duration, phase) for name, (a, b) in swing.items()}
    return {name: constant(angle) for name, angle in HELD_ARM_ANGLES.items()} | moved


@dataclass(frozen=True, kw_only=True, eq=False)
class Phase:
    """A support phase: how the robot moves and what that asks of motors and ground, sampled over time.

    Attributes:
        robot: with links welded that never move.
        variables: number of decision variables.
        duration: name of the variable that holds the phase's duration.
        plan: motion from x (n,), the reach margin, the phase in [0, 1] and an interpretation of acos.
        loads: torques and ZMP from joint motions by name and the hip's position.
        intervals: equal parts of the phase.
        derivatives: analytic ones, or finite differences of the sampled angles as in the paper.
    """

    robot: Robot
    variables: int
    duration: str
    plan: Planner
    loads: Loader
    intervals: int
    derivatives: Derivatives

    def samples(self, point: Point, ops: Nonsmooth) -> Samples:
        """The phase at N + 1 equidistant samples; per-sample functions are mapped, never unrolled."""
        if self.derivatives == "analytic":
            return Samples(*self._mapped(self.sample(ops), point))
        q, _, _, hip, planned, reach, _ = self._mapped(self._kinematics(ops), point)
        qd, qdd = self._differences(q, point)
        torque, moving_torque, zmp = self._dynamics().map(self.intervals + 1)(q, qd, qdd, hip)
        return Samples(planned, reach, torque, qd * moving_torque, zmp)

    def sample(self, ops: Nonsmooth) -> ca.Function:
        """One sample with analytic derivatives: (x, margin, phase) to the fields of ``Samples``."""
        inputs, plan = self._symbolic_plan(ops)
        loads = self.loads(plan.joints, plan.hip)
        power = ca.vertcat(*(plan.joints[name].velocity * loads.torques[name] for name in self.moving))
        planned = ca.vertcat(*(plan.joints[name].position for name in PLANNED_JOINTS))
        torque = ca.vertcat(*(loads.torques[name] for name in JOINTS))
        outputs = ca.cse([planned, plan.reach, torque, power, loads.zmp])
        return ca.Function("sample", inputs, outputs, ["x", "margin", "phase"], list(Samples._fields))

    def signals(self, point: Point, x: Array, p: Array) -> Signals:
        """Time histories at a given x (n,) and parameter vector (k,)."""
        q, qd, qdd, hip, _, _, world = self._mapped(self._kinematics(Exact()), point)
        if self.derivatives == "finite-difference":
            qd, qdd = self._differences(q, point)
        torque, _, zmp = self._dynamics().map(self.intervals + 1)(q, qd, qdd, hip)
        still = {name: motion.position for name, motion in self._symbolic_plan(Exact())[1].joints.items()}
        full = [
            ca.vertcat(*(rows[self.moving.index(n), :] if n in self.moving else MX(DM(fill(n))) for n in JOINTS))
            for rows, fill in (
                (q, lambda n: np.full((1, self.intervals + 1), float(still[n]))),
                (qd, lambda n: np.zeros((1, self.intervals + 1))),
                (qdd, lambda n: np.zeros((1, self.intervals + 1))),
            )
        ]
        time = point[self.duration] * DM(np.linspace(0.0, 1.0, self.intervals + 1)).T
        com, left, right = ca.vertsplit(world, 3)
        names = ("t", "q", "qd", "qdd", "tau", "zmp", "hip", "com", "left_foot", "right_foot")
        evaluate = ca.Function("signals", [point.x, point.p], [time, *full, torque, zmp, hip, com, left, right])
        arrays = {name: np.array(value.full().T) for name, value in zip(names, evaluate(x, p), strict=True)}
        return Signals(joints=JOINTS, arrays={**arrays, "t": arrays["t"][:, 0]})

    @cached_property
    def moving(self) -> tuple[str, ...]:
        """Joints whose angle changes over the phase."""
        joints = self._symbolic_plan(Exact())[1].joints
        return tuple(name for name in JOINTS if not joints[name].velocity.is_zero())

    def _symbolic_plan(self, ops: Nonsmooth) -> tuple[list[SX], Plan]:
        x, margin, phase = SX.sym("x", self.variables), SX.sym("margin"), SX.sym("phase")
        return [x, margin, phase], self.plan(x, margin, phase, ops)

    def _kinematics(self, ops: Nonsmooth) -> ca.Function:
        """One sample: angles that move with their derivatives, hip, planned angles, reach, and com with both feet."""
        inputs, plan = self._symbolic_plan(ops)
        motion = [ca.vertcat(*(plan.joints[name][order] for name in self.moving)) for order in range(3)]
        planned = ca.vertcat(*(plan.joints[name].position for name in PLANNED_JOINTS))
        tree = tree_from(self.robot, self.robot.feet["left"].link)
        angles = {name: joint.position for name, joint in plan.joints.items()}
        com = centre_of_mass(tree, forward_kinematics(tree, angles, plan.ankles["L"]))
        soles = [
            plan.ankles[side] - SX([0, 0, self.robot.feet[foot].ankle_height_m])
            for side, foot in (("L", "left"), ("R", "right"))
        ]
        world = ca.vertcat(com, *soles)
        return ca.Function("kinematics", inputs, [*motion, plan.hip, planned, plan.reach, world])

    def _dynamics(self) -> ca.Function:
        """One sample: torques, those of the moving joints, and ZMP, from given angles and derivatives."""
        _, plan = self._symbolic_plan(Exact())
        parts = [SX.sym(name, len(self.moving)) for name in ("q", "qd", "qdd")]
        hip = SX.sym("hip", 3)
        moved = {name: Motion(*(part[i] for part in parts)) for i, name in enumerate(self.moving)}
        loads = self.loads({**plan.joints, **moved}, hip)
        torque = ca.vertcat(*(loads.torques[name] for name in JOINTS))
        moving = ca.vertcat(*(loads.torques[name] for name in self.moving))
        return ca.Function("dynamics", [*parts, hip], ca.cse([torque, moving, loads.zmp]))

    def _mapped(self, function: ca.Function, point: Point) -> list[MX]:
        """A function of (x, margin, phase) at all samples, one column each."""
        n = self.intervals + 1
        phases = DM(np.linspace(0.0, 1.0, n)).T
        margin = ca.repmat(point["reach_margin"], 1, n)
        return list(function.map(n)(ca.repmat(point.x, 1, n), margin, phases))

    def _differences(self, q: MX, point: Point) -> tuple[MX, MX]:
        """First and second time derivative of sampled angles (m, N + 1): central, one-sided at the ends, twice.

        Source:
            Gupta, Pratihar, Deb (2023), section 3.1: "numerical differentiation as per the given time interval"; the
            stencil is that of MATLAB's ``gradient``, the paper's environment.
        """
        n = self.intervals + 1
        stencil = np.zeros((n, n))
        stencil[0, :2], stencil[-1, -2:] = (-1.0, 1.0), (-1.0, 1.0)
        for k in range(1, n - 1):
            stencil[k, k - 1], stencil[k, k + 1] = -0.5, 0.5
        rate = ca.sparsify(DM(stencil)).T * (self.intervals / ca.fmax(point[self.duration], LEAST_DURATION))
        qd = q @ rate
        return qd, qd @ rate
