"""Richer motions for the NAO phases: quintics and splines in place of the papers' cubics, and smoothness in place of power.

A curve is the papers' cubic plus a spline that leaves its ends alone. The spline's coefficients are variables after the papers'
own; with all of them at zero the motion is the papers'.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal, NamedTuple, TypeAlias, get_args

import casadi as ca
import numpy as np
from casadi import DM, MX, SX

from nlp_gait.errors import InputError
from nlp_gait.problems.gait_problem import Array, Assembly, Constraint, GaitProblem, Objective, Point, Variable
from nlp_gait.problems.nao import arm_joints, hip_motion
from nlp_gait.problems.nao_phase import Phase
from nlp_gait.robots import Robot
from nlp_gait.symbolic.economy import tabulated
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.symbolic.splines import coefficient_count, spline
from nlp_gait.symbolic.trajectories import Motion, plus, stack

Trajectory = Literal["cubic", "quintic", "spline-2", "spline-4", "spline-8", "spline-16"]
SPANS: dict[str, int] = dict(zip(get_args(Trajectory), (0, 1, 2, 4, 8, 16), strict=True))
Criterion = Literal["power", "jerk", "torque-smoothness"]

# Samples in each interval if none are asked for: a cubic has no room between 11 samples, a spline has.
SAMPLES, SPLINE_SAMPLES = 1, 4
# Coefficients of a spline lie within these bounds, wider than any optimum's, and start within a share of them.
BOUNDS = {"m": 0.3, "rad": 3.0}
START_SHARE = 0.05
HEIGHT_SCALE = 0.01  # a foot 10 mm too low counts like 1 rad of a joint
ANGLE_SCALE = 1.0

HIP_CURVES = ("hip_x", "hip_y", "hip_z")
# Motions by curve from x (n,) and the phase.
Curves = Callable[[SX, SX], Mapping[str, Motion]]
Units: TypeAlias = Mapping[str, str]


class Heights(NamedTuple):
    """Height of a foot above the ground [m] from x (n,) and the phase, and the variable that says how high it must get."""

    curve: Callable[[SX, SX], SX]
    least_in_the_middle: str


@dataclass(frozen=True, kw_only=True)
class Splines:
    """Splines on top of the papers' cubics.

    Attributes:
        trajectory: their order.
        units: of each curve by name, ``"m"`` or ``"rad"``.
        first: number of variables before the coefficients.
    """

    trajectory: Trajectory
    units: Units
    first: int

    def __post_init__(self) -> None:
        """Refuse an unknown order."""
        if self.trajectory not in SPANS:
            raise InputError(f"trajectory must be one of {', '.join(SPANS)}, got {self.trajectory!r}")

    @property
    def count(self) -> int:
        """Coefficients of each curve."""
        return coefficient_count(SPANS[self.trajectory])

    @property
    def variables(self) -> tuple[Variable, ...]:
        """Coefficients, curve by curve."""
        return tuple(
            Variable(
                name=f"{curve}_{unit}[{k}]",
                unit=unit,
                lower=-BOUNDS[unit],
                upper=BOUNDS[unit],
                description=f"coefficient {k} of the spline on {curve}",
            )
            for curve, unit in self.units.items()
            for k in range(self.count)
        )

    def motions(self, x: SX, duration: SX, phase: SX) -> dict[str, Motion]:
        """What each curve adds to its cubic, from x (n,)."""
        m = self.count
        starts = {curve: self.first + m * i for i, curve in enumerate(self.units)}
        return {curve: spline(x[start : start + m], duration, phase) for curve, start in starts.items()}

    def start(self, lower: Array, upper: Array, rng: np.random.Generator) -> Array:
        """Start point: the papers' variables anywhere within their bounds, coefficients near zero."""
        share = np.ones(len(lower))
        share[self.first :] = START_SHARE
        middle, half = (lower + upper) / 2, (upper - lower) / 2
        return middle + share * rng.uniform(-half, half)


def hip_and_arm_units(swing: Mapping[str, tuple[float, float]]) -> dict[str, str]:
    """Units of the curves that every phase has: the hip's and those of the arms' joints that swing."""
    return dict.fromkeys(HIP_CURVES, "m") | dict.fromkeys(swing, "rad")


def hip_on_spline(
    x: SX, splines: Splines, along: tuple[float, float], across: tuple[float, float], duration: SX, phase: SX
) -> Motion:
    """Motion of the torso's origin (3,) [m]: the papers' (see ``nao.hip_motion``), and the splines on it."""
    more = splines.motions(x, duration, phase)
    return plus(hip_motion(x[:7], along, across, duration, phase), stack(*(more[curve] for curve in HIP_CURVES)))


def arm_motions(
    x: SX, splines: Splines, swing: Mapping[str, tuple[float, float]], duration: SX, phase: SX
) -> dict[str, Motion]:
    """Motions of the arms' joints [rad]: the papers' (see ``nao.arm_joints``), and the splines on them."""
    more = splines.motions(x, duration, phase)
    arms = arm_joints(swing, duration, phase)
    return arms | {joint: plus(arms[joint], more[joint]) for joint in swing}


def samples_in_interval(trajectory: str, samples_per_interval: int) -> int:
    """Number of samples in an interval: what is asked for, or for 0 what suits the trajectory."""
    if samples_per_interval != 0 or isinstance(samples_per_interval, bool):
        return samples_per_interval
    return SAMPLES if trajectory == "cubic" else SPLINE_SAMPLES


