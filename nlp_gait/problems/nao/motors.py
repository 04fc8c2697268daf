"""NAO's real motors in the problems of its phases: what they can give, and what they draw.

An option lists what is taken into account, in addition to the paper or in place of it:

    limits          speed, torque against speed, and continuous torque of every motor
    ankle           roll of an ankle limited by its pitch
    free-braking    braking draws nothing, in place of as much as driving: the positive part of torque times rate
    regeneration    braking gives back what it takes, in place of drawing it: torque times rate with its sign
    heat            heat constant of each motor from its data sheet, in place of one K for all
    rotor           inertia of every rotor at its joint: torques and what follows from them, and the engine's joints alike

Both hip yaw-pitch joints have one motor, whose rotor counts half at each. No source gives a limit of acceleration, so there is
none here.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import casadi as ca
import numpy as np
from casadi import DM, MX

from nlp_gait.errors import InputError, unknown
from nlp_gait.problem import Parameter, Point
from nlp_gait.problem.blocks import labels
from nlp_gait.problems.biped.goals import HEAT_LOSS, Draw
from nlp_gait.problems.biped.parts import Contribution, Part, rows
from nlp_gait.problems.biped.samples import Samples, time_mean
from nlp_gait.problems.nao.body import JOINTS
from nlp_gait.robots import Robot
from nlp_gait.robots.robot import Motor
from nlp_gait.symbolic.nonsmooth import Nonsmooth

FEATURES = ("limits", "ankle", "free-braking", "regeneration", "heat", "rotor")

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


@dataclass(frozen=True, kw_only=True, eq=False)
class Motors:
    """What of the real motors a problem takes into account.

    Attributes:
        features: see above.
        robot: whose motors they are, without the inertia of their rotors.

    Raises:
        UnknownNameError: no such feature.
        InputError: features that exclude each other; a joint of the robot without data of its motor, or of its rotor.
    """

    features: tuple[str, ...]
    robot: Robot

    def __post_init__(self) -> None:
        """Refuse unknown features, and two rules for braking."""
        for name in self.features:
            if name not in FEATURES:
                raise unknown("feature in motors", name, FEATURES)
        if {"free-braking", "regeneration"} <= set(self.features):
            raise InputError("motors: braking either draws nothing (free-braking) or gives power back (regeneration)")
        if self.features:
            self._ratings, self.model  # noqa: B018  a robot without data is refused now

    @classmethod
    def parsed(cls, text: str, robot: Robot) -> Motors:
        """Features from an option's text, separated by commas; none if it is empty."""
        return cls(features=tuple(part.strip() for part in text.split(",") if part.strip()), robot=robot)

    @cached_property
    def model(self) -> Robot:
        """The robot as the dynamics take it: with the inertia of its rotors, if asked for."""
        if "rotor" not in self.features:
            return self.robot
        found = {}
        for joint, rating in zip(JOINTS, self._ratings, strict=True):
            if rating.reflected_inertia_kgm2 is None:
                raise InputError(
                    f"robot {self.robot.name!r}: the motor of joint {joint!r} has no rotor_inertia_gcm2, which motors=rotor needs"
                )
            found[joint] = rating.reflected_inertia_kgm2 / (len(SHARED) if joint in SHARED else 1)
        return replace(self.robot, armatures_kgm2=found)

    @property
    def parts(self) -> tuple[Part, ...]:
        """Limits of the motors."""
        limits = (MotorLimits(self.robot, self._ratings),) if "limits" in self.features else ()
        return (*limits, *((AnkleCoupling(),) if "ankle" in self.features else ()))

    @property
    def draw(self) -> Draw | None:
        """How the motors draw power; None for the paper's way."""
        return self._power if {"free-braking", "regeneration", "heat"} & set(self.features) else None

    def _power(self, at: Point, samples: Samples, ops: Nonsmooth) -> MX:
        """Mean electrical power over the phase [W]."""
        driven = ca.vec(samples.power)
        if "regeneration" in self.features:
            mechanical = driven
        elif "free-braking" in self.features:
            mechanical = (driven + ops.abs(driven)) / 2
        else:
            mechanical = ops.abs(driven)
        if "heat" in self.features:
            constants = DM([rating.heat_W_per_Nm2 for rating in self._ratings])
            heat = constants.T @ _by_motor(samples.torque) ** 2
        else:
            heat = at[HEAT_LOSS.name] * ca.sum1(samples.torque**2)
        return time_mean(ca.sum1(ca.reshape(mechanical, *samples.power.shape)) + heat)

    @cached_property
    def _ratings(self) -> tuple[Motor, ...]:
        """Data of the motors, one for each of ``JOINTS``."""
        ratings = []
        for joint in JOINTS:
            motor = self.robot.joint(joint).motor
            if motor is None:
                raise InputError(
                    f"robot {self.robot.name!r}: joint {joint!r} has no motor data, which the option motors needs"
                )
            ratings.append(motor)
        return tuple(ratings)


