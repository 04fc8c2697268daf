"""Inverse dynamics of a tree of bodies, Lagrange's equations of a mechanism, zero-moment points, and wrenches of soles."""

import math
from collections.abc import Callable, Collection, Mapping, Sequence
from functools import cache, wraps
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from casadi import DM, SX

from nlp_gait.robots.tree import TreeBody
from nlp_gait.symbolic.kinematics import relative_rotation


def build_formula(*shapes: tuple[int, int]) -> Callable[[Callable[..., SX]], Callable[..., SX]]:
    """Decorate a formula of matrices of these shapes: it becomes a function of CasADi, whose operations every call inserts.

    An operator takes 10 to 20 us when Python calls it, and less than 1 us in a function that is inserted.
    """

    def decorate(formula: Callable[..., SX]) -> Callable[..., SX]:
        @cache
        def build() -> ca.Function:
            arguments = [SX.sym(f"a{k}", *shape) for k, shape in enumerate(shapes)]
            return ca.Function(formula.__name__.strip("_"), arguments, [formula(*arguments)])

        @wraps(formula)
        def insert(*arguments: SX | DM) -> SX:
            return build()(*arguments)

        return insert

    return decorate


class EquationsOfMotion(NamedTuple):
    """M(q) qdd + C(q, qd) qd + G(q) = generalised forces."""

    M: SX  #: (n, n) inertia matrix, symmetric and positive definite
    C: SX  #: (n, n) Coriolis matrix of Christoffel symbols, so that dM/dt - 2 C is skew-symmetric
    G: SX  #: (n,) gravity


def equations_of_motion(kinetic: SX, potential: SX, q: SX, qd: SX) -> EquationsOfMotion:
    """Derive Lagrange's equations of L = K(q, qd) - P(q) [J] in coordinates q (n,), with K quadratic in the rates.

    Source:
        Bhardwaj et al., eqs. (40)-(42); with C as a matrix, so that the product C qd is the vector of eq. (42).
    """
    # Equal entries of M are one expression, so that terms of C cancel symbolically.
    M = ca.triu2symm(ca.cse(ca.triu(ca.hessian(kinetic, qd)[0])))
    n = range(q.shape[0])
    slopes = {(i, j): ca.jacobian(M[i, j], q) for i in n for j in n if i <= j}
    by_column = [ca.vertcat(*(slopes[min(i, k), max(i, k)] for i in n)) for k in n]  # derivatives of M_ik by q_j
    C = SX(q.shape[0], q.shape[0])
    for k, A in enumerate(by_column):
        C += 0.5 * (A + ca.horzcat(*(B[:, k] for B in by_column)) - A.T) * qd[k]
    return EquationsOfMotion(M, ca.sparsify(C), ca.gradient(potential, q))


class Wrench(NamedTuple):
    """Force [N] and moment about a reference point [Nm], each (3,)."""

    force: SX
    moment: SX


class Inertia(NamedTuple):
    """Mass [kg], first moments (3,) [kg m] and second moments (3, 3) [kg m^2] of a body about its reference point."""

    mass: float
    first: np.ndarray[Any, Any]
    second: np.ndarray[Any, Any]


def tilt_gravity(magnitude: float, slope_rad: float) -> tuple[float, float, float]:
    """Return gravity (3,) [m/s^2] in the axes of ground that rises forward by an angle: x along it, z normal to it."""
    return 0.0 - magnitude * math.sin(slope_rad), 0.0, -magnitude * math.cos(slope_rad)


