"""NAO's real motors in the problems of its phases: what they can give, and what they draw.

An option lists what is taken into account, in addition to the paper or in place of it:

    limits          speed, torque against speed, and continuous torque of every motor
    ankle           roll of an ankle limited by its pitch
    free-braking    braking draws nothing, in place of as much as driving: the positive part of torque times rate
    regeneration    braking gives back what it takes, in place of drawing it: torque times rate with its sign
    heat            heat constant of each motor from its data sheet, in place of one K for all

Both hip yaw-pitch joints have one motor. No source gives a limit of acceleration, so there is none here.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import casadi as ca
import numpy as np
from casadi import DM, MX

from nlp_gait.errors import InputError, unknown
from nlp_gait.problem.gait_problem import Array, Assembly, Constraint, GaitProblem, Parameter, Point, Signals
from nlp_gait.problems.nao.body import JOINTS
from nlp_gait.problems.nao.limits import ANGLE_SCALE, TORQUE_SCALE, labels, time_mean
from nlp_gait.problems.nao.phase import Phase, Samples
from nlp_gait.robots import Robot
from nlp_gait.robots.robot import Motor
from nlp_gait.symbolic.nonsmooth import Nonsmooth, PowerAside

SPEED_SCALE = 1.0  # 1 rad/s too fast counts like 1 rad or 1 Nm
FEATURES = ("limits", "ankle", "free-braking", "regeneration", "heat")

SHARED = ("LHipYawPitch", "RHipYawPitch")  # one motor turns both
# Ankle pitch, least and greatest roll of the left ankle [rad]; straight lines between. The right ankle mirrors it.
# Source: public MATLAB tables "Nao Parameters v4.0" (there stored under the other side's name; the greatest range is that of
# the left joint).
ANKLE_ROLL = (
    (-1.189442, -0.049916, 0.075049),
    (-0.840027, -0.179943, 0.169995),
    (-0.700051, -0.397935, 0.220086),
    (-0.449946, -0.397935, 0.768992),
    (0.100007, -0.397935, 0.768992),
    (0.349938, -0.397935, 0.550477),
    (0.922755, 0.0, 0.049916),
)
SUPPLY = Parameter(
    name="supply_share",
    unit="1",
    default=1.0,
    description="voltage of the motors as a share of the data sheet's; speed at no load and torque at stall follow it",
    minimum=0.05,
    maximum=2.0,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Motors:
    """What of the real motors a problem takes into account."""

    features: tuple[str, ...]

    def __post_init__(self) -> None:
        """Refuse unknown features, and two rules for braking."""
        for name in self.features:
            if name not in FEATURES:
                raise unknown("feature in motors", name, FEATURES)
        if {"free-braking", "regeneration"} <= set(self.features):
            raise InputError("motors: braking either draws nothing (free-braking) or gives power back (regeneration)")

    @property
    def draws_differently(self) -> bool:
        """Whether the power is another one than the paper's."""
        return bool({"free-braking", "regeneration", "heat"} & set(self.features))


def parsed(text: str) -> Motors:
    """Features from an option's text, separated by commas; none if it is empty.

    Raises:
        UnknownNameError: no such feature.
        InputError: features that exclude each other.
    """
    return Motors(features=tuple(part.strip() for part in text.split(",") if part.strip()))


def motor_options(motors: str) -> dict[str, str]:
    """Option of a problem with real motors; none if it has the paper's."""
    return {"motors": motors} if motors else {}


def with_motors(problem: GaitProblem, phase: Phase, text: str) -> GaitProblem:
    """A phase's problem with real motors.

    Args:
        problem: of the phase.
        phase: its motion and loads.
        text: features, see above; the problem itself if there are none.

    Raises:
        UnknownNameError: no such feature.
        InputError: features that exclude each other or the objective; a joint of the robot without data of its motor.
    """
    motors = parsed(text)
    if not motors.features:
        return problem
    if motors.draws_differently and problem.objective.name != "power":
        raise InputError(
            f"motors={text!r} changes the power, but the objective is {problem.objective.name}; leave out what changes it"
        )
    ratings = [_motor(phase.robot, joint) for joint in JOINTS]
    own = len(problem.own_parameters)
    limited = "limits" in motors.features

    def assemble(point: Point, ops: Nonsmooth) -> Assembly:
        assembly = problem.assemble(point, PowerAside(ops) if motors.draws_differently else ops)
        samples = phase.samples(point, ops)
        rows: list[Constraint] = []
        if limited or "ankle" in motors.features:
            q, qd, _ = phase.motions(point, ops)
            rows += _motor_rows(phase, ratings, samples.torque, qd, point[SUPPLY.name]) if limited else []
            rows += _ankle_rows(phase.moving, q) if "ankle" in motors.features else []
        assembly = replace(assembly, constraints=(*assembly.constraints, *rows))
        if not motors.draws_differently:
            return assembly
        power = _power(point, ops, samples, ratings, motors)
        indexes = {**assembly.indexes, "paper_power_W": assembly.indexes["power_W"], "power_W": power}
        return replace(assembly, objective=power, indexes=indexes)

    def signals(x: Array, p: Array) -> Signals:
        return problem.signals(x, np.delete(p, own) if limited else p)  # type: ignore[misc]

    return replace(
        problem,
        own_parameters=(*problem.own_parameters, SUPPLY) if limited else problem.own_parameters,
        assemble=assemble,
        signals=signals,
        _built={},
    )


