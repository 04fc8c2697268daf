"""One instant of NAO's single or double support, for narrow bounds: torques, rates and ZMP of a motion in unit time.

At a given phase the upper body's pose consists of numbers, so that its wrench is linear in the hip's acceleration; legs are
summed link by link in the world. The torques equal those of the recursion up to rounding.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import NamedTuple

import casadi as ca
from casadi import DM, SX

from nlp_gait.gaits.biped.loads import Division, share_torso
from nlp_gait.gaits.biped.support_phases import Point2, Stance, make_support_box, swing_foot
from nlp_gait.gaits.nao.body import ARM_JOINTS, GRAVITY, LEG_JOINTS, measure_leg, move_arms
from nlp_gait.proofs.nao import world_frame
from nlp_gait.robots import Robot
from nlp_gait.symbolic.dynamics import Wrench, ground_load
from nlp_gait.symbolic.trajectories import Motion, add_motions, cubic_of_sums, resting_point, stack

PAIRS = (1, 3, 5)  # first of each pair of velocities at both ends: z, x, y
ONE, FORWARD = SX(1), DM([1, 0, 0])


class PowerPhase(NamedTuple):
    """A phase."""

    instant: Callable[[SX, float], "PowerInstant"]  # makes the sample of z at a phase
    # Of the rectangle that must contain the ZMP, in x and in y [m]
    sides: tuple[tuple[float, float], tuple[float, float]]
    margins: Mapping[str, Callable[[SX], SX]]  # balance margins from the ZMP, by axis [m]


class LegJoint(NamedTuple):
    """A joint of a leg: its axis and its place (3,) in the world [m]."""

    name: str
    axis: SX | DM
    place: SX


@dataclass(kw_only=True)
class PowerInstant:
    """One sample."""

    robot: Robot  # of the phase
    rate_squared: SX  # 1 / T^2 for the time T
    cosine: float  # largest one of the knee's angle, see ``make_leg_frames``
    torques: dict[str, SX] = field(default_factory=dict)  # by joint, in the time T
    rates: dict[str, SX] = field(default_factory=dict)  # of the joints that turn, in unit time
    zmp: SX = field(default_factory=SX)  # (2,) [m]
    reaches: dict[str, SX] = field(default_factory=dict)  # squared distances of hip and ankle by side [m^2]
    # Of the ankle from the hip across and down, by side [m]: their quotient is the tangent of the leg's roll
    sideways: dict[str, tuple[SX, SX]] = field(default_factory=dict)

    def link_wrench(self, name: str, frame: world_frame.Frame) -> SX:
        """Return the wrench (6, 2) of a link about the origin of its frame."""
        return world_frame.link_wrench(self.robot.links[name], frame.axes, frame.origin.acceleration, GRAVITY)

    def add_arm(self, side: str, arms: Mapping[str, Motion], acceleration: SX) -> SX:
        """Add the torques of an arm, whose pose at one phase is numbers; returns its wrench (6, 2) about the torso's origin."""
        joints, a = [self.robot.joint(f"{side}{name}") for name in ARM_JOINTS], SX.sym("a", 3)
        frames = world_frame.make_chain_frames(joints, arms, Motion(SX(3, 1), SX(3, 1), a))
        carried, point, rows = SX(6, 2), SX(3, 1), list[SX]()
        for joint in reversed(joints):
            frame = frames[joint.child]
            carried = world_frame.move_wrench(carried, point - frame.origin.position) + self.link_wrench(
                joint.child, frame
            )
            point = frame.origin.position
            rows.append((frame.axes.position @ DM(joint.axis)).T @ carried[3:, :])
        values = _evaluate_linear(ca.vertcat(*rows, world_frame.move_wrench(carried, point)), a, acceleration)
        for i, joint in enumerate(reversed(joints)):
            self.torques[joint.name] = values[i, 0] + self.rate_squared * values[i, 1]
            if not arms[joint.name].velocity.is_zero():
                self.rates[joint.name] = arms[joint.name].velocity
        return values[len(joints) :, :]

    def add_stance_leg(self, side: str, hip: Motion, ankle: Motion, upper: SX) -> Wrench:
        """Add the torques of a leg that carries ``upper`` (about the torso's origin); returns the wrench at its ankle."""
        links, joints = self._split_leg(side, hip, ankle)
        ground = self._add_torques(upper, hip.position, joints, links, -1)
        total = ground[:, 0] + self.rate_squared * ground[:, 1]
        return Wrench(total[:3], total[3:])

    def add_swing_leg(self, side: str, hip: Motion, ankle: Motion) -> SX:
        """Add the torques of a hanging leg; returns its wrench (6, 2) about the torso's origin."""
        (*above, sole), joints = self._split_leg(side, hip, ankle)
        return self._add_torques(*sole, joints[::-1], [*above[::-1], (SX(6, 2), hip.position)], 1)

    def _add_torques(
        self, carried: SX, reference: SX, joints: Sequence[LegJoint], links: Sequence[tuple[SX, SX]], direction: int
    ) -> SX:
        """Add the torques of a chain from a wrench about a point on; returns the wrench about the last link's point."""
        for joint, (wrench, point) in zip(joints, links, strict=True):
            moment = world_frame.move_wrench(carried, reference - joint.place)[3:, :]
            gravity, inertia = (ca.dot(joint.axis, column) for column in ca.horzsplit(moment))
            self.torques[joint.name] = direction * (gravity + self.rate_squared * inertia)
            carried = world_frame.move_wrench(carried, reference - point) + wrench
            reference = point
        return carried

    def _split_leg(self, side: str, hip: Motion, ankle: Motion) -> tuple[list[tuple[SX, SX]], list[LegJoint]]:
        """Return the wrench of each link from the hip down with its point (3,) of reference, and the joints.

        Points are the hip's yaw-pitch joint for the pelvis, the hip for hip link and thigh, and the ankle for the others. None is
        the knee, whose bounds are widest where the leg is almost straight.
        """
        geometry, yaw = measure_leg(self.robot, side), self.robot.joint(f"{side}HipYawPitch")
        at_hip = add_motions(hip, resting_point(geometry.hip_m))
        frames = world_frame.make_leg_frames(at_hip, ankle, geometry.thigh_m, geometry.tibia_m, self.cosine)
        apart = Motion(*(a - h for a, h in zip(ankle, at_hip, strict=True)))
        rates, distance_squared = world_frame.compute_leg_rates(apart, geometry.thigh_m, geometry.tibia_m, self.cosine)
        self.rates |= {f"{side}{name}": rate for name, rate in zip(LEG_JOINTS, rates, strict=True)}
        self.reaches[side] = distance_squared
        self.sideways[side] = apart.position[1], -apart.position[2]
        names = (yaw.child, *(self.robot.joint(f"{side}{name}").child for name in LEG_JOINTS))
        wrenches = [
            self.link_wrench(name, frame)
            for name, frame in zip(
                names,
                (world_frame.make_upright_frame(hip), *frames, world_frame.make_upright_frame(ankle)),
                strict=True,
            )
        ]
        tibia = self.robot.links[names[3]]
        x, y, z = tibia.com_m
        from_ankle = replace(tibia, com_m=(x, y, z + geometry.tibia_m))
        wrenches[3] = world_frame.link_wrench(from_ankle, frames.tibia.axes, ankle.acceleration, GRAVITY)
        yaw_place, knee = hip.position + DM(yaw.origin_m), frames.tibia.origin.position
        across, hip_place, ankle_place = frames.hip.axes.position[:, 1], at_hip.position, ankle.position
        axes: tuple[SX | DM, ...] = (DM(yaw.axis), FORWARD, across, across, across, FORWARD)
        places = (yaw_place, hip_place, hip_place, knee, ankle_place, ankle_place)
        about = (yaw_place, hip_place, hip_place, ankle_place, ankle_place, ankle_place)
        names = tuple(f"{side}{name}" for name in ("HipYawPitch", *LEG_JOINTS))
        return [*zip(wrenches, about, strict=True)], [*map(LegJoint, names, axes, places)]


