"""Inverse kinematics of a leg with six revolute joints for any pose of the torso, over a flat sole: root and rates.

The chain begins at the foot, whose axes are the world's, and ends at the torso. Newton's method starts at the nearest leg with a
spherical hip and a universal ankle, and works on cosines and sines: each joint has one transcendental function, at the end.
"""

import math
from functools import lru_cache
from typing import NamedTuple

import casadi as ca
import numpy as np
from casadi import DM, SX

from nlp_gait.robots.leg import LEG_JOINT_COUNT, Leg
from nlp_gait.symbolic.elimination import Factors, choose_pivots, factorise
from nlp_gait.symbolic.kinematics import (
    LEAST_NORM,
    UP,
    axis_rotation,
    build_rotation,
    find_rotation,
    invert_turn,
    rotate_vector,
)
from nlp_gait.symbolic.nonsmooth import LEAST_REACH_MARGIN, Exact, Nonsmooth, Root
from nlp_gait.symbolic.trajectories import Array, Motion, map_motion, stack

# Least absolute value of a pivot, with lengths in units of the leg's length: a knee bent by 0.14 rad has 0.07. The second one is
# for the iterates of a solver, which may be poses that no gait has.
LEAST_PIVOT, LEAST_PIVOT_OF_ITERATES = 1e-6, 1e-3
# Misfit of a leg as a share of its length beyond which its rates are zero: the pose is out of reach.
CLOSURE_TOL = 1e-6
# Largest misfit before Newton's last step, in lengths of a leg and rad; otherwise the guess is used.
LARGEST_MISFIT = 0.01
# Random poses on which Newton's method is tried, and those on which the order of elimination is chosen.
POSES, ORDER_POSES, SEED = 2000, 400, 0
# Distance of hip and ankle as a share of the leg's length, its direction to the front and to the side, and the lean of the torso.
DISTANCES = (0.59, 0.97)
LARGEST_PITCH, LARGEST_ROLL = math.radians(28.0), math.radians(15.0)
LEAN_PITCH, LEAN_ROLL = 0.3, 0.15


class TorsoMotion(NamedTuple):
    """Motion of the torso relative to a standing or swinging flat foot, in the world's axes."""

    rotation: SX  #: (3, 3) from the torso's axes
    spin: SX  #: (3,) [rad/s]
    spin_rate: SX  #: (3,) [rad/s^2]
    point_m: Array  #: (3,) a point of the torso from its origin, in its axes [m]
    place: Motion  #: (3,) position of that point from the origin of the foot's link [m]


def turn_torso(torso: TorsoMotion, yaw: Motion, foot_yaw: Motion) -> TorsoMotion:
    """Return the motion, in a foot's own axes, of a torso that yaws after it rolled and pitched, over a foot that yaws, too.

    The given motion has the rotation without yaw, and its place in the world's axes; yaws are in the world [rad].
    """
    heading = Motion(*(a - b for a, b in zip(yaw, foot_yaw, strict=True)))
    turn, up = axis_rotation(UP, heading.position), SX(DM(UP))
    spin, rate = turn @ torso.spin, turn @ torso.spin_rate
    return torso._replace(
        rotation=turn @ torso.rotation,
        spin=spin + up * heading.velocity,
        spin_rate=rate + up * heading.acceleration + heading.velocity * ca.cross(up, spin),
        place=map_motion(
            lambda yaw_and_place: axis_rotation(UP, -yaw_and_place[0]) @ yaw_and_place[1:], stack(foot_yaw, torso.place)
        ),
    )


class LegMotion(NamedTuple):
    """Angles of a leg."""

    joints: Motion  #: (6,) [rad] with both derivatives
    #: Cosine of the knee's angle from straight, by the law of cosines; above 1 the foot is out of reach
    knee_cosine: SX
    closure_error: SX  #: misfit of the torso's pose: the larger of distance and rotation times the leg's length [m]


class _Chain(NamedTuple):
    rotations: list[SX]  #: (3, 3) of the links before each joint, the torso first
    axes: list[SX]  #: (3,) of each joint in the world
    levers: list[SX]  #: (3,) from each joint to the hip centre
    #: (3,) from each joint to the one before it, the hip centre before the first; in the link between
    segments: list[SX]
    hip: SX  #: (3,) hip centre from the foot's origin


