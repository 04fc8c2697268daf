"""One instant of NAO's single or double support, for narrow bounds: torques, rates and ZMP of a motion in unit time.

At a given phase the upper body's pose consists of numbers, so that its wrench is linear in the hip's acceleration; legs are
summed link by link in the world. The torques equal those of the recursion up to rounding.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import casadi as ca
from casadi import DM, SX

from nlp_gait.gaits.biped.double_support import Point2, support_box
from nlp_gait.gaits.biped.load_sharing import Division, torso_shares
from nlp_gait.gaits.biped.single_support import swing_foot
from nlp_gait.gaits.nao.body import GRAVITY, arm_joints
from nlp_gait.gaits.nao.joints import ARM_JOINTS, LEG_JOINTS
from nlp_gait.gaits.nao.least_power.world_frame import (
    SplitWrench,
    chain_frames,
    leg_frames,
    leg_rates,
    link_wrench,
    upright,
    world_frame_dynamics,
)
from nlp_gait.gaits.nao.legs import leg_geometry
from nlp_gait.robots import Robot
from nlp_gait.robots.tree import tree_from
from nlp_gait.symbolic.balance import ground_load
from nlp_gait.symbolic.dynamics import Wrench
from nlp_gait.symbolic.trajectories import Motion, add_motions, cubic_of_sums, resting_point, stack

# First of each pair of velocities at both ends: z, x, y.
PAIRS = (1, 3, 5)
ONE, FORWARD = SX(1), DM([1, 0, 0])


@dataclass(kw_only=True)
class PowerInstant:
    """One sample.

    Attributes:
        rate_squared: 1 / T^2 for the time T.
        torques: by joint, in the time T.
        rates: of the joints that turn, in unit time.
        zmp: (2,) [m].
        reaches: squared distances of hip and ankle by side [m^2].
        sideways: of the ankle from the hip across and down, by side [m]: their quotient is the tangent of the leg's roll.
    """

    rate_squared: SX
    torques: dict[str, SX] = field(default_factory=dict)
    rates: dict[str, SX] = field(default_factory=dict)
    zmp: SX = field(default_factory=SX)
    reaches: dict[str, SX] = field(default_factory=dict)
    sideways: dict[str, tuple[SX, SX]] = field(default_factory=dict)

    def add_torque(self, name: str, axis: SX | DM, carried: SplitWrench, direction: int) -> None:
        """Add the torque of a joint from the wrench that it carries, about a point of its axis."""
        gravity, inertia = (ca.dot(axis, part.moment) for part in carried)
        self.torques[name] = direction * (gravity + self.rate_squared * inertia)


class PowerPhase(NamedTuple):
    """A phase.

    Attributes:
        instant: makes the sample of z at a phase.
        sides: of the rectangle that must contain the ZMP, in x and in y [m].
        margins: balance margins from the ZMP, by axis [m].
    """

    instant: Callable[[SX, float], PowerInstant]
    sides: tuple[tuple[float, float], tuple[float, float]]
    margins: Mapping[str, Callable[[SX], SX]]


def _nearer_margin(low: float, high: float) -> Callable[[SX], SX]:
    """Return the distance to the nearer of two sides."""
    return lambda at: (high - low) / 2 - ca.fabs(at - (low + high) / 2)


def _ankle_side_margin(ankle: float, low: float, high: float) -> Callable[[SX], SX]:
    """Return the distance to the side beyond the ankle, see ``NaoBody.sole_margins``."""
    return lambda at: (high - at) - ca.if_else(at - ankle < 0, (high - at) - (at - low), 0)


def _hip(z: SX, along: Point2, across: Point2, phase: float) -> Motion:
    s = SX(phase)
    up = cubic_of_sums(z[0], z[0], z[1], z[2], s)
    return stack(cubic_of_sums(*along, z[3], z[4], s), cubic_of_sums(*across, z[5], z[6], s), up)


def double_support_instants(
    robot: Robot,
    soles: Mapping[str, Point2],
    hip_ends: tuple[Point2, Point2],
    arm_swing: Mapping[str, Point2],
    rule: Division,
    cosine: float,
) -> PowerPhase:
    """Return double support: each leg stands on its own foot.

    Args:
        robot: of the phase.
        soles: where the ankles stand, by side [m].
        hip_ends: of the torso's origin in x and in y [m].
        arm_swing: arm joints that move, from where to where [rad].
        rule: how the torso's mass is divided.
        cosine: largest one of the knee's angle, see ``leg_frames``.
    """
    ankles = {side: SX(DM([*xy, leg_geometry(robot, side).ankle_height_m])) for side, xy in soles.items()}
    along, across = hip_ends
    feet_y = (leg_geometry(robot, "L").hip_m[1], leg_geometry(robot, "R").hip_m[1])
    weight = robot.mass_kg * GRAVITY

    def instant(z: SX, phase: float) -> PowerInstant:
        hip = _hip(z, along, across, phase)
        arms = arm_joints(arm_swing, ONE, SX(phase))
        found = PowerInstant(rate_squared=1 / z[-1] ** 2)
        shares = torso_shares(hip.position[1], rule, feet_y)
        torso = link_wrench(robot.links[robot.root], upright(hip).axes, hip.acceleration, GRAVITY)
        moments, loads = [], []
        for side, foot in (("L", robot.feet["left"]), ("R", robot.feet["right"])):
            upper = _add_arm(robot, side, arms, hip.acceleration, found).plus(torso.times(shares[side]))
            ankle = Motion(ankles[side], SX(3, 1), SX(3, 1))
            ground = _add_stance_leg(robot, side, hip, ankle, upper, cosine, found).in_time(found.rate_squared)
            load = ground_load(ground, weight)
            moments.append(ankles[side][:2] * load + _tilt(ground, foot.ankle_height_m))
            loads.append(load)
        found.zmp = sum(moments, SX(2, 1)) / sum(loads, SX(0))
        return found

    box = support_box(robot, soles)
    sides = ((box.back, box.front), (box.right, box.left))
    return PowerPhase(instant, sides, {axis: _nearer_margin(*pair) for axis, pair in zip("xy", sides, strict=True)})


def single_support_instants(
    robot: Robot,
    support_xy: Point2,
    swing_x: Point2,
    swing_y: float,
    hip_x: Point2,
    hip_y: Point2,
    arm_swing: Mapping[str, Point2],
    cosine: float,
) -> PowerPhase:
    """Return single support: the left leg carries everything.

    Args:
        robot: of the phase.
        support_xy: where the left ankle stands [m].
        swing_x: where the right ankle begins and ends [m].
        swing_y: of its path [m].
        hip_x: where the torso's origin begins and ends [m].
        hip_y: likewise.
        arm_swing: arm joints that move, from where to where [rad].
        cosine: largest one of the knee's angle, see ``leg_frames``.
    """
    foot, weight = robot.feet["left"], robot.mass_kg * GRAVITY
    support = SX(DM([*support_xy, foot.ankle_height_m]))

    def instant(z: SX, phase: float) -> PowerInstant:
        hip = _hip(z, hip_x, hip_y, phase)
        arms = arm_joints(arm_swing, ONE, SX(phase))
        found = PowerInstant(rate_squared=1 / z[-1] ** 2)
        begin, end = (SX(x) for x in swing_x)
        path = swing_foot(begin, end, swing_y, robot.feet["right"].ankle_height_m, z[-2], ONE, SX(phase))
        upper = link_wrench(robot.links[robot.root], upright(hip).axes, hip.acceleration, GRAVITY)
        for side in "LR":
            upper = upper.plus(_add_arm(robot, side, arms, hip.acceleration, found))
        upper = upper.plus(_add_swing_leg(robot, "R", hip, path, cosine, found))
        ankle = Motion(support, SX(3, 1), SX(3, 1))
        ground = _add_stance_leg(robot, "L", hip, ankle, upper, cosine, found).in_time(found.rate_squared)
        found.zmp = support[:2] + _tilt(ground, foot.ankle_height_m) / ground_load(ground, weight)
        return found

    x, y = support_xy
    sides = ((x - foot.back_m, x + foot.front_m), (y - foot.right_m, y + foot.left_m))
    return PowerPhase(instant, sides, {"x": _ankle_side_margin(x, *sides[0]), "y": _nearer_margin(*sides[1])})


def _tilt(ground: Wrench, height: float) -> SX:
    """Return (2,) the ZMP's offset from a foot times its load [Nm], see ``balance.zmp_of_wrench``."""
    (fx, fy, _), (nx, ny, _) = ca.vertsplit(ground.force), ca.vertsplit(ground.moment)
    return ca.vertcat(-(ny + height * fx), nx - height * fy)