def newton_euler(
    tree: Sequence[TreeBody],
    q: Mapping[str, SX],
    qd: Mapping[str, SX],
    qdd: Mapping[str, SX],
    gravity: tuple[float, float, float],
    shares: Mapping[str, SX] | None = None,
    upright: Collection[str] = (),
) -> tuple[dict[str, SX], Wrench]:
    """Return the joint torques of a tree whose first body is fixed to the ground.

    Args:
        tree: bodies, parents first (see ``robots.tree.make_tree``).
        q: joint angles by name [rad]; a constant angle costs no operations.
        qd: joint velocities by name [rad/s].
        qdd: joint accelerations by name [rad/s^2].
        gravity: (3,) along x, y and z [m/s^2], see ``tilt_gravity``.
        shares: factors on mass and inertia of links by name, for a link that two trees carry together.
        upright: links that do not turn, which saves operations.

    Returns:
        Torques by joint name [Nm], and the wrench of the ground on the first body about its reference point.

    Source:
        Gives the torques of Gupta, Pratihar, Deb (2023), eqs. (15)-(18); the recursion is that of Luh, Walker and Paul
        (1980), with each link seen from the joint through which it is reached, inertias regrouped and products of spins
        shared as Khalil and Kleinfinger (1987) do. Rotors add their inertia at the joint times its acceleration, without
        gyroscopic torques: Featherstone (2008), section 9.6. Damped joints add damping times rate. Equations (D.1) to (D.9) in
        docs/model.
    """
    shares = shares or {}
    rotations = [relative_rotation(body, q) for body in tree]
    moved: list[tuple[SX, SX, SX, SX]] = []  # spin, its rate, turning and acceleration of each body
    wrenches: list[Wrench] = []  # that the motion of each body needs, about its reference point, in its axes
    for body, inertia, rotation in zip(tree, regroup_inertias(tree, shares), rotations, strict=True):
        spin, spin_rate = SX(3, 1), SX(3, 1)
        if body.joint is None:
            # gravity as an upward acceleration of the ground
            acceleration = SX(DM([0.0 - component for component in gravity]))
        else:
            parent_spin, parent_spin_rate, parent_turning, parent_acceleration = moved[body.parent]
            acceleration = rotation.T @ (parent_acceleration + parent_turning @ DM(body.offset_m))
            if body.link.name not in upright:
                axis = body.direction * DM(body.joint.axis)
                rate, rate_rate = axis * qd[body.joint.name], axis * qdd[body.joint.name]
                carried = rotation.T @ parent_spin
                spin = carried + rate
                spin_rate = rotation.T @ parent_spin_rate + ca.cross(carried, rate) + rate_rate
        turning = _compute_turning(spin, spin * spin, spin_rate)
        moved.append((spin, spin_rate, turning, acceleration))
        force = inertia.mass * acceleration + turning @ DM(inertia.first)
        moment = ca.cross(SX(DM(inertia.first)), acceleration) + _compute_moment(turning, DM(inertia.second))
        if body.link.name in shares:  # force and moment are linear in mass and inertia
            force, moment = force * shares[body.link.name], moment * shares[body.link.name]
        wrenches.append(Wrench(force, moment))
    return _pass_down(tree, rotations, wrenches, qd, qdd), wrenches[0]


def _pass_down(
    tree: Sequence[TreeBody],
    rotations: Sequence[SX],
    wrenches: list[Wrench],
    qd: Mapping[str, SX],
    qdd: Mapping[str, SX],
) -> dict[str, SX]:
    """Add the wrench of each body to that of its parent; return the torque of each joint's motor."""
    torques: dict[str, SX] = {}
    for i in range(len(tree) - 1, 0, -1):
        body, joint = tree[i], tree[i].joint
        assert joint is not None  # only the first body has none; for the type checker
        torques[joint.name] = body.direction * ca.dot(DM(joint.axis), wrenches[i].moment)
        if joint.armature_kgm2:
            torques[joint.name] += joint.armature_kgm2 * qdd[joint.name]
        if joint.damping_Nms_rad:
            torques[joint.name] += joint.damping_Nms_rad * qd[joint.name]
        force, moment = (rotations[i] @ vector for vector in wrenches[i])
        below = wrenches[body.parent]
        lever = ca.cross(SX(DM(body.offset_m)), force)
        wrenches[body.parent] = Wrench(below.force + force, below.moment + (moment + lever))
    return torques


def regroup_inertias(tree: Sequence[TreeBody], kept: Collection[str] = ()) -> list[Inertia]:
    """Return inertias with the same torques and the same wrench on the ground that need fewer operations.

    Matter on the axis of a joint moves in the same way whether it belongs to the body before or after the joint, and exerts no
    torque about the axis. So mass, the first moment along the axis and the second moment along it are moved to the body before:
    only the first body has mass. Links in ``kept`` are not changed. Equation (D.10) in docs/model.
    """
    inertias = [_inertia(body) for body in tree]
    for i in range(len(tree) - 1, 0, -1):
        body = tree[i]
        if body.joint is None or {body.link.name, tree[body.parent].link.name} & set(kept):
            continue
        mass, first, second = inertias[i]
        axis, offset = np.array(body.joint.axis), np.array(body.offset_m)
        along, spread = axis @ first, axis @ second @ axis
        line = spread * np.outer(axis, axis)
        inertias[i] = Inertia(0.0, first - along * axis, second - line)
        taken, bent = inertias[body.parent], np.outer(offset, along * axis)
        inertias[body.parent] = Inertia(
            taken.mass + mass,
            taken.first + mass * offset + along * axis,
            taken.second + mass * np.outer(offset, offset) + bent + bent.T + line,
        )
    return inertias