def make_double_support(
    robot: Robot,
    soles: Mapping[str, Point2],
    hip_ends: tuple[Point2, Point2],
    arm_swing: Mapping[str, Point2],
    rule: Division,
    cosine: float,
) -> PowerPhase:
    """Return double support: each leg stands on its own foot at ``soles`` [m]; for ``cosine`` see ``make_leg_frames``."""
    ankles = {side: SX(DM([*xy, measure_leg(robot, side).ankle_height_m])) for side, xy in soles.items()}
    feet_y = (measure_leg(robot, "L").hip_m[1], measure_leg(robot, "R").hip_m[1])
    weight = robot.mass_kg * GRAVITY

    def instant(z: SX, phase: float) -> PowerInstant:
        hip, arms = _move_hip(z, *hip_ends, phase), move_arms(arm_swing, ONE, SX(phase))
        sample = PowerInstant(robot=robot, rate_squared=1 / z[-1] ** 2, cosine=cosine)
        shares = share_torso(hip.position[1], rule, feet_y)
        torso = sample.link_wrench(robot.root, world_frame.make_upright_frame(hip))
        moments, loads = [], []
        for side, foot in (("L", robot.feet["left"]), ("R", robot.feet["right"])):
            upper = sample.add_arm(side, arms, hip.acceleration) + shares[side] * torso
            ground = sample.add_stance_leg(side, hip, Motion(ankles[side], SX(3, 1), SX(3, 1)), upper)
            load = ground_load(ground, weight)
            moments.append(ankles[side][:2] * load + _tilt(ground, foot.ankle_height_m))
            loads.append(load)
        sample.zmp = sum(moments, SX(2, 1)) / sum(loads, SX(0))
        return sample

    box = make_support_box(robot, soles)
    sides = ((box.back, box.front), (box.right, box.left))
    return PowerPhase(
        instant, sides, {axis: _find_nearer_margin(*pair) for axis, pair in zip("xy", sides, strict=True)}
    )