def _add_arm(robot: Robot, side: str, arms: Mapping[str, Motion], acceleration: SX, found: PowerInstant) -> SplitWrench:
    """Add the torques of an arm; returns its wrench about the torso's origin.

    At one phase the arm's pose consists of numbers, so that everything is linear in the torso's acceleration.
    """
    joints, a = [f"{side}{name}" for name in ARM_JOINTS], SX.sym("a", 3)
    base = Motion(SX(3, 1), SX(3, 1), a)
    frames = chain_frames([robot.joint(name) for name in joints], arms, base) | {robot.root: upright(base)}
    tree = tree_from(robot, robot.root, joints)
    without_torso = {robot.root: SX(0)}
    moved, all_moved = world_frame_dynamics(tree, frames, {}, 0.0, without_torso)
    both, all_both = world_frame_dynamics(tree, frames, {}, GRAVITY, without_torso)
    parts = ([moved[name] for name in joints], all_moved), ([both[name] for name in joints], all_both)
    columns = ca.horzcat(*(ca.vertcat(*torques, *wrench) for torques, wrench in parts))
    still, moving = (_evaluate_linear(part, a, acceleration) for part in (columns[:, 1] - columns[:, 0], columns[:, 0]))
    for i, name in enumerate(joints):
        found.torques[name] = still[i] + found.rate_squared * moving[i]
        if not arms[name].velocity.is_zero():
            found.rates[name] = arms[name].velocity
    n = len(joints)
    return SplitWrench(*(Wrench(part[n : n + 3], part[n + 3 :]) for part in (still, moving)))