def _by_motor(torque: MX) -> MX:
    """Torques (22, n) with both hip yaw-pitch joints' at the motor that they share, in the first one's row."""
    first, second = (JOINTS.index(joint) for joint in SHARED)
    sharing = np.eye(len(JOINTS))
    sharing[first, second], sharing[second, second] = 1.0, 0.0
    return ca.sparsify(DM(sharing)) @ torque


class MotorLimits(Part):
    """Speed, torque against speed |tau| <= stall (1 - |qd| / no-load), and root mean square torque of every motor.

    As two lines of each sign, tau +- qd stall / no-load within +- stall, in braking too, where a motor could give more.

    Args:
        robot: whose joints' speeds are limited.
        ratings: of the motors, one for each of ``JOINTS``.
    """

    parameters = (SUPPLY,)
    reads_motion = True

    def __init__(self, robot: Robot, ratings: Sequence[Motor]) -> None:
        self._robot, self._ratings = robot, ratings

    def contribute(self, at: Point, samples: Samples, ops: Nonsmooth) -> Contribution:
        """Two-sided rows, and an upper bound on the mean squares' roots."""
        torque, qd, moving, supply = samples.torque, samples.qd, samples.moving, at[SUPPLY.name]
        n = torque.shape[1]
        motors = [k for k, joint in enumerate(JOINTS) if joint != SHARED[1]]
        names = tuple(JOINTS[k] for k in motors)
        loads = _by_motor(torque)[motors, :]
        ratings = [self._ratings[k] for k in motors]
        stall = DM([rating.stall_torque_Nm for rating in ratings])
        slope = DM([rating.stall_torque_Nm / rating.no_load_rad_s for rating in ratings])
        place = DM(len(motors), len(moving))
        for column, joint in enumerate(moving):
            place[names.index(joint), column] = 1.0
        drop = ca.repmat(slope, 1, n) * (ca.sparsify(place) @ qd)
        speed = DM([self._robot.joint(joint).velocity_limit_rad_s for joint in moving])
        fastest, strongest = MX(ca.repmat(speed, n, 1)), supply * ca.repmat(stall, n, 1)
        too_fast = rows("joint_speed", "rad/s", ca.vec(qd), -fastest, fastest, labels(moving, range(n)), "instant")
        too_weak = [
            rows(f"torque_{kind}", "Nm", ca.vec(turned), -strongest, strongest, labels(names, range(n)), "instant")
            for kind, turned in (("forwards", loads + drop), ("backwards", loads - drop))
        ]
        continuous = MX(DM([rating.continuous_torque_Nm for rating in ratings]))
        rms = ca.sqrt(time_mean(loads**2))
        too_hot = rows("continuous_torque", "Nm", rms, None, continuous, names, "root-mean-square")
        return Contribution(rows=(too_fast, *too_weak, too_hot))


class AnkleCoupling(Part):
    """Roll of both ankles within the lines over their pitch."""

    reads_motion = True

    def contribute(self, at: Point, samples: Samples, ops: Nonsmooth) -> Contribution:
        """Rows with one bound each."""
        angles: Mapping[str, MX] = dict(zip(samples.moving, ca.vertsplit(samples.q), strict=True))
        names = [str(k) for k in range(samples.steps + 1)]
        found = []
        for side, sign, columns in (("L", 1.0, (1, 2)), ("R", -1.0, (2, 1))):
            pitch, roll = (angles[f"{side}{joint}"].T for joint in ("AnklePitch", "AnkleRoll"))
            least, greatest = (sign * ankle_roll(pitch, column) for column in columns)
            found += [
                rows(f"{side}AnkleRoll_least", "rad", roll - least, MX(0.0), None, names, "instant"),
                rows(f"{side}AnkleRoll_greatest", "rad", roll - greatest, None, MX(0.0), names, "instant"),
            ]
        return Contribution(rows=tuple(found))


def ankle_roll(pitch: MX, column: int) -> MX:
    """Least (column 1) or greatest (2) roll of the left ankle over its pitch [rad], constant beyond the table."""
    corners = np.array(ANKLE_ROLL)
    slopes = np.diff(corners[:, column]) / np.diff(corners[:, 0])
    turns = np.diff(np.concatenate([[0.0], slopes, [0.0]]))
    value = MX(corners[0, column])
    for at, turn in zip(corners[:, 0].tolist(), turns.tolist(), strict=True):
        value = value + turn * ca.fmax(pitch - at, 0.0)
    return value
