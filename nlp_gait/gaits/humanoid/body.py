"""Any humanoid as its gaits take it: sizes that scale NAO's bounds and limits, and legs under a torso that leans."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

import casadi as ca
import numpy as np
from casadi import DM, SX

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, InstantPoint, Variable
from nlp_gait.formulation.added_limits import AddedLimits, parse_limits
from nlp_gait.formulation.assembly import make_variables
from nlp_gait.gaits.biped.body import LEAN, RIGHT_YAW, TORSO_YAW, Angles, Body, Coordinate, Support
from nlp_gait.gaits.biped.footholds import Foothold, list_swings, meets
from nlp_gait.gaits.biped.limits import HEAT_LOSS, TORQUE_CHANGE_NM
from nlp_gait.gaits.biped.samples import BOTH_FEET, Instant
from nlp_gait.robots import load_robot
from nlp_gait.robots.biped import GRAVITY, NAO_SWING_S, STEP_M, Biped, compare_swing, make_biped_model
from nlp_gait.robots.inference import SIDES
from nlp_gait.robots.leg import Leg
from nlp_gait.robots.tree import mirror_sign
from nlp_gait.symbolic import general_leg
from nlp_gait.symbolic.kinematics import FORWARD, TO_THE_LEFT, UP, axis_rotation, turn_quaternion
from nlp_gait.symbolic.nonsmooth import Exact, Nonsmooth
from nlp_gait.symbolic.trajectories import Motion, constant_motion

# Heights of the hip's middle above the ankles, as shares of a leg's length. The least is the paper's; the greatest is more than
# its 0.886, with which ankles of other robots reach their limits.
HEIGHT_SHARES = (0.5905, 0.95)
UPRIGHT = 0.9  # vertical component of the axis of a joint that turns a leg
LARGEST_LEAN = dict(zip(LEAN, (0.15, 0.3), strict=True))
LARGEST_LEAN_RATE = 1.0  # of NAO's size [rad/s]
# Nearly all poses are closed to this [1, rad] before the last Newton step, which squares the rest.
LARGEST_RESIDUAL, CLOSURE_TOL, SHARE = 1e-9, 1e-12, 0.995
MOST_STEPS = 8
LEAST_CLOSED_SHARE = 0.95  # share of poses


@dataclass(frozen=True, kw_only=True, eq=False)
class Humanoid(Body):
    """Any robot with two legs of six turning joints, whose torso may lean."""

    biped: Biped  # its legs and size
    newton_steps: Mapping[str, int]  # of Newton's method, by foot

    @property
    def angle_variables(self) -> tuple[Variable, ...]:
        """Lean of the torso at both ends of a phase, where it is at rest."""
        rows = (
            (f"{name}_{end}_rad", "rad", -largest, largest, f"{name.replace('_', ' ')} at the {end}")
            for name, largest in LARGEST_LEAN.items()
            for end in ("start", "end")
        )
        return make_variables(*rows)

    def angle_names(self, phase: Support) -> tuple[str, ...]:
        return LEAN

    def angle_ends(self, phase: Support, point: InstantPoint) -> dict[str, tuple[SX, SX]]:
        return {name: (point[f"{name}_start_rad"], point[f"{name}_end_rad"]) for name in LEAN}

    def cycle_angles(self, coordinates: Sequence[Motion]) -> Angles:
        return dict(zip(LEAN, coordinates, strict=True))

    def check_footholds(self, footholds: Sequence[Foothold]) -> None:
        """Raise InputError if hip joints do not allow the angle between two footholds, or a swinging sole meets the other one."""
        if stop := self.find_turn_stop(footholds):
            raise InputError(f"{stop}; take more steps, turn by smaller angles, or place the feet further apart")

    def find_turn_stop(self, footholds: Sequence[Foothold]) -> str | None:
        """Return what does not allow the first step that hip joints or soles do not allow, in words; None if all are allowed."""
        standing = Foothold(0.0, self.feet_y[0], 0.0).outline(self.robot.feet["left"])
        for k, (lifted, landed) in enumerate(list_swings(footholds, self.feet_y), 1):
            if stiff := find_stiff_joint(self.biped, landed.yaw):
                turned, allowed = (math.degrees(angle) for angle in (abs(landed.yaw), stiff[1]))
                return f"step {k} turns by {turned:.3g} degrees, and the limits of {stiff[0]} allow {allowed:.3g}"
            if meets(standing, self.robot.feet["right"], lifted, landed):
                return f"in step {k} the swinging sole passes over the standing one"
        return None

    def plan(self, hip: Motion, angles: Angles, ankles: Mapping[str, Motion], margin: SX, ops: Nonsmooth) -> Instant:
        """Return the motion of the whole robot; the torso rolls about its own x axis, pitches before that and yaws first."""
        middle = np.array(self.hip_m)
        roll, pitch = (angles.get(name, constant_motion(0.0)) for name in LEAN)
        pitched, side = axis_rotation(TO_THE_LEFT, pitch.position), SX(DM(TO_THE_LEFT))
        rotation = pitched @ axis_rotation(FORWARD, roll.position)
        about = pitched @ DM(FORWARD)
        spin = side * pitch.velocity + about * roll.velocity
        rate = side * pitch.acceleration + about * roll.acceleration
        rate += ca.cross(side, about) * (pitch.velocity * roll.velocity)
        joints: dict[str, Motion] = {}
        knee_cosines, closure_errors = [], []
        for letter, name in BOTH_FEET.items():
            leg = self.biped.legs[name]
            place = Motion(*(a - b for a, b in zip(hip, ankles[letter], strict=True)))
            torso = general_leg.TorsoMotion(rotation, spin, rate, middle, place)
            if TORSO_YAW in angles:
                foot = angles[RIGHT_YAW] if letter == "R" else constant_motion(0.0)
                torso = general_leg.turn_torso(torso, angles[TORSO_YAW], foot)
            motion = general_leg.leg_motion(leg, self.newton_steps[name], torso, margin, ops, held=ops.exact)
            joints |= {joint: Motion(*(order[i] for order in motion.joints)) for i, joint in enumerate(leg.joints)}
            knee_cosines.append(motion.knee_cosine)
            closure_errors.append(motion.closure_error)
        half_roll, half_pitch = roll.position / 2, pitch.position / 2
        attitude = [
            ca.cos(half_pitch) * ca.cos(half_roll),
            ca.cos(half_pitch) * ca.sin(half_roll),
            ca.sin(half_pitch) * ca.cos(half_roll),
            -ca.sin(half_pitch) * ca.sin(half_roll),
        ]
        if TORSO_YAW in angles:
            half_yaw = angles[TORSO_YAW].position / 2
            rotation = axis_rotation(UP, 2 * half_yaw) @ rotation
            attitude = turn_quaternion(attitude, ca.cos(half_yaw), ca.sin(half_yaw))
        return Instant(
            joints=joints,
            hip=hip.position - rotation @ DM(middle),
            ankles={letter: ankle.position for letter, ankle in ankles.items()},
            knee_cosine=ca.vertcat(*knee_cosines),
            closure_error=ca.vertcat(*closure_errors) if ops.exact else SX(0, 1),
            attitude=ca.vertcat(*attitude),
            yaw=angles[RIGHT_YAW].position if TORSO_YAW in angles else SX(0, 1),
        )


def find_stiff_joint(biped: Biped, yaw: float) -> tuple[str, float] | None:
    """Return the hip joint that forbids a yaw between the feet [rad], of which each leg turns half, and the largest allowed."""
    for side, leg in biped.legs.items():
        turn = (yaw if side == "right" else -yaw) / 2
        for axis, (low, high), joint in zip(leg.axes[:3], leg.limits_rad, leg.joints, strict=False):
            angle = turn * np.sign(axis[2])
            if abs(axis[2]) > UPRIGHT and not low <= angle <= high:
                return joint, 2 * abs(float(low if angle < low else high))
    return None


def make_humanoid(robot: str, *, drive_limits: bool = True, limits: str | AddedLimits = "") -> Humanoid:
    """Return a humanoid, by name or file, as its gaits take it; raises InputError if its legs cannot be solved.

    Torques and speeds may be within the limits of the robot's file.
    """
    biped = make_biped_model(load_robot(robot))
    left, right = biped.legs["left"], biped.legs["right"]
    middle_x, _, middle_z = (left.hip_m + right.hip_m) / 2
    above = biped.model.feet["left"].ankle_height_m + float(left.ankle_m[2] - left.foot_m[2])
    lowest, highest = (round(above + share * left.length_m, 3) for share in HEIGHT_SHARES)
    swing_speed = compare_swing(biped)
    rate = float(f"{LARGEST_LEAN_RATE * swing_speed / biped.time_scale:.4g}")
    heat = float(f"{biped.heat_W_per_Nm2:.4g}")
    return Humanoid(
        family="humanoid",
        added_limits=parse_limits(limits),
        title=biped.full.name,
        full=biped.full,
        simulated=biped.model,
        robot=biped.model,
        joints=biped.joints,
        planned=biped.joints,
        mirrored=(*right.joints, *left.joints),
        leg_joints={side: biped.legs[foot].joints for side, foot in BOTH_FEET.items()},
        coordinates=tuple(
            Coordinate(
                name=name,
                rate=f"{name}_rate",
                bounds=(-largest, largest),
                largest_rate=rate,
                mirror_sign=sign,
                words=name.replace("_", " "),
                rate_words=f"rate of the {name.replace('_', ' ')}",
            )
            for (name, largest), sign in zip(LARGEST_LEAN.items(), (-1.0, 1.0), strict=True)
        ),
        upright=frozenset(foot.link for foot in biped.model.feet.values()),
        gravity=GRAVITY,
        feet_y=(float(left.foot_m[1]), float(right.foot_m[1])),
        leg_length_m=biped.leg_length_m,
        hip_height_m=(lowest, highest),
        hip_m=(float(middle_x), 0.0, float(middle_z)),  # the legs are mirror images
        hip_name="middle of both hips",
        step_length_m=round(STEP_M * biped.length_scale, 3),
        heat=replace(HEAT_LOSS, default=heat, description=f"K, heat loss; {biped.heat_source}"),
        closed_form=False,
        drive_limits=drive_limits,
        length_scale=biped.length_scale,
        time_scale=biped.time_scale,
        swing_speed=swing_speed,
        torque_scale=biped.torque_scale,
        biped=biped,
        newton_steps={side: count_newton_steps(leg) for side, leg in biped.legs.items()},
    )


@lru_cache(maxsize=64)
def count_newton_steps(leg: Leg) -> int:
    """Return the steps that a leg needs after the guess: none if that is exact, else one more than closes nearly all poses.

    A few poses, such as deep squats, may stay open and do not count: constraints keep plans off them. Raises InputError for more.
    """
    inputs = general_leg.sample_flat_foot_poses(leg)
    steps = _find_steps(leg, inputs)
    if steps is not None:
        return steps
    closed = compute_residuals(leg, MOST_STEPS - 1, inputs) <= LARGEST_RESIDUAL
    if np.mean(closed) >= LEAST_CLOSED_SHARE and (steps := _find_steps(leg, inputs[:, closed])) is not None:
        return steps
    raise InputError(
        f"the leg of joints {', '.join(leg.joints)} is not solved in {MOST_STEPS} Newton steps: its hip axes pass each other too "
        f"far, or its ankle's; after {MOST_STEPS - 1} steps {np.mean(closed):.0%} of {general_leg.POSES} poses are closed, and "
        f"{LEAST_CLOSED_SHARE:.0%} must be"
    )


def _find_steps(leg: Leg, inputs: Array) -> int | None:
    for steps in range(MOST_STEPS):
        left = compute_residuals(leg, steps, inputs)
        if steps == 0 and np.quantile(left, SHARE) <= CLOSURE_TOL:
            return 0
        if np.quantile(left, SHARE) <= LARGEST_RESIDUAL:
            return steps + 1
    return None


def compute_residuals(leg: Leg, steps: int, inputs: Array) -> Array:
    """Compute the largest residual of each pose (N,) after a number of steps."""
    symbols = SX.sym("inputs", len(inputs))
    root = general_leg.make_leg_root(leg, steps, Exact(), SX(0.0))
    left = root.residual(root.newton(symbols), symbols)
    function = ca.Function("residual", [symbols], [left])
    return np.abs(np.array(function.map(inputs.shape[1])(inputs))).max(axis=0)


JOINT_COLUMNS = ("joint", "from, rad", "to, rad", "Nm", "rad/s", "kg m^2", "Nm s/rad")


def list_joints(body: Humanoid) -> list[tuple[str, ...]]:
    """Return a row of JOINT_COLUMNS for each joint of the left leg; both sides' values where they differ."""
    rows = []
    for pair in zip(*(body.biped.legs[side].joints for side in SIDES), strict=True):
        left, right = (body.biped.full.joint(name) for name in pair)
        sign = mirror_sign(body.biped.full, *pair)
        low, high = sorted(sign * limit for limit in right.planning_limits_rad)
        values = zip(
            (
                *left.planning_limits_rad,
                left.torque_limit_Nm,
                left.velocity_limit_rad_s,
                left.armature_kgm2,
                left.damping_Nms_rad,
            ),
            (low, high, right.torque_limit_Nm, right.velocity_limit_rad_s, right.armature_kgm2, right.damping_Nms_rad),
            strict=True,
        )
        texts = [[f"{value:.4g}" if math.isfinite(value) else "none" for value in both] for both in values]
        rows.append((pair[0], *(" / ".join(dict.fromkeys(both)) for both in texts)))
    return rows


