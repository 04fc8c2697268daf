"""Limits that only richer motions of the NAO phases can break, and smoothness in place of power."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from typing import Literal, NamedTuple, get_args

import casadi as ca
import numpy as np
from casadi import DM, MX, SX

from nlp_gait.errors import InputError
from nlp_gait.problem.gait_problem import Array, Assembly, Constraint, GaitProblem, Objective, Point
from nlp_gait.problems.nao.body import LEAST_DURATION
from nlp_gait.problems.nao.curves import Splines
from nlp_gait.problems.nao.phase import Phase
from nlp_gait.robots import Robot
from nlp_gait.symbolic.economy import tabulated
from nlp_gait.symbolic.nonsmooth import Nonsmooth, PowerAside
from nlp_gait.symbolic.trajectories import Motion

Criterion = Literal["power", "jerk", "torque-smoothness"]

HEIGHT_SCALE = 0.01  # a foot 10 mm too low counts like 1 rad of a joint
ANGLE_SCALE = 1.0
SMOOTHNESS = {
    "jerk": Objective(name="joint_jerk", unit="rad^2/s^6"),
    "torque-smoothness": Objective(name="torque_rate", unit="(Nm/s)^2"),
}


class Swing(NamedTuple):
    """A foot that swings.

    Attributes:
        path: (3,) position, height above the ground, from x (n,) and the phase [m].
        middle: where it is halfway [m].
        least_height: name of the variable that says how high it must be there.
    """

    path: Callable[[SX, SX], SX]
    middle: float
    least_height: str


def with_motion(
    problem: GaitProblem,
    phase: Phase,
    splines: Splines,
    criterion: Criterion,
    arms: Callable[[SX, SX], Mapping[str, Motion]],
    foot: Swing | None = None,
) -> GaitProblem:
    """A phase's problem with the limits that only a spline can break, and with another objective.

    Args:
        problem: of the phase, with all variables.
        phase: its motion.
        splines: on top of the cubics.
        criterion: what is minimised.
        arms: motion of the arms' joints from x (n,) and the phase.
        foot: the swing foot, if there is one.
    """
    if criterion not in get_args(Criterion):
        raise InputError(f"objective must be one of {', '.join(get_args(Criterion))}, got {criterion!r}")
    if splines.count == 0 and criterion == "power":
        return problem

    def assemble(point: Point, ops: Nonsmooth) -> Assembly:
        assembly = problem.assemble(point, ops if criterion == "power" else PowerAside(ops))
        if splines.count:
            rows = (*_foot_rows(phase, foot, point), *_arm_rows(phase, arms, point))
            assembly = replace(assembly, constraints=(*assembly.constraints, *rows))
        if criterion == "power":
            return assembly
        smoothness = {"jerk": mean_squared_jerk, "torque-smoothness": mean_squared_torque_rate}[criterion]
        value = smoothness(phase, point, ops)
        indexes = {**assembly.indexes, SMOOTHNESS[criterion].name: value}
        return replace(assembly, objective=value, indexes=indexes)

    def start(p: Array, rng: np.random.Generator) -> Array:
        n = len(problem.variables)
        return splines.start(p[-2 * n : -n], p[-n:], rng)

    return replace(
        problem,
        assemble=assemble,
        start=start if splines.count else problem.start,
        objective=SMOOTHNESS.get(criterion, problem.objective),
    )


def mean_squared_jerk(phase: Phase, point: Point, ops: Nonsmooth) -> MX:
    """Mean over time of the sum over joints of squared jerk, from accelerations at neighbouring samples [rad^2/s^6]."""
    return _mean_squared_rate(phase.accelerations(point, ops), phase, point)


def mean_squared_torque_rate(phase: Phase, point: Point, ops: Nonsmooth) -> MX:
    """Mean over time of the sum over joints of squared torque rate, from torques at neighbouring samples [(Nm/s)^2]."""
    return _mean_squared_rate(phase.samples(point, ops).torque, phase, point)


def _mean_squared_rate(values: MX, phase: Phase, point: Point) -> MX:
    step = ca.fmax(point[phase.duration], LEAST_DURATION) / phase.steps
    return ca.sumsqr(values[:, 1:] - values[:, :-1]) / step**2 / phase.steps


def _foot_rows(phase: Phase, foot: Swing | None, point: Point) -> tuple[Constraint, ...]:
    """Swing foot above the ground between its ends, and halfway in the middle of its path, as high as asked for."""
    if foot is None:
        return ()
    n, path = phase.steps, foot.path
    heights = at_phases(lambda x, s: path(x, s)[2], point, np.linspace(0.0, 1.0, n + 1)[1:-1])
    halfway = at_phases(path, point, np.array([0.5]))
    labels = tuple(str(k) for k in range(1, n))
    return (
        Constraint(name="foot_height", labels=labels, unit="m", scale=HEIGHT_SCALE, value=heights.T, lower=MX(0.0)),
        *halfway_rows(halfway[0], foot.middle, halfway[2], point[foot.least_height]),
    )


def halfway_rows(
    along: MX, middle: float, heights: MX, least: MX, labels: tuple[str, ...] = ()
) -> tuple[Constraint, ...]:
    """Where a swing foot is halfway through the phase: in the middle of its path, as in the papers, and high enough.

    Args:
        along: position along the path [m].
        middle: of the path [m].
        heights: (m, 1) of the foot's points [m].
        least: that these may have [m].
        labels: of the points.
    """
    return (
        Constraint(
            name="foot_middle", unit="m", scale=HEIGHT_SCALE, value=along - middle, lower=MX(0.0), upper=MX(0.0)
        ),
        Constraint(name="foot_lift", labels=labels, unit="m", scale=HEIGHT_SCALE, value=heights - least, lower=MX(0.0)),
    )


def _arm_rows(phase: Phase, arms: Callable[[SX, SX], Mapping[str, Motion]], point: Point) -> tuple[Constraint, ...]:
    """Joints of the arms within the robot's limits."""
    n = phase.steps
    x, s = SX.sym("x", phase.variables), SX.sym("s")
    moved = [name for name, motion in arms(x, s).items() if not motion.velocity.is_zero()]
    angles = at_phases(
        lambda x, s: ca.vertcat(*(arms(x, s)[j].position for j in moved)), point, np.linspace(0.0, 1.0, n + 1)[1:-1]
    )
    return (limit_rows(phase.robot, "arm_angle", moved, angles),)


def limit_rows(robot: Robot, name: str, joints: Sequence[str], angles: MX) -> Constraint:
    """Angles (m, N - 1) of joints between the ends within the robot's limits [rad]."""
    columns = angles.shape[1]
    lower, upper = (
        MX(DM(np.tile([robot.joint(joint).planning_limits_rad[end] for joint in joints], columns))) for end in (0, 1)
    )
    return Constraint(
        name=name,
        labels=tuple(f"{joint}, {k}" for k in range(1, columns + 1) for joint in joints),
        unit="rad",
        scale=ANGLE_SCALE,
        value=ca.vec(angles),
        lower=lower,
        upper=upper,
    )


def at_phases(function: Callable[[SX, SX], SX], point: Point, phases: Array) -> MX:
    """Values of a function of x (n,) and the phase, a column for each phase."""
    x, s = SX.sym("x", point.x.shape[0]), SX.sym("s")
    values, table = tabulated(ca.Function("path", [x, s], [function(x, s)]), DM(phases).T)
    return values.map(len(phases))(ca.repmat(point.x, 1, len(phases)), table)