def _motor(robot: Robot, joint: str) -> Motor:
    motor = robot.joint(joint).motor
    if motor is None:
        raise InputError(f"robot {robot.name!r}: joint {joint!r} has no motor data, which the option motors needs")
    return motor


def _power(point: Point, ops: Nonsmooth, samples: Samples, ratings: Sequence[Motor], motors: Motors) -> MX:
    """Mean electrical power over the phase [W]."""
    driven = ca.vec(samples.power)
    if "regeneration" in motors.features:
        mechanical = driven
    elif "free-braking" in motors.features:
        mechanical = (driven + ops.abs(driven)) / 2
    else:
        mechanical = ops.abs(driven)
    if "heat" in motors.features:
        constants = DM([rating.heat_W_per_Nm2 for rating in ratings])
        heat = constants.T @ _by_motor(samples.torque) ** 2
    else:
        heat = point["heat_loss_W_per_Nm2"] * ca.sum1(samples.torque**2)
    return time_mean(ca.sum1(ca.reshape(mechanical, *samples.power.shape)) + heat)


def _by_motor(torque: MX) -> MX:
    """Torques (22, n) with both hip yaw-pitch joints' at the motor that they share, in the first one's row."""
    first, second = (JOINTS.index(joint) for joint in SHARED)
    sharing = np.eye(len(JOINTS))
    sharing[first, second], sharing[second, second] = 1.0, 0.0
    return ca.sparsify(DM(sharing)) @ torque


def _motor_rows(phase: Phase, ratings: Sequence[Motor], torque: MX, qd: MX, supply: MX) -> list[Constraint]:
    """Speed, torque against speed |tau| <= stall (1 - |qd| / no-load), and root mean square torque of every motor.

    As two lines of each sign, tau +- qd stall / no-load within +- stall, in braking too, where a motor could give more.
    """
    n = torque.shape[1]
    samples = [str(k) for k in range(n)]
    motors = [k for k, joint in enumerate(JOINTS) if joint != SHARED[1]]
    names = tuple(JOINTS[k] for k in motors)
    loads = _by_motor(torque)[motors, :]
    stall = DM([ratings[k].stall_torque_Nm for k in motors])
    slope = DM([ratings[k].stall_torque_Nm / ratings[k].no_load_rad_s for k in motors])
    place = DM(len(motors), len(phase.moving))
    for column, joint in enumerate(phase.moving):
        place[names.index(joint), column] = 1.0
    drop = ca.repmat(slope, 1, n) * (ca.sparsify(place) @ qd)
    speed = DM([phase.robot.joint(joint).velocity_limit_rad_s for joint in phase.moving])
    return [
        Constraint(
            name="joint_speed",
            labels=labels(phase.moving, samples),
            unit="rad/s",
            scale=SPEED_SCALE,
            value=ca.vec(qd),
            lower=MX(-ca.repmat(speed, n, 1)),
            upper=MX(ca.repmat(speed, n, 1)),
        ),
        *(
            Constraint(
                name=f"torque_{kind}",
                labels=labels(names, samples),
                unit="Nm",
                scale=TORQUE_SCALE,
                value=ca.vec(loads + sign * drop),
                lower=-supply * ca.repmat(stall, n, 1),
                upper=supply * ca.repmat(stall, n, 1),
            )
            for kind, sign in (("forwards", 1.0), ("backwards", -1.0))
        ),
        Constraint(
            name="continuous_torque",
            labels=names,
            unit="Nm",
            scale=TORQUE_SCALE,
            value=ca.sqrt(time_mean(loads**2)),
            upper=MX(DM([ratings[k].continuous_torque_Nm for k in motors])),
        ),
    ]


def _ankle_rows(moving: Sequence[str], q: MX) -> list[Constraint]:
    """Roll of both ankles within the lines over their pitch [rad]."""
    rows = []
    for side, sign, columns in (("L", 1.0, (1, 2)), ("R", -1.0, (2, 1))):
        pitch, roll = (q[moving.index(f"{side}{joint}"), :].T for joint in ("AnklePitch", "AnkleRoll"))
        least, greatest = (sign * ankle_roll(pitch, column) for column in columns)
        for name, line, lower, upper in (("least", least, MX(0.0), None), ("greatest", greatest, None, MX(0.0))):
            rows.append(
                Constraint(
                    name=f"{side}AnkleRoll_{name}",
                    labels=tuple(str(k) for k in range(q.shape[1])),
                    unit="rad",
                    scale=ANGLE_SCALE,
                    value=roll - line,
                    lower=lower,
                    upper=upper,
                )
            )
    return rows


def ankle_roll(pitch: MX, column: int) -> MX:
    """Least (column 1) or greatest (2) roll of the left ankle over its pitch [rad], constant beyond the table."""
    corners = np.array(ANKLE_ROLL)
    slopes = np.diff(corners[:, column]) / np.diff(corners[:, 0])
    turns = np.diff(np.concatenate([[0.0], slopes, [0.0]]))
    value = MX(corners[0, column])
    for at, turn in zip(corners[:, 0].tolist(), turns.tolist(), strict=True):
        value = value + turn * ca.fmax(pitch - at, 0.0)
    return value
