"""A support phase of NAO sampled over time: how the robot moves and what that asks of motors and ground."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, NamedTuple, get_args

import casadi as ca
import numpy as np
from casadi import DM, MX, SX

from nlp_gait.errors import InputError
from nlp_gait.problem.gait_problem import Array, Point, Signals
from nlp_gait.problems.nao.body import JOINTS, LEAST_DURATION, PLANNED_JOINTS
from nlp_gait.robots import Robot
from nlp_gait.robots.tree import tree_from
from nlp_gait.symbolic.economy import economical, tabulated
from nlp_gait.symbolic.kinematics import centre_of_mass, forward_kinematics
from nlp_gait.symbolic.nonsmooth import Exact, Nonsmooth
from nlp_gait.symbolic.trajectories import Motion

Derivatives = Literal["analytic", "finite-difference"]


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
# From joint motions by name, the hip's position (3,), and points (2,) on the ground under the ankles by side.
Loader = Callable[[Mapping[str, Motion], SX, Mapping[str, SX]], Loads]


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


@dataclass(frozen=True, kw_only=True, eq=False)
class Phase:
    """A support phase: how the robot moves and what that asks of motors and ground, sampled over time.

    Attributes:
        robot: with links welded that never move.
        variables: number of decision variables.
        duration: name of the variable that holds the phase's duration.
        plan: motion from x (n,), the reach margin, the phase in [0, 1] and an interpretation of acos.
        loads: torques and ZMP from joint motions by name, the hip's position and where the feet are.
        intervals: equal parts of the phase over which a torque may change by the limit.
        samples_per_interval: above 1 for a grid that is denser than the intervals.
        derivatives: analytic ones, or finite differences of the sampled angles as in the paper.
    """

    robot: Robot
    variables: int
    duration: str
    plan: Planner
    loads: Loader
    intervals: int
    samples_per_interval: int
    derivatives: Derivatives

    def __post_init__(self) -> None:
        """Refuse options that give no grid or no derivatives."""
        for name in ("intervals", "samples_per_interval"):
            count = getattr(self, name)
            if isinstance(count, bool) or not isinstance(count, int) or count < 1:
                raise InputError(f"{name} must be a whole number >= 1, got {count!r}")
        if self.derivatives not in get_args(Derivatives):
            raise InputError(f"derivatives must be one of {', '.join(get_args(Derivatives))}, got {self.derivatives!r}")

    @property
    def steps(self) -> int:
        """N, one less than the number of samples."""
        return self.intervals * self.samples_per_interval

    def samples(self, point: Point, ops: Nonsmooth) -> Samples:
        """The phase at N + 1 equidistant samples; per-sample functions are mapped, never unrolled."""
        if self.derivatives == "analytic":
            return Samples(*self._mapped(self.sample(ops), point))
        q, _, _, hip, planned, reach, world = self._mapped(self._kinematics(ops), point)
        qd, qdd = self._differences(q, point)
        torque, moving_torque, zmp = self._dynamics().map(self.steps + 1)(q, qd, qdd, hip, world)
        return Samples(planned, reach, torque, qd * moving_torque, zmp)

    def motions(self, point: Point, ops: Nonsmooth) -> tuple[MX, MX, MX]:
        """Angles of the joints that move, and both derivatives, (m, N + 1) each [rad, rad/s, rad/s^2]."""
        q, qd, qdd, *_ = self._mapped(self._kinematics(ops), point)
        return (q, qd, qdd) if self.derivatives == "analytic" else (q, *self._differences(q, point))

    def accelerations(self, point: Point, ops: Nonsmooth) -> MX:
        """(m, N + 1) of the joints that move [rad/s^2]."""
        return self.motions(point, ops)[2]

    def sample(self, ops: Nonsmooth) -> ca.Function:
        """One sample with analytic derivatives: (x, margin, phase) to the fields of ``Samples``."""
        inputs, plan = self._symbolic_plan(ops)
        loads = self.loads(plan.joints, plan.hip, {side: ankle[:2] for side, ankle in plan.ankles.items()})
        power = ca.vertcat(*(plan.joints[name].velocity * loads.torques[name] for name in self.moving))
        planned = ca.vertcat(*(plan.joints[name].position for name in PLANNED_JOINTS))
        torque = ca.vertcat(*(loads.torques[name] for name in JOINTS))
        outputs = economical([planned, plan.reach, torque, power, loads.zmp])
        return ca.Function("sample", inputs, outputs, ["x", "margin", "phase"], list(Samples._fields))

    def signals(self, point: Point, x: Array, p: Array) -> Signals:
        """Time histories at a given x (n,) and parameter vector (k,)."""
        q, qd, qdd, hip, _, _, world = self._mapped(self._kinematics(Exact()), point)
        if self.derivatives == "finite-difference":
            qd, qdd = self._differences(q, point)
        torque, _, zmp = self._dynamics().map(self.steps + 1)(q, qd, qdd, hip, world)
        still = {name: motion.position for name, motion in self._symbolic_plan(Exact())[1].joints.items()}
        full = [
            ca.vertcat(*(rows[self.moving.index(n), :] if n in self.moving else MX(DM(fill(n))) for n in JOINTS))
            for rows, fill in (
                (q, lambda n: np.full((1, self.steps + 1), float(still[n]))),
                (qd, lambda n: np.zeros((1, self.steps + 1))),
                (qdd, lambda n: np.zeros((1, self.steps + 1))),
            )
        ]
        time = point[self.duration] * DM(np.linspace(0.0, 1.0, self.steps + 1)).T
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
        """One sample: torques, those of the moving joints, and ZMP, from angles and derivatives, hip, and com with feet."""
        _, plan = self._symbolic_plan(Exact())
        parts = [SX.sym(name, len(self.moving)) for name in ("q", "qd", "qdd")]
        hip, world = SX.sym("hip", 3), SX.sym("world", 9)
        _, left, right = ca.vertsplit(world, 3)
        moved = {name: Motion(*(part[i] for part in parts)) for i, name in enumerate(self.moving)}
        loads = self.loads({**plan.joints, **moved}, hip, {"L": left[:2], "R": right[:2]})
        torque = ca.vertcat(*(loads.torques[name] for name in JOINTS))
        moving = ca.vertcat(*(loads.torques[name] for name in self.moving))
        return ca.Function("dynamics", [*parts, hip, world], economical([torque, moving, loads.zmp]))

    def _mapped(self, function: ca.Function, point: Point) -> list[MX]:
        """A function of (x, margin, phase) at all samples, one column each."""
        n = self.steps + 1
        phases = DM(np.linspace(0.0, 1.0, n)).T
        margin = ca.repmat(point["reach_margin"], 1, n)
        function, table = tabulated(function, phases)
        return list(function.map(n)(ca.repmat(point.x, 1, n), margin, table))

    def _differences(self, q: MX, point: Point) -> tuple[MX, MX]:
        """First and second time derivative of sampled angles (m, N + 1): central, one-sided at the ends, twice.

        Source:
            Gupta, Pratihar, Deb (2023), section 3.1: "numerical differentiation as per the given time interval"; the
            stencil is that of MATLAB's ``gradient``, the paper's environment.
        """
        n = self.steps + 1
        stencil = np.zeros((n, n))
        stencil[0, :2], stencil[-1, -2:] = (-1.0, 1.0), (-1.0, 1.0)
        for k in range(1, n - 1):
            stencil[k, k - 1], stencil[k, k + 1] = -0.5, 0.5
        rate = ca.sparsify(DM(stencil)).T * (self.steps / ca.fmax(point[self.duration], LEAST_DURATION))
        qd = q @ rate
        return qd, qd @ rate
