"""Real motors in the problems of a phase: their limits and their power.

An option lists the features that are taken into account, in addition to the paper's model or in place of it:

    limits          speed, torque against speed, and continuous torque of every motor
    ankle           roll of an ankle limited by its pitch, if the robot's limits are known
    free-braking    braking needs no power, instead of as much as driving: the positive part of torque times rate
    regeneration    braking returns power: torque times rate with its sign
    heat            heat constant of each motor from its data sheet, instead of one K for all
    rotor           inertia of every rotor at its joint, in torques and all that follows from them, and in the engine

Two joints may share a motor, whose rotor counts half at each: NAO's hip yaw-pitch joints do. No source gives a limit of
acceleration, so there is none here.
"""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import casadi as ca
import numpy as np
from casadi import DM, MX

from nlp_gait.errors import InputError, unknown
from nlp_gait.formulation import Parameter, Point
from nlp_gait.gaits.biped.goals import HEAT_LOSS, PowerModel
from nlp_gait.gaits.biped.limits import Limit, RowsAndIndexes, make_rows, make_rows_at_samples
from nlp_gait.gaits.biped.samples import Samples
from nlp_gait.robots import Robot
from nlp_gait.robots.robot import Motor
from nlp_gait.symbolic.nonsmooth import Nonsmooth

ANKLE = "ankle"
FEATURES = ("limits", ANKLE, "free-braking", "regeneration", "heat", "rotor")

SUPPLY = Parameter(
    name="supply_share",
    unit="1",
    default=1.0,
    description="voltage of the motors as a share of the data sheet's; speed at no load and torque at stall follow it",
    minimum=0.05,
    maximum=2.0,
)


def parse_features(text: str) -> tuple[str, ...]:
    """Return the features that an option's text lists, separated by commas."""
    return tuple(feature.strip() for feature in text.split(",") if feature.strip())


@dataclass(frozen=True, kw_only=True, eq=False)
class Motors:
    """Features of real motors that a problem takes into account; raises UnknownNameError.

    Raises InputError for features that exclude each other, or a joint of the robot without data of its motor, or of its rotor.
    """

    features: tuple[str, ...]  # see above
    robot: Robot  # without the inertia of the rotors
    joints: tuple[str, ...]  # that the motors turn
    shared: tuple[str, ...] = ()  # two joints that one motor turns
    coupling: Limit | None = None  # limit of one ankle joint by the other, if it is known

    def __post_init__(self) -> None:
        """Check the features."""
        features = [name for name in FEATURES if name != ANKLE or self.coupling is not None]
        for name in self.features:
            if name not in features:
                raise unknown("feature in motors", name, features)
        if {"free-braking", "regeneration"} <= set(self.features):
            raise InputError("motors: braking either draws nothing (free-braking) or gives power back (regeneration)")
        if self.features:
            self._ratings, self.model  # noqa: B018  refuse a robot without data now

    @cached_property
    def model(self) -> Robot:
        """The robot of the dynamics, with the inertia of its rotors if that is a feature."""
        if "rotor" not in self.features:
            return self.robot
        joints = dict(self.robot.joints)
        for joint, rating in zip(self.joints, self._ratings, strict=True):
            if rating.reflected_inertia_kgm2 is None:
                raise InputError(
                    f"robot {self.robot.name!r}: the motor of joint {joint!r} has no rotor_inertia_gcm2, which motors=rotor needs"
                )
            share = rating.reflected_inertia_kgm2 / (len(self.shared) if joint in self.shared else 1)
            joints[joint] = replace(joints[joint], armature_kgm2=share)
        return replace(self.robot, joints=joints)

    @property
    def limits(self) -> tuple[Limit, ...]:
        """Limits that the features add."""
        limits = (MotorLimits(self, self._ratings),) if "limits" in self.features else ()
        return (*limits, *((self.coupling,) if self.coupling is not None and ANKLE in self.features else ()))

    @property
    def power(self) -> PowerModel | None:
        """Mean power of the motors; None for the paper's model."""
        return self._mean_power if {"free-braking", "regeneration", "heat"} & set(self.features) else None

    def _mean_power(self, point: Point, samples: Samples, ops: Nonsmooth) -> MX:
        driven = ca.vec(samples.power)
        if "regeneration" in self.features:
            mechanical = driven
        elif "free-braking" in self.features:
            mechanical = (driven + ops.abs(driven)) / 2
        else:
            mechanical = ops.abs(driven)
        if "heat" in self.features:
            constants = DM([rating.heat_W_per_Nm2 for rating in self._ratings])
            heat = constants.T @ self.sum_by_motor(samples.torque) ** 2
        else:
            heat = point[HEAT_LOSS.name] * ca.sum1(samples.torque**2)
        return samples.average(ca.sum1(ca.reshape(mechanical, *samples.power.shape)) + heat)

    @cached_property
    def _ratings(self) -> tuple[Motor, ...]:
        ratings = []
        for joint in self.joints:
            motor = self.robot.joint(joint).motor
            if motor is None:
                raise InputError(
                    f"robot {self.robot.name!r}: joint {joint!r} has no motor data, which the option motors needs"
                )
            ratings.append(motor)
        return tuple(ratings)

    def sum_by_motor(self, torque: MX) -> MX:
        """Return torques (J, n) with the sum of the joints that share a motor in the first one's row."""
        if not self.shared:
            return torque
        first, second = (self.joints.index(joint) for joint in self.shared)
        sharing = np.eye(len(self.joints))
        sharing[first, second], sharing[second, second] = 1.0, 0.0
        return ca.sparsify(DM(sharing)) @ torque