def _evaluate_linear(expression: SX, symbol: SX, value: SX) -> SX:
    """Return a linear expression at a value of its symbol, with numbers as coefficients."""
    slopes = ca.jacobian(expression, symbol)
    at_zero = ca.substitute(expression, symbol, SX.zeros(*symbol.shape))
    constant, slope = ca.Function("coefficients", [], [at_zero, slopes]).call([])
    return SX(DM(constant)) + SX(ca.sparsify(DM(slope))) @ value


class LegParts(NamedTuple):
    """Wrenches of a leg's links, and positions of its joints.

    Attributes:
        links: of the pelvis about the hip's yaw-pitch joint; of hip link and thigh about the hip; of tibia, the link above the
            sole and sole about the ankle. No wrench needs the knee, whose bounds are widest where the leg is almost straight.
        joints: (3,) hip, knee and ankle [m].
        yaw: (3,) the hip's yaw-pitch joint [m].
        across: (3,) axis of the pitching joints.
    """

    links: tuple[SplitWrench, ...]
    joints: tuple[SX, SX, SX]
    yaw: SX
    across: SX


def _split_leg(robot: Robot, side: str, hip: Motion, ankle: Motion, cosine: float, found: PowerInstant) -> LegParts:
    geometry, yaw = leg_geometry(robot, side), robot.joint(f"{side}HipYawPitch")
    at_hip = add_motions(hip, resting_point(geometry.hip_m))
    frames = leg_frames(at_hip, ankle, geometry.thigh_m, geometry.tibia_m, cosine)
    apart = Motion(*(a - h for a, h in zip(ankle, at_hip, strict=True)))
    rates = leg_rates(apart, geometry.thigh_m, geometry.tibia_m, cosine)
    found.rates |= {f"{side}{name}": rate for name, rate in zip(LEG_JOINTS, rates.joints, strict=True)}
    found.reaches[side] = rates.distance_squared
    found.sideways[side] = apart.position[1], -apart.position[2]
    sole = next(foot.link for foot in robot.feet.values() if foot.link == robot.joint(f"{side}AnkleRoll").child)
    names = (yaw.child, *(robot.joint(f"{side}{name}").child for name in LEG_JOINTS[:4]), sole)
    turned = (upright(hip), *frames, upright(ankle))
    wrenches = [
        link_wrench(robot.links[name], frame.axes, frame.origin.acceleration, GRAVITY)
        for name, frame in zip(names, turned, strict=True)
    ]
    tibia = robot.links[names[3]]
    x, y, z = tibia.com_m
    from_ankle = replace(tibia, com_m=(x, y, z + geometry.tibia_m))
    wrenches[3] = link_wrench(from_ankle, frames.tibia.axes, ankle.acceleration, GRAVITY)
    joints = (at_hip.position, frames.tibia.origin.position, ankle.position)
    return LegParts(tuple(wrenches), joints, hip.position + DM(yaw.origin_m), frames.hip.axes.position[:, 1])


