"""NAO between two flat, standing soles with a torso that leans: the closed chain of double support.

Twelve leg joints, two of which share a motor, connect torso and soles: the torso keeps five of its six degrees of freedom. Its
position, roll and pitch are planned; its yaw and the angle of the hips' yaw-pitch follow.
"""

import dataclasses
from collections.abc import Mapping

import casadi as ca
from casadi import DM, MX, SX

from nlp_gait.errors import InputError
from nlp_gait.formulation import InstantPoint, Point
from nlp_gait.gaits.biped.body import LEAN, Angles, Support
from nlp_gait.gaits.biped.limits import AngleLimits, Limit, RowsAndIndexes, make_rows_at_samples
from nlp_gait.gaits.biped.samples import Instant, Samples
from nlp_gait.gaits.nao.body import NaoBody
from nlp_gait.gaits.nao.joints import AXIS_TOLERANCE, HELD_ARM_ANGLES, LEG_JOINTS, YAW_PITCHES, measure_leg
from nlp_gait.robots import Robot
from nlp_gait.symbolic.kinematics import leg_angles
from nlp_gait.symbolic.nonsmooth import Nonsmooth
from nlp_gait.symbolic.rotations import FORWARD, TO_THE_LEFT, UP, axis_rotation
from nlp_gait.symbolic.trajectories import Motion, add_motions, constant_motion, map_motion, stack

# A sole turned by this leaves the ground by a tenth of a micrometre: largest error of the closed chain [rad].
FLAT = 1e-6
# Each step of Newton's method squares the error: from 0.3 rad of lean four reach rounding; limits on the turn check that.
NEWTON_STEPS = 4


class LeaningNao(NaoBody):
    """NAO in double support whose torso also rolls and pitches, from upright and at rest at one end to the same at the other."""

    def angle_names(self, phase: Support) -> tuple[str, ...]:
        return (*super().angle_names(phase), *LEAN)

    def angles(self, phase: Support, point: InstantPoint, splines: Angles, duration: SX, s: SX) -> Angles:
        return {**super().angles(phase, point, splines, duration, s), **{name: splines[name] for name in LEAN}}

    def plan(self, hip: Motion, angles: Angles, ankles: Mapping[str, Motion], margin: SX, ops: Nonsmooth) -> Instant:
        places = {side: ankle.position for side, ankle in ankles.items()}
        lean = read_lean(angles)
        joints, reach = solve_leaning_legs(self.robot, hip, lean, places, margin, ops)
        swing = {name: motion for name, motion in angles.items() if name not in LEAN}
        arms = {name: constant_motion(angle) for name, angle in HELD_ARM_ANGLES.items()} | swing
        yaw_pitch, sole_turn = close_chain(self.robot, ca.vertcat(hip.position, lean.position), places)
        arm_angle = ca.vertcat(*(motion.position for motion in swing.values()))
        return Instant(
            joints={**joints, **arms},
            hip=hip.position,
            ankles=places,
            reach=reach,
            quantities={"arm_angle": arm_angle, "other_angle": yaw_pitch, "sole_turn": sole_turn},
        )

    def make_curve_limits(self, phase: Support, count: int) -> tuple[Limit, ...]:
        yaw_pitch = AngleLimits("other_angle", self.robot, YAW_PITCHES[:1])
        return (*super().make_curve_limits(phase, count), yaw_pitch, FlatSoles())


def make_leaning_nao(body: NaoBody) -> LeaningNao:
    """Return the body with a free torso; raises InputError if the hips' yaw-pitch axes do not close the chain."""
    check_yaw_pitches(body.robot)
    fields = {field.name: getattr(body, field.name) for field in dataclasses.fields(body)}
    return LeaningNao(**fields | {"upright": frozenset()})


class FlatSoles(Limit):
    """Soles that the closed chain leaves flat where Newton's method has converged."""

    def add(self, point: Point, samples: Samples, ops: Nonsmooth) -> RowsAndIndexes:
        turns = samples.read("sole_turn")[:, 1:-1]
        return [make_rows_at_samples("sole_turn", "rad", turns, ("left", "right"), MX(-FLAT), MX(FLAT), first=1)], {}


def read_lean(angles: Angles) -> Motion:
    """Return roll and pitch of the torso (2,) [rad]."""
    # Without splines the lean is a structural zero, which the chain rule does not take.
    return Motion(*map(ca.densify, stack(*(angles[name] for name in LEAN))))


def check_yaw_pitches(robot: Robot) -> None:
    """Raise InputError if the hips' yaw-pitch turns both legs as the torso's yaw does: both would not follow from the lean."""
    left, right = (robot.joint(name).axis[2] for name in YAW_PITCHES)
    if abs(left - right) <= AXIS_TOLERANCE:
        raise InputError(
            f"robot {robot.name!r}: the axes of {' and '.join(YAW_PITCHES)} must differ in z, got {left} and {right}; "
            "with equal ones a lean of the torso is not closed by one motor"
        )