class MotorLimits(Limit):
    """Speed, torque against speed |tau| <= stall (1 - |qd| / no-load), and root mean square torque of every motor.

    As two lines of each sign, tau +- qd stall / no-load within +- stall, also in braking, where a motor could do more. Each joint
    has its rating.
    """

    parameters = (SUPPLY,)
    reads = (Samples.qd,)

    def __init__(self, motors: Motors, ratings: Sequence[Motor]) -> None:
        self._motors, self._ratings = motors, ratings

    def add(self, point: Point, samples: Samples, ops: Nonsmooth) -> RowsAndIndexes:
        torque, qd, moving, supply = samples.torque, samples.qd, samples.moving, point[SUPPLY.name]
        n = torque.shape[1]
        joints = self._motors.joints
        motors = [k for k, joint in enumerate(joints) if joint not in self._motors.shared[1:]]
        names = tuple(joints[k] for k in motors)
        loads = self._motors.sum_by_motor(torque)[motors, :]
        ratings = [self._ratings[k] for k in motors]
        stall = DM([rating.stall_torque_Nm for rating in ratings])
        slope = DM([rating.stall_torque_Nm / rating.no_load_rad_s for rating in ratings])
        place = DM(len(motors), len(moving))
        for column, joint in enumerate(moving):
            place[names.index(joint), column] = 1.0
        drop = ca.repmat(slope, 1, n) * (ca.sparsify(place) @ qd)
        speed = DM([self._motors.robot.joint(joint).velocity_limit_rad_s for joint in moving])
        fastest, strongest = MX(ca.repmat(speed, n, 1)), supply * ca.repmat(stall, n, 1)
        too_fast = make_rows_at_samples("joint_speed", "rad/s", qd, moving, -fastest, fastest)
        too_weak = [
            make_rows_at_samples(f"torque_{kind}", "Nm", turned, names, -strongest, strongest)
            for kind, turned in (("forwards", loads + drop), ("backwards", loads - drop))
        ]
        continuous = MX(DM([rating.continuous_torque_Nm for rating in ratings]))
        rms = ca.sqrt(samples.average(loads**2))
        too_hot = make_rows("continuous_torque", "Nm", rms, None, continuous, names, "root-mean-square")
        return (too_fast, *too_weak, too_hot), {}