def leg_motion(leg: Leg, steps: int, torso: TorsoMotion, margin: SX, ops: Nonsmooth, *, held: bool) -> LegMotion:
    """Return the angles, velocities and accelerations of a leg, defined for every finite input.

    Newton's method takes ``steps`` iterations from the guess; ``margin`` is on the reach of the knee (see ``Nonsmooth.acos``). If
    ``held``, the rates of a leg that misses its foot are zero; otherwise they are those of its angles.
    """
    arm = torso.rotation @ DM(leg.hip_m - torso.point_m)
    swept = ca.cross(torso.spin, arm)
    hip = Motion(
        torso.place.position + arm,
        torso.place.velocity + swept,
        torso.place.acceleration + ca.cross(torso.spin_rate, arm) + ca.cross(torso.spin, swept),
    )
    q = ops.root(make_leg_root(leg, steps, ops, margin), ca.vertcat(hip.position, ca.vec(torso.rotation)))
    bent = q if ops.exact else _keep_bent(leg, q, margin)
    chain = _build_chain(leg, ca.cos(bent), ca.sin(bent))
    off = _compute_misfit(leg, chain, hip.position, torso.rotation)
    closure_error = leg.length_m * ca.sqrt(ca.fmax(ca.sumsqr(off[:3]), ca.sumsqr(off[3:])))
    factors = _factorise(leg, chain, LEAST_PIVOT if ops.exact else LEAST_PIVOT_OF_ITERATES)
    qd = factors.solve(ca.vertcat(hip.velocity / leg.length_m, torso.spin))
    linear, angular = _compute_bias(chain, qd)
    qdd = factors.solve(ca.vertcat((hip.acceleration - linear) / leg.length_m, torso.spin_rate - angular))
    if held:
        closed = closure_error <= CLOSURE_TOL * leg.length_m
        qd, qdd = (ca.vertcat(*(ca.if_else(closed, value, 0) for value in ca.vertsplit(rate))) for rate in (qd, qdd))
    return LegMotion(Motion(q, qd, qdd), _knee_cosine(leg, ca.sumsqr(hip.position - _ankle(leg))), closure_error)


def _keep_bent(leg: Leg, q: SX, margin: SX) -> SX:
    """Bend the knee by at least half of what the reach margin requires.

    At a straight knee rates are infinite, which a solver cannot pass; within the reach margin nothing changes.
    """
    least = ca.acos(1 - ca.fmax(margin, LEAST_REACH_MARGIN)) / 2
    knee = leg.straight_rad + leg.bend * ca.fmax(leg.bend * (q[3] - leg.straight_rad), least)
    return ca.vertcat(q[:3], knee, q[4:])


def make_leg_root(leg: Leg, steps: int, ops: Nonsmooth, margin: SX) -> Root:
    """Return the six equations of a leg; inputs: hip centre from the foot's origin (3,) [m], rotation of the torso (9,)."""

    def residual(q: SX, inputs: SX) -> SX:
        return _compute_misfit(leg, _build_chain(leg, ca.cos(q), ca.sin(q)), inputs[:3], ca.reshape(inputs[3:], 3, 3))

    def newton(inputs: SX) -> SX:
        hip, rotation = inputs[:3], ca.reshape(inputs[3:], 3, 3)
        cosines, sines = first = guess(leg, hip, rotation, margin, ops)
        off = SX(0)
        for _ in range(steps):
            chain = _build_chain(leg, cosines, sines)
            off = _compute_misfit(leg, chain, hip, rotation)
            step = _factorise(leg, chain).solve(off)
            half = step / 2  # Cayley's map: tan(step / 2) taken as step / 2
            share = 1 / (1 + half**2)
            turn_cos, turn_sin = (1 - half**2) * share, 2 * half * share
            cosines, sines = cosines * turn_cos - sines * turn_sin, sines * turn_cos + cosines * turn_sin
        if not steps:
            return ca.atan2(sines, cosines)
        near = ca.sumsqr(off) <= LARGEST_MISFIT**2  # otherwise out of reach, where the guess is reasonable
        cosines, sines = (ca.if_else(near, new, old) for new, old in zip((cosines, sines), first, strict=True))
        return ca.atan2(sines, cosines)

    return Root(residual=residual, newton=newton, lift=steps > 0)