def describe_humanoid(body: Humanoid) -> list[tuple[str, str]]:
    """Return what was inferred from a robot's file as pairs of texts: feet, legs, soles, posture, sizes."""
    biped = body.biped
    robot, legs = biped.full, biped.legs
    held = {name: angle for name, angle in biped.posture_rad.items() if angle}
    rows = [("root", robot.root), ("mass", f"{robot.mass_kg:.2f} kg")]
    for side in BOTH_FEET.values():
        leg, foot = legs[side], robot.feet[side]
        rows.append((f"{side} leg", ", ".join(leg.joints)))
        rows.append(
            (
                f"{side} sole",
                f"{1e3 * (foot.front_m + foot.back_m):.0f} mm by {1e3 * (foot.left_m + foot.right_m):.0f} mm, "
                f"{1e3 * foot.front_m:.0f} mm of it ahead of the joint of {foot.link}, {1e3 * foot.ankle_height_m:.0f} mm high",
            )
        )
    left = legs["left"]
    most = max(body.newton_steps.values())
    rows += [
        ("leg length", f"{biped.leg_length_m:.4f} m"),
        ("left and right", "; ".join(biped.differences) or "alike: a step and its mirror image are planned as one"),
        (
            "straight knee",
            f"at {left.straight_rad:z.4f} rad, bends to {'larger' if left.bend > 0 else 'smaller'} angles",
        ),
        ("inverse kinematics", f"by {most} Newton steps" if most else "in closed form"),
        (
            "held joints",
            f"{len(biped.posture_rad)}, at zero"
            + (" but " + ", ".join(f"{name} {angle:+.3f} rad" for name, angle in held.items()) if held else ""),
        ),
        ("heat constant K", f"{biped.heat_W_per_Nm2:.3g} W/(Nm)^2, {biped.heat_source}"),
        ("step length", f"{body.step_length_m:.3f} m by default"),
        (
            "time of a swing",
            f"{body.scale_time(NAO_SWING_S / body.swing_speed):.3g} to {body.scale_time(4.0):.3g} s"
            + (", the least from its joints' speeds and torques" if body.swing_speed > 1.0 else ""),
        ),
        ("torque may change", f"by {TORQUE_CHANGE_NM * biped.torque_scale:.3g} Nm over an interval"),
    ]
    return rows