def _add_stance_leg(
    robot: Robot, side: str, hip: Motion, ankle: Motion, upper: SplitWrench, cosine: float, found: PowerInstant
) -> SplitWrench:
    """Add the torques of a leg that carries ``upper`` (about the torso's origin); returns the ground's wrench about its ankle."""
    leg = _split_leg(robot, side, hip, ankle, cosine, found)
    at_hip, at_knee, at_ankle = leg.joints
    pelvis, hip_link, thigh, tibia, above, sole = leg.links
    carried = upper.about(hip.position - leg.yaw)
    found.add_torque(f"{side}HipYawPitch", DM(robot.joint(f"{side}HipYawPitch").axis), carried, -1)
    carried = carried.plus(pelvis).about(leg.yaw - at_hip)
    found.add_torque(f"{side}HipRoll", FORWARD, carried, -1)
    carried = carried.plus(hip_link)
    found.add_torque(f"{side}HipPitch", leg.across, carried, -1)
    carried = carried.plus(thigh)
    found.add_torque(f"{side}KneePitch", leg.across, carried.about(at_hip - at_knee), -1)
    carried = carried.about(at_hip - at_ankle).plus(tibia)
    found.add_torque(f"{side}AnklePitch", leg.across, carried, -1)
    carried = carried.plus(above)
    found.add_torque(f"{side}AnkleRoll", FORWARD, carried, -1)
    return carried.plus(sole)


def _add_swing_leg(
    robot: Robot, side: str, hip: Motion, ankle: Motion, cosine: float, found: PowerInstant
) -> SplitWrench:
    """Add the torques of a hanging leg; returns its wrench about the torso's origin."""
    leg = _split_leg(robot, side, hip, ankle, cosine, found)
    at_hip, at_knee, at_ankle = leg.joints
    pelvis, hip_link, thigh, tibia, above, carried = leg.links
    found.add_torque(f"{side}AnkleRoll", FORWARD, carried, 1)
    carried = carried.plus(above)
    found.add_torque(f"{side}AnklePitch", leg.across, carried, 1)
    carried = carried.plus(tibia)
    found.add_torque(f"{side}KneePitch", leg.across, carried.about(at_ankle - at_knee), 1)
    carried = carried.about(at_ankle - at_hip).plus(thigh)
    found.add_torque(f"{side}HipPitch", leg.across, carried, 1)
    carried = carried.plus(hip_link)
    found.add_torque(f"{side}HipRoll", FORWARD, carried, 1)
    carried = carried.about(at_hip - leg.yaw).plus(pelvis)
    found.add_torque(f"{side}HipYawPitch", DM(robot.joint(f"{side}HipYawPitch").axis), carried, 1)
    return carried.about(leg.yaw - hip.position)