def make_single_support(robot: Robot, stance: Stance, arm_swing: Mapping[str, Point2], cosine: float) -> PowerPhase:
    """Return single support: the left leg carries everything.

    Arm joints move from angle to angle [rad]. For the largest cosine of the knee's angle see ``make_leg_frames``.
    """
    foot, weight = robot.feet["left"], robot.mass_kg * GRAVITY
    support = SX(DM([*stance.support_xy, foot.ankle_height_m]))

    def instant(z: SX, phase: float) -> PowerInstant:
        hip = _move_hip(z, stance.hip_x, stance.hip_y, phase)
        arms = move_arms(arm_swing, ONE, SX(phase))
        sample = PowerInstant(robot=robot, rate_squared=1 / z[-1] ** 2, cosine=cosine)
        begin, end = (SX(x) for x in stance.swing_x)
        path = swing_foot(begin, end, stance.swing_y, robot.feet["right"].ankle_height_m, z[-2], ONE, SX(phase))
        upper = sample.link_wrench(robot.root, world_frame.make_upright_frame(hip))
        for side in "LR":
            upper = upper + sample.add_arm(side, arms, hip.acceleration)
        upper = upper + sample.add_swing_leg("R", hip, path)
        ground = sample.add_stance_leg("L", hip, Motion(support, SX(3, 1), SX(3, 1)), upper)
        sample.zmp = support[:2] + _tilt(ground, foot.ankle_height_m) / ground_load(ground, weight)
        return sample

    x, y = stance.support_xy
    sides = ((x - foot.back_m, x + foot.front_m), (y - foot.right_m, y + foot.left_m))

    def margin_x(point: SX) -> SX:
        """Return the distance to the side beyond the ankle, see ``NaoBody.make_sole_margins``."""
        low, high = sides[0]
        return (high - point) - ca.if_else(point - x < 0, (high - point) - (point - low), 0)

    return PowerPhase(instant, sides, {"x": margin_x, "y": _find_nearer_margin(*sides[1])})


def _move_hip(z: SX, along: Point2, across: Point2, phase: float) -> Motion:
    s = SX(phase)
    up = cubic_of_sums(z[0], z[0], z[1], z[2], s)
    return stack(cubic_of_sums(*along, z[3], z[4], s), cubic_of_sums(*across, z[5], z[6], s), up)


def _find_nearer_margin(low: float, high: float) -> Callable[[SX], SX]:
    """Return the distance to the nearer of two sides."""
    return lambda point: (high - low) / 2 - ca.fabs(point - (low + high) / 2)


def _tilt(ground: Wrench, height: float) -> SX:
    """Return (2,) the ZMP's offset from a foot times its load [Nm], see ``balance.zmp_of_wrench``."""
    (fx, fy, _), (nx, ny, _) = ca.vertsplit(ground.force), ca.vertsplit(ground.moment)
    return ca.vertcat(-(ny + height * fx), nx - height * fy)


def _evaluate_linear(expression: SX, symbol: SX, value: SX) -> SX:
    """Return a linear expression at a value of its symbol, with numbers as coefficients."""
    slopes = ca.jacobian(expression, symbol)
    at_zero = ca.substitute(expression, symbol, SX.zeros(*symbol.shape))
    constant, slope = ca.Function("coefficients", [], [at_zero, slopes]).call([])
    linear = SX(ca.sparsify(DM(slope))) @ value
    return SX(DM(constant)) + ca.reshape(linear, *expression.shape)