def guess(leg: Leg, hip: SX, rotation: SX, margin: SX, ops: Nonsmooth) -> tuple[SX, SX]:
    """Return cosines and sines (6,) of the nearest leg with a spherical hip and a universal ankle.

    ``hip`` (3,) is the hip centre from the foot's origin in the foot's axes [m], ``rotation`` (3, 3) that of the torso.
    """
    a = [SX(DM(axis)) for axis in leg.axes]
    # Knee: the generalised law of cosines.
    from_ankle = hip - _ankle(leg)
    bent = leg.bend * ops.acos(_knee_cosine(leg, ca.sumsqr(from_ankle)), margin).value
    knee = leg.straight_rad + bent if leg.straight_rad else bent
    knee_turn = ca.cos(knee), ca.sin(knee)
    # Ankle: m is the hip in the axes of the shank; rotated by the fifth joint it is the direction rotated back by the sixth.
    m = -(rotate_vector(a[3], *invert_turn(knee_turn), SX(DM(leg.thigh_m))) + DM(leg.shank_m))
    five, six = _solve_ankle(leg.axes[4], leg.axes[5], m, from_ankle, leg.hip_m - leg.ankle_m)
    # Hip: three axes through one point.
    in_torso = rotate_vector(a[3], *invert_turn(knee_turn), a[2])
    for axis, turn in ((a[4], five), (a[5], six)):
        in_torso = rotate_vector(axis, *invert_turn(turn), in_torso)
    third = rotation.T @ in_torso
    first = rotation @ a[0]
    for axis, turn in ((a[5], six), (a[4], five), (a[3], knee_turn)):
        first = rotate_vector(axis, *turn, first)
    turns = (*_solve_hip(leg.axes[:3], third, first), knee_turn, five, six)
    return ca.vertcat(*(cos for cos, _ in turns)), ca.vertcat(*(sin for _, sin in turns))


def _ankle(leg: Leg) -> SX:
    return SX(DM(leg.ankle_m - leg.foot_m))


def _knee_cosine(leg: Leg, distance_squared: SX) -> SX:
    """Return the cosine of the knee's angle from straight, by the law of cosines for a skew knee."""
    u, w = leg.thigh_m, leg.shank_m
    return (distance_squared - float(u @ u + w @ w) - 2 * leg.knee_terms[0]) / (2 * leg.knee_gain)


def _solve_ankle(
    fifth: Array, sixth: Array, m: SX, direction: SX, at_zero: Array
) -> tuple[tuple[SX, SX], tuple[SX, SX]]:
    """Solve Rot(fifth) Rot(sixth) seen = m for the rotations of the ankle: Paden's and Kahan's second subproblem."""
    c = float(fifth @ sixth)
    normal = np.cross(fifth, sixth)
    sine_squared = float(normal @ normal)
    x, y = ca.dot(DM(fifth), m), ca.dot(DM(sixth), direction)
    alpha, beta = (x - c * y) / sine_squared, (y - c * x) / sine_squared
    left = (ca.sumsqr(direction) - alpha**2 - beta**2 - 2 * c * alpha * beta) / sine_squared
    sign = 1.0 if float(at_zero @ normal) >= 0 else -1.0
    between = alpha * DM(fifth) + beta * DM(sixth) + sign * ca.sqrt(ca.fmax(left, LEAST_NORM)) * DM(normal)
    return find_rotation(fifth, between, m), find_rotation(sixth, direction, between)


def _solve_hip(axes: Array, third: SX, first: SX) -> tuple[tuple[SX, SX], tuple[SX, SX], tuple[SX, SX]]:
    """Return the rotations of the hip's joints (axes (3, 3)) from the third axis after them and the first one before them."""
    a, b, c = axes
    constant = float((a @ b) * (b @ c))
    along, across = float(a @ c) - constant, float(a @ np.cross(b, c))
    gain = float(np.hypot(along, across))
    # cos(q2 - delta) = kappa, with q2 = 0 on the same side of delta
    kappa = ca.fmax(-1, ca.fmin(1, (ca.dot(DM(a), third) - constant) / gain))
    sine = -np.sign(across) * ca.sqrt(ca.fmax(1 - kappa**2, LEAST_NORM))
    cos_d, sin_d = along / gain, across / gain
    two = cos_d * kappa - sin_d * sine, sin_d * kappa + cos_d * sine
    one = find_rotation(a, rotate_vector(SX(DM(b)), *two, SX(DM(c))), third)
    back = find_rotation(c, rotate_vector(SX(DM(b)), *invert_turn(two), SX(DM(a))), first)
    return one, two, invert_turn(back)


def _build_chain(leg: Leg, cosines: SX, sines: SX) -> _Chain:
    points, n = leg.meeting_points, LEG_JOINT_COUNT
    rotations, axes, segments = [SX.eye(3)] * n, [SX(3, 1)] * n, [SX(3, 1)] * n
    rotation = SX.eye(3)
    for i in reversed(range(n)):
        axes[i] = rotation @ DM(leg.axes[i])
        rotation = rotation @ build_rotation(tuple(leg.axes[i]))(cosines[i], -sines[i])
        rotations[i] = rotation
        before = points[i - 1] if i else leg.hip_m
        step = before - points[i]
        segments[i] = rotation @ DM(step) if np.any(step) else SX.zeros(3)
    levers = []
    lever = SX.zeros(3)
    for segment in segments:
        lever = lever + segment
        levers.append(lever)
    return _Chain(rotations, axes, levers, segments, SX(DM(points[-1] - leg.foot_m)) + levers[-1])