def solve_leaning_legs(
    robot: Robot, torso: Motion, lean: Motion, ankles: Mapping[str, SX], margin: SX, ops: Nonsmooth
) -> tuple[dict[str, Motion], SX]:
    """Return the motions of both legs [rad] and the cosines of the knees (2,) under a torso whose pose is given.

    Motions are those of the torso's origin (3,) [m] and of its lean (2,), roll about its own x axis and pitch before that [rad];
    the ankles (3,) rest on flat soles [m]. For the margin on a knee's reach see ``Nonsmooth.acos``.

    Source:
        Sole and knee have the angles of Gupta, Pratihar, Deb (2023), eqs. (5)-(14); those at the hip follow from the torso's
        turn. The formulation is this package's own.
    """
    moved = map_motion(lambda pose: _place_hips(robot, pose, ankles), stack(torso, lean))
    yaw_pitch, *sides = (_select_rows(moved, rows) for rows in (slice(0, 1), slice(1, 6), slice(6, 11)))
    joints: dict[str, Motion] = {}
    reach: list[SX] = []
    for side, hip in zip("LR", sides, strict=True):
        geometry = measure_leg(robot, side)
        to_ankle = add_motions(Motion(ankles[side], SX(3, 1), SX(3, 1)), Motion(*(-order[:3] for order in hip)))
        leg = leg_angles(to_ankle, geometry.thigh_m, geometry.tibia_m, margin, ops)
        _, pitch, *below = (_select_rows(leg.joints, slice(i, i + 1)) for i in range(len(LEG_JOINTS)))
        at_hip = (_select_rows(hip, slice(3, 4)), add_motions(pitch, _select_rows(hip, slice(4, 5))))
        joints |= {f"{side}{name}": motion for name, motion in zip(LEG_JOINTS, (*at_hip, *below), strict=True)}
        joints[f"{side}HipYawPitch"] = yaw_pitch
        reach.append(leg.reach)
    return joints, ca.vertcat(*reach)


def close_chain(robot: Robot, pose: SX, ankles: Mapping[str, SX]) -> tuple[SX, SX]:
    """Return the angle of the hips' yaw-pitch and that of each sole from flat (2,) [rad] at a pose (5,) of the torso."""
    turn = _solve_turn(robot, pose, ankles)
    return turn[1], ca.vertcat(*(_compute_misfit(robot, side, turn, pose, ankles[side]) for side in "LR"))


def _select_rows(motion: Motion, rows: slice) -> Motion:
    return Motion(*(value[rows] for value in motion))


def _place_hips(robot: Robot, pose: SX, ankles: Mapping[str, SX]) -> SX:
    """(11,) of a pose (5,): yaw-pitch, and by side the hip (3,) [m], its roll, and its pitch beyond upright [rad]."""
    turn = _solve_turn(robot, pose, ankles)
    rows = [turn[1]]
    for side in "LR":
        hip, rotation = _place_hip(robot, side, turn, pose)
        plane = _compute_plane(hip, ankles[side])
        at_roll = rotation.T @ axis_rotation(FORWARD, plane)  # roll about x, then the pitch about y
        rows += [hip, ca.atan2(at_roll[2, 1], at_roll[1, 1]), ca.atan2(at_roll[0, 2], at_roll[0, 0])]
    return ca.vertcat(*rows)


def _solve_turn(robot: Robot, pose: SX, ankles: Mapping[str, SX]) -> SX:
    """Solve for the torso's yaw and the hips' yaw-pitch (2,) with flat soles [rad], by Newton's method from zero."""
    turn, symbol = SX.sym("turn", 2), SX.sym("pose", 5)
    misfits = ca.vertcat(*(_compute_misfit(robot, side, turn, symbol, ankles[side]) for side in "LR"))
    slope = ca.jacobian(misfits, turn)
    step = ca.Function("step", [turn, symbol], [turn - ca.inv_minor(slope) @ misfits])
    solution = SX(2, 1)
    for _ in range(NEWTON_STEPS):
        solution = step(solution, pose)
    return solution


def _compute_misfit(robot: Robot, side: str, turn: SX, pose: SX, ankle: SX) -> SX:
    """Sine of the angle between the knee's axis, which a flat sole gives, and the plane across the axis of the hip's roll."""
    hip, rotation = _place_hip(robot, side, turn, pose)
    plane = _compute_plane(hip, ankle)
    return ca.cos(plane) * rotation[1, 0] + ca.sin(plane) * rotation[2, 0]


def _place_hip(robot: Robot, side: str, turn: SX, pose: SX) -> tuple[SX, SX]:
    """Hip joint (3,) [m] and rotation (3, 3) of the link above the hip's roll, in the world."""
    yaw, roll = robot.joint(f"{side}HipYawPitch"), robot.joint(f"{side}HipRoll")
    axes = (UP, TO_THE_LEFT, FORWARD)
    about_z, about_y, about_x = (axis_rotation(k, a) for k, a in zip(axes, (turn[0], pose[4], pose[3]), strict=True))
    torso = about_z @ about_y @ about_x
    pelvis = torso @ axis_rotation(yaw.axis, turn[1])
    return pose[:3] + torso @ DM(yaw.origin_m) + pelvis @ DM(roll.origin_m), pelvis


def _compute_plane(hip: SX, ankle: SX) -> SX:
    """Roll of a leg's plane against upright, from hip and ankle (3,) [rad] (see ``leg_angles``)."""
    return ca.atan2(ankle[1] - hip[1], hip[2] - ankle[2])
