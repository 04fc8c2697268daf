"""Robots as bipeds: two legs of six turning joints, all other links one body in a posture; scales and swings against NAO's."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from nlp_gait.errors import InputError
from nlp_gait.robots.inference import EXTENTS, SIDES
from nlp_gait.robots.leg import LEG_JOINT_COUNT, Leg, make_leg
from nlp_gait.robots.robot import Joint, Robot
from nlp_gait.robots.tree import (
    MIRROR,
    MIRROR_COSINE,
    MIRROR_M,
    Mass,
    combine_masses,
    compare_axes,
    compute_point_inertia,
    mirror_sign,
    pose_robot,
    weld,
)

# NAO V5: a leg from hip to ankle [m], the mass [kg], and the heat constant K of the paper [W/(Nm)^2].
NAO_LEG_M, NAO_MASS_KG, NAO_HEAT_W_PER_NM2 = 0.2029, 5.30535, 0.025
GRAVITY = 9.81  # [m/s^2]
NOMINAL_TORQUE = 0.5  # of drives of joints without a limit, as a share of weight times leg length
ALIKE = 0.02  # share by which quantities of both sides may differ


@dataclass(frozen=True, kw_only=True, eq=False)
class Biped:
    """A robot in the form that the gaits of any humanoid need."""

    full: Robot  # with all joints; those outside the legs count from the posture
    model: Robot  # with the joints of the legs only, all others held in the posture
    legs: Mapping[str, Leg]  # ``"left"`` and ``"right"``
    posture_rad: Mapping[str, float]  # angles of the held joints
    # Differences of both sides, see ``find_differences``; none if a step and its mirror image are alike.
    differences: tuple[str, ...]

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
    for joint in (*single[0], *single[1]):
        if fault := robot.unusable.get(joint.child):
            raise InputError(f"robot {robot.name!r}: joint {joint.name!r} of a leg {fault}")
    pairs = [(left.name, right.name) for left, right in zip(*single, strict=True)]
    notes = list(robot.notes)
    model = _tighten(model, pairs, notes)
    legs: dict[str, Leg] = {side: make_leg(model, side) for side in SIDES}
    nominal = NOMINAL_TORQUE * robot.mass_kg * GRAVITY * legs["left"].length_m
    joints = {name: replace(joint, nominal_torque_Nm=nominal) for name, joint in model.joints.items()}
    return Biped(
        full=replace(full, posture_rad=held, notes=tuple(notes)),
        model=replace(model, joints=joints),
        legs=legs,
        posture_rad=held,
        differences=find_differences(model),
    )


def _choose_held_angle(joint: Joint, posture: Mapping[str, float]) -> float:
    low, high = joint.limits_rad
    angle = posture.get(joint.name)
    if angle is None:
        return min(max(0.0, low), high)
    if not low <= angle <= high:
        raise InputError(f"posture_rad of {joint.name!r} must be within [{low:g}, {high:g}] rad, got {angle:g}")
    return angle


def _tighten(robot: Robot, pairs: Sequence[tuple[str, str]], notes: list[str]) -> Robot:
    """Give both joints of each pair the tighter limits of the two: a step and its mirror image are planned as one."""
    joints = dict(robot.joints)
    for pair in pairs:
        one, opposite = (joints[name] for name in pair)
        sign = mirror_sign(robot, *pair)
        low, high = opposite.planning_limits_rad[:: int(sign)]
        limits = [
            ("lower limits", "rad", one.planning_limits_rad[0], sign * low, max),
            ("upper limits", "rad", one.planning_limits_rad[1], sign * high, min),
            ("limits of torque", "Nm", one.torque_limit_Nm, opposite.torque_limit_Nm, min),
            ("limits of speed", "rad/s", one.velocity_limit_rad_s, opposite.velocity_limit_rad_s, min),
        ]
        for words, unit, mine, other, pick in limits:
            if abs(mine - other) > ALIKE * max(abs(mine), abs(other)):
                notes.append(
                    f"{pair[0]} and {pair[1]} have different {words}, {mine:.4g} and {other:.4g} {unit}: both have "
                    f"{pick(mine, other):.4g} {unit}"
                )
        least, most, torque, speed = (pick(mine, other) for _, _, mine, other, pick in limits)
        for joint, (lower, upper) in ((one, (least, most)), (opposite, sorted((sign * least, sign * most)))):
            if not least < most:
                raise InputError(
                    f"robot {robot.name!r}: joints {pair[0]!r} and {pair[1]!r}, mirrored, have no common range: "
                    f"{one.planning_limits_rad} and {opposite.planning_limits_rad} rad"
                )
            joints[joint.name] = replace(
                joint,
                planning_limits_rad=(lower, upper),
                torque_limit_Nm=torque,
                velocity_limit_rad_s=speed,
            )
    return replace(robot, joints=joints)


def find_differences(robot: Robot) -> tuple[str, ...]:
    """Return what makes a mirrored step another one: axes, masses, centres, tensors, rotors and soles that differ by over 2 %.

    The links below a joint count together, with tensors about a point of its axis and centres in units of their radius of
    gyration about it; heights and edges of soles count in units of their length.
    """
    differences = []
    left, right = (robot.feet[side] for side in SIDES)
    edges = ((name, {"left_m": "right_m", "right_m": "left_m"}.get(name, name)) for name in EXTENTS)
    apart = max(abs(getattr(left, one) - getattr(right, other)) for one, other in edges)
    if apart > ALIKE * (left.front_m + left.back_m):
        differences.append(f"edges of the soles by up to {1e3 * apart:.1f} mm")
    legs = [make_leg(robot, side) for side in SIDES]
    mirror = np.outer(MIRROR, MIRROR)
    for k, names in enumerate(zip(*(leg.joints for leg in legs), strict=True)):
        points, axes = [leg.points[k] for leg in legs], [leg.axes[k] for leg in legs]
        where = f"{names[0]} and {names[1]}"
        gap, angle = compare_axes(MIRROR * points[0], MIRROR * axes[0], points[1], axes[1])
        if gap > MIRROR_M or math.cos(angle) < MIRROR_COSINE:
            differences.append(f"axes of {where} by {1e3 * gap:.1f} mm and {math.degrees(angle):.1f} degrees")
        one, opposite = (
            combine_masses(
                [
                    Mass.of_link(robot.links[robot.joint(joint).child]).move(place)
                    for joint, place in zip(leg.joints[k:], leg.points[k:], strict=True)
                ]
            )
            for leg in legs
        )
        origins = points[0], MIRROR * points[0]
        tensors = [
            body.tensor_kgm2 + compute_point_inertia(body.mass_kg, body.com_m - origin)
            for body, origin in zip((one, opposite), origins, strict=True)
        ]
        radius = math.sqrt(float(np.trace(tensors[0])) / (2 * one.mass_kg))
        rotors = [robot.joint(name).armature_kgm2 for name in names]
        for what, difference in (
            ("masses below", abs(one.mass_kg - opposite.mass_kg) / one.mass_kg),
            ("centres of mass below", float(np.linalg.norm(MIRROR * one.com_m - opposite.com_m)) / radius),
            ("inertias below", float(np.linalg.norm(mirror * tensors[0] - tensors[1]) / np.linalg.norm(tensors[0]))),
            ("rotors at", abs(rotors[0] - rotors[1]) / (max(rotors) or 1.0)),
        ):
            if difference > ALIKE:
                differences.append(f"{what} {where} by {difference:.1%}")
    return tuple(differences)


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