def _inertia(body: TreeBody) -> Inertia:
    mass, com, about_com = body.link.mass_kg, np.array(body.com_offset_m), body.link.inertia_matrix
    spread = np.trace(about_com) / 2 * np.eye(3) - about_com  # second moments about the centre of mass
    return Inertia(mass, mass * com, spread + mass * np.outer(com, com))


@build_formula((3, 1), (3, 1), (3, 1))
def _compute_turning(spin: SX, squared: SX, spin_rate: SX) -> SX:
    """Return the matrix (3, 3) from the position of a body's point to its acceleration, relative to the reference point."""
    (x, y, z), (xx, yy, zz), (a, b, c) = map(ca.vertsplit, (spin, squared, spin_rate))
    xy, xz, yz = x * y, x * z, y * z
    return ca.blockcat([[-(yy + zz), xy - c, xz + b], [xy + c, -(xx + zz), yz - a], [xz - b, yz + a, -(xx + yy)]])


@build_formula((3, 3), (3, 3))
def _compute_moment(U: SX, J: SX) -> SX:
    """Return the moment that turning U of a body about its reference point needs: sum of p x (U p) over its matter at p.

    J is its second moments about the reference point.
    """
    return ca.vertcat(
        *(
            (U[k, k] - U[j, j]) * J[j, k]
            + U[k, i] * J[i, j]
            - U[j, i] * J[i, k]
            + U[k, j] * J[j, j]
            - U[j, k] * J[k, k]
            for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1))
        )
    )


# In free fall there is no ZMP. With at least this share of the weight as ground force it is far outside any sole, and finite.
LEAST_LOAD = 1e-3


def zmp_of_wrench(wrench: Wrench, height: float, weight: float) -> SX:
    """Return the point on flat ground about which the moment of the ground on the robot has no horizontal component.

    It is the horizontal offset (2,) [m] from the point of the wrench, which is at a height [m] above the ground; weight [N].

    Source:
        Gupta, Pratihar, Deb (2023), eqs. (19), (20), with the sign of g made physical and the rotational term as the rate
        of angular momentum about y (in x) and about x (in y); (B.1) to (B.3) in docs/model.
    """
    (fx, fy, _), (nx, ny, _) = ca.vertsplit(wrench.force), ca.vertsplit(wrench.moment)
    load = ground_load(wrench, weight)
    return ca.vertcat(-(ny + height * fx) / load, (nx - height * fy) / load)  # (eqs. 19, 20)


def ground_load(wrench: Wrench, weight: float) -> SX:
    """Return the vertical force of the ground [N], at least ``LEAST_LOAD`` of the robot's weight [N]."""
    return ca.fmax(wrench.force[2], LEAST_LOAD * weight)


def shift_down(wrench: Wrench, height: float) -> SX:
    """Return the wrench (6,) about the point a height [m] below its reference point [N, Nm]."""
    return ca.vertcat(wrench.force, wrench.moment + ca.cross(SX(DM([0.0, 0.0, height])), wrench.force))


def combine_zmps(zmps: Sequence[SX], ground_loads: Sequence[SX]) -> SX:
    """Return the ZMP (2,) of feet on the same flat ground, from their ZMPs (2,) in the world [m] and vertical forces [N].

    Source:
        Gupta, Pratihar, Deb (2023), eqs. (30), (31); (B.4) in docs/model.
    """
    moment = sum((p * f for p, f in zip(zmps, ground_loads, strict=True)), SX(2, 1))
    return moment / sum(ground_loads, SX(0))  # (eqs. 30, 31)


def zmp_of_point_masses(masses: DM, p: SX, a: SX, gravity: float, *, static_load: bool = False) -> SX:
    """Return the zero-moment point (2,) [m] of point masses (N,) [kg] on flat ground at height zero.

    Takes their positions (3, N) [m], z up, and accelerations without gravity [m/s^2]. With ``static_load`` the ground's load
    is the weight, as in eq. (14): the moment about that point vanishes only without vertical acceleration of the centre of mass.

    Source:
        Goswami, Vadakkepat, Phung (2008), eqs. (12)-(14); (B.5) and (W.4) in docs/model.
    """
    weight = gravity * float(ca.sum1(masses))
    vertical = gravity + a[2, :]
    load = weight if static_load else ca.fmax(vertical @ masses, LEAST_LOAD * weight)
    return (p[:2, :] * ca.repmat(vertical, 2, 1) - a[:2, :] * ca.repmat(p[2, :], 2, 1)) @ masses / load  # (eq. 14)