def _compute_misfit(leg: Leg, chain: _Chain, hip: SX, rotation: SX) -> SX:
    """Return (6,) the misfit of the hip centre in lengths of the leg, and of the torso's rotation as a vector [rad]."""
    turned = chain.rotations[0]
    turn = sum((ca.cross(turned[:, k], rotation[:, k]) for k in range(3)), SX(3, 1)) / 2
    return ca.vertcat((hip - chain.hip) / leg.length_m, turn)


def _compute_jacobian(leg: Leg, chain: _Chain) -> SX:
    """Return (6, 6) derivatives of hip centre and torso by the joints, in the units of the misfit."""
    columns = [
        ca.vertcat(-ca.cross(axis, lever) / leg.length_m, -axis)
        for axis, lever in zip(chain.axes, chain.levers, strict=True)
    ]
    return ca.horzcat(*columns)


def _factorise(leg: Leg, chain: _Chain, least_pivot: float = LEAST_PIVOT) -> Factors:
    return factorise(_compute_jacobian(leg, chain), _choose_order(leg), least_pivot)


@lru_cache(maxsize=64)
def _choose_order(leg: Leg) -> tuple[tuple[int, int], ...]:
    """Choose an order of elimination for the poses of gaits; there the guess is near enough."""
    q, inputs = SX.sym("q", LEG_JOINT_COUNT), SX.sym("inputs", 12)
    cosines, sines = guess(leg, inputs[:3], ca.reshape(inputs[3:], 3, 3), SX(0.0), Exact())
    matrix = _compute_jacobian(leg, _build_chain(leg, ca.cos(q), ca.sin(q)))
    function = ca.Function("matrix", [q], [ca.densify(matrix)])
    angles = ca.Function("angles", [inputs], [ca.atan2(sines, cosines)])
    poses = np.array(angles.map(ORDER_POSES)(sample_flat_foot_poses(leg, ORDER_POSES)))
    matrices = np.array([function(pose).full() for pose in poses.T])
    pattern = [[not matrix[i, j].is_zero() for j in range(LEG_JOINT_COUNT)] for i in range(LEG_JOINT_COUNT)]
    return choose_pivots(matrices, np.array(pattern))


def sample_flat_foot_poses(leg: Leg, count: int = POSES) -> Array:
    """Return random poses (12, N) of a gait over flat soles: hip centres from the foot's origin [m] and torso rotations."""
    rng = np.random.default_rng(SEED)
    distance = rng.uniform(*DISTANCES, count) * leg.length_m
    front, aside = (rng.uniform(-most, most, count) for most in (LARGEST_PITCH, LARGEST_ROLL))
    pitch, roll = (rng.uniform(-most, most, count) for most in (LEAN_PITCH, LEAN_ROLL))
    direction = np.stack([np.sin(front), np.sin(aside)])
    direction = np.concatenate([direction, np.sqrt(1.0 - (direction**2).sum(axis=0, keepdims=True))])
    hips = distance * direction + (leg.ankle_m - leg.foot_m)[:, None]
    c, s, cr, sr = np.cos(pitch), np.sin(pitch), np.cos(roll), np.sin(roll)
    zero = np.zeros(count)
    columns = [c, zero, -s, s * sr, cr, c * sr, s * cr, -sr, c * cr]  # Ry(pitch) Rx(roll)
    return np.asarray(np.concatenate([hips, np.stack(columns)]))


def _compute_bias(chain: _Chain, qd: SX) -> tuple[SX, SX]:
    """Return linear and angular acceleration of hip centre and torso at constant joint velocities."""
    spin, spin_rate, linear = SX.zeros(3), SX.zeros(3), SX.zeros(3)
    for i in reversed(range(LEG_JOINT_COUNT)):
        turn = -chain.axes[i] * qd[i]
        spin_rate = spin_rate + ca.cross(spin, turn)
        spin = spin + turn
        segment = chain.segments[i]
        if not segment.is_zero():
            linear = linear + ca.cross(spin_rate, segment) + ca.cross(spin, ca.cross(spin, segment))
    return linear, spin_rate