def motion_options(trajectory: str, criterion: str, samples_per_interval: int) -> dict[str, str | int]:
    """Options of a problem that say how its motion differs from the papers'; none if it does not."""
    options: dict[str, str | int] = {}
    if trajectory != "cubic":
        options |= {"trajectory": trajectory, "samples_per_interval": samples_per_interval}
    return options | ({"objective": criterion} if criterion != "power" else {})


def with_motion(
    problem: GaitProblem,
    phase: Phase,
    splines: Splines,
    criterion: Criterion,
    arms: Callable[[SX, SX], Mapping[str, Motion]],
    foot: Heights | None = None,
) -> GaitProblem:
    """A phase's problem with the limits that only a spline can break, and with another objective.

    Args:
        problem: of the phase, with all variables.
        phase: its motion.
        splines: on top of the cubics.
        criterion: what is minimised.
        arms: motion of the arms' joints from x (n,) and the phase.
        foot: height of the swing foot, if there is one.
    """
    if criterion not in get_args(Criterion):
        raise InputError(f"objective must be one of {', '.join(get_args(Criterion))}, got {criterion!r}")
    if splines.count == 0 and criterion == "power":
        return problem

    def assemble(point: Point, ops: Nonsmooth) -> Assembly:
        assembly = problem.assemble(point, ops if criterion == "power" else _PowerAside(ops))
        if splines.count:
            rows = (*_foot_rows(phase, foot, point), *_arm_rows(phase, arms, point))
            assembly = replace(assembly, constraints=(*assembly.constraints, *rows))
        if criterion == "power":
            return assembly
        smoothness = {"jerk": mean_squared_jerk, "torque-smoothness": mean_squared_torque_rate}[criterion]
        value = smoothness(phase, point, ops)
        indexes = {**assembly.indexes, UNITS[criterion].name: value}
        return replace(assembly, objective=value, indexes=indexes)

    def start(p: Array, rng: np.random.Generator) -> Array:
        n = len(problem.variables)
        return splines.start(p[-2 * n : -n], p[-n:], rng)

    return replace(
        problem,
        assemble=assemble,
        start=start if splines.count else problem.start,
        objective=UNITS.get(criterion, problem.objective),
    )


UNITS = {
    "jerk": Objective(name="joint_jerk", unit="rad^2/s^6"),
    "torque-smoothness": Objective(name="torque_rate", unit="(Nm/s)^2"),
}


def mean_squared_jerk(phase: Phase, point: Point, ops: Nonsmooth) -> MX:
    """Mean over time of the sum over joints of squared jerk, from accelerations at neighbouring samples [rad^2/s^6]."""
    return _mean_squared_rate(phase.accelerations(point, ops), phase, point)


def mean_squared_torque_rate(phase: Phase, point: Point, ops: Nonsmooth) -> MX:
    """Mean over time of the sum over joints of squared torque rate, from torques at neighbouring samples [(Nm/s)^2]."""
    return _mean_squared_rate(phase.samples(point, ops).torque, phase, point)


def _mean_squared_rate(values: MX, phase: Phase, point: Point) -> MX:
    step = point[phase.duration] / phase.steps
    return ca.sumsqr(values[:, 1:] - values[:, :-1]) / step**2 / phase.steps


class _PowerAside:
    """An interpretation for problems in which power is an index only: nothing keeps a lifted |.| down there."""

    def __init__(self, ops: Nonsmooth) -> None:
        self._ops = ops
        self.acos, self.min, self.largest = ops.acos, ops.min, ops.largest
        self.step, self.tie, self.rollout = ops.step, ops.tie, ops.rollout

    def abs(self, v: MX) -> MX:
        """|v|."""
        return ca.fabs(v)


def _foot_rows(phase: Phase, foot: Heights | None, point: Point) -> tuple[Constraint, ...]:
    """Swing foot above the ground between its ends, and as high as asked for in the middle of the phase."""
    if foot is None:
        return ()
    n = phase.steps
    heights = _at(lambda x, s: foot.curve(x, s), point, np.linspace(0.0, 1.0, n + 1)[1:-1])
    middle = _at(lambda x, s: foot.curve(x, s), point, np.array([0.5]))
    return (
        Constraint(
            name="foot_height",
            labels=tuple(str(k) for k in range(1, n)),
            unit="m",
            scale=HEIGHT_SCALE,
            value=heights.T,
            lower=MX(0.0),
        ),
        Constraint(
            name="foot_lift",
            unit="m",
            scale=HEIGHT_SCALE,
            value=middle - point[foot.least_in_the_middle],
            lower=MX(0.0),
        ),
    )


def _arm_rows(phase: Phase, arms: Callable[[SX, SX], Mapping[str, Motion]], point: Point) -> tuple[Constraint, ...]:
    """Joints of the arms within the robot's limits."""
    n = phase.steps
    x, s = SX.sym("x", phase.variables), SX.sym("s")
    moved = [name for name, motion in arms(x, s).items() if not motion.velocity.is_zero()]
    angles = _at(lambda x, s: ca.vertcat(*(arms(x, s)[j].position for j in moved)), point, np.linspace(0.0, 1.0, n + 1)[1:-1])
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


def _at(function: Callable[[SX, SX], SX], point: Point, phases: Array) -> MX:
    """Values of a function of x (n,) and the phase, a column for each phase."""
    x, s = SX.sym("x", point.x.shape[0]), SX.sym("s")
    values, table = tabulated(ca.Function("path", [x, s], [function(x, s)]), DM(phases).T)
    return values.map(len(phases))(ca.repmat(point.x, 1, len(phases)), table)
