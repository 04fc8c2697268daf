"""Robots as bipeds: two legs of six turning joints, all other links one body in a posture; scales and swings against NAO's."""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from nlp_gait.errors import InputError
from nlp_gait.robots.inference import SIDES
from nlp_gait.robots.leg import LEG_JOINT_COUNT, Leg, make_leg
from nlp_gait.robots.robot import Joint, Robot
from nlp_gait.robots.tree import pose_robot, weld

# NAO V5: a leg from hip to ankle [m], the mass [kg], and the heat constant K of the paper [W/(Nm)^2].
NAO_LEG_M, NAO_MASS_KG, NAO_HEAT_W_PER_NM2 = 0.2029, 5.30535, 0.025
ALIKE_M = 2e-3  # both legs are mirror images to this [m]


@dataclass(frozen=True, kw_only=True, eq=False)
class Biped:
    """A robot in the form that the gaits of any humanoid need."""

    full: Robot  # with all joints; those outside the legs count from the posture
    model: Robot  # with the joints of the legs only, all others held in the posture
    legs: Mapping[str, Leg]  # ``"left"`` and ``"right"``
    posture_rad: Mapping[str, float]  # angles of the held joints

    @property
    def joints(self) -> tuple[str, ...]:
        """Joints of both legs, the left one's first."""
        return tuple(name for side in SIDES for name in self.legs[side].joints)

    @property
    def leg_length_m(self) -> float:
        """Greatest distance of hip and ankle."""
        return self.legs["left"].length_m

    @property
    def length_scale(self) -> float:
        """Lambda: leg length over NAO's."""
        return self.leg_length_m / NAO_LEG_M

    @property
    def mass_scale(self) -> float:
        """Mu: mass over NAO's."""
        return self.full.mass_kg / NAO_MASS_KG

    @property
    def time_scale(self) -> float:
        """Scale of times and of velocities, for equal Froude numbers."""
        return math.sqrt(self.length_scale)

    @property
    def torque_scale(self) -> float:
        """Scale of torques."""
        return self.length_scale * self.mass_scale

    @property
    def heat_W_per_Nm2(self) -> float:
        """K of the robot's file, or else NAO's, scaled by power over squared torque."""
        if self.full.heat_loss_W_per_Nm2 is not None:
            return self.full.heat_loss_W_per_Nm2
        power_scale = self.mass_scale * self.time_scale  # weight times velocity
        return NAO_HEAT_W_PER_NM2 * power_scale / self.torque_scale**2

    @property
    def heat_source(self) -> str:
        """Origin of K, in words."""
        if self.full.heat_loss_W_per_Nm2 is not None:
            return "from the robot's file"
        return "NAO's, scaled by power over squared torque, because its file has none"


def make_biped_model(robot: Robot) -> Biped:
    """Convert a robot with mirrored legs of six turning joints, its other joints in a posture, to a biped; raises InputError."""
    feet = [robot.feet[side].link for side in SIDES]
    paths = [robot.path_to_root(foot) for foot in feet]
    shared = {joint.name for joint in paths[0]} & {joint.name for joint in paths[1]}
    single = [[joint for joint in path if joint.name not in shared] for path in paths]
    for side, path in zip(SIDES, single, strict=True):
        if len(path) != LEG_JOINT_COUNT:
            raise InputError(
                f"robot {robot.name!r}: the {side} leg must have {LEG_JOINT_COUNT} turning joints from where both legs meet to "
                f"the foot, got {len(path)}: {', '.join(joint.name for joint in reversed(path)) or 'none'}"
            )
    moving = {joint.name for path in single for joint in path}
    held = {
        name: _choose_held_angle(joint, robot.posture_rad) for name, joint in robot.joints.items() if name not in moving
    }
    for name in robot.posture_rad:
        if name not in held:
            raise InputError(
                f"robot {robot.name!r}: posture_rad names {name!r}, which is "
                f"{'a joint of a leg' if name in moving else 'not a joint'}"
            )
    turned = [name for name in shared if held[name]]
    if turned:
        raise InputError(f"robot {robot.name!r}: posture_rad must leave joint {turned[0]!r} above both legs at zero")
    full = pose_robot(robot, held)
    model = weld(full, list(held))
    legs: dict[str, Leg] = {side: make_leg(model, side) for side in SIDES}
    _check_alike(robot.name, legs)
    return Biped(full=full, model=model, legs=legs, posture_rad=held)


def _choose_held_angle(joint: Joint, posture: Mapping[str, float]) -> float:
    low, high = joint.limits_rad
    angle = posture.get(joint.name)
    if angle is None:
        return min(max(0.0, low), high)
    if not low <= angle <= high:
        raise InputError(f"posture_rad of {joint.name!r} must be within [{low:g}, {high:g}] rad, got {angle:g}")
    return angle


def _check_alike(name: str, legs: Mapping[str, Leg]) -> None:
    left, right = (legs[side] for side in SIDES)
    image = np.array([1.0, -1.0, 1.0])
    for mine, opposite, joint in zip(left.points, right.points, left.joints, strict=True):
        if math.dist(image * mine, opposite) > ALIKE_M:
            raise InputError(
                f"robot {name!r}: legs must be mirror images to {1e3 * ALIKE_M:g} mm, joint {joint!r} is at {mine.tolist()}, its "
                f"image at {opposite.tolist()}"
            )


GRAVITY = 9.81  # [m/s^2]
STEP_M = 0.06  # NAO's, from foot to foot
NAO_SWING_S = 0.4  # least time of NAO's swings in its papers
LIKE_NAO = 0.1  # legs whose length differs by at most this share from NAO's have the papers' bounds


def compare_swing(biped: Biped) -> float:
    """Return how much faster than NAO in its papers a robot can swing, 1 for NAO's size or a file without torques."""
    largest = biped.full.mass_kg * GRAVITY * biped.leg_length_m
    if abs(biped.length_scale - 1.0) <= LIKE_NAO or _find_hip(biped)[1] > largest:
        return 1.0
    return max(float(f"{NAO_SWING_S * biped.time_scale / find_least_swing_time(biped):.2g}"), 1.0)


def find_least_swing_time(biped: Biped) -> float:
    """Return the least time in which the hip's speed and torque swing a leg, a rod, by a cubic over two usual steps [s]."""
    speed, torque = _find_hip(biped)
    angle = 2 * STEP_M / NAO_LEG_M
    mass_kg = sum(biped.model.links[biped.model.joint(name).child].mass_kg for name in biped.legs["left"].joints)
    inertia = mass_kg * biped.leg_length_m**2 / 3
    return max(1.5 * angle / speed, math.sqrt(6 * angle * inertia / torque))


def _find_hip(biped: Biped) -> tuple[float, float]:
    """Speed and torque of the hip joint that swings the leg forward [rad/s, Nm]."""
    leg = biped.legs["left"]
    name, _ = max(zip(leg.joints[:3], leg.axes[:3].tolist(), strict=True), key=lambda pair: abs(pair[1][1]))
    joint = biped.model.joint(name)
    return joint.velocity_limit_rad_s, joint.torque_limit_Nm
