"""Inverse dynamics of a tree of bodies by the recursive Newton-Euler algorithm."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple

import casadi as ca
from casadi import DM, SX

from nlp_gait.robots.tree import Body, inertia_matrix
from nlp_gait.symbolic.kinematics import relative_rotation


class Wrench(NamedTuple):
    """Force [N] and moment about a reference point [Nm], each (3,)."""

    force: SX
    moment: SX


def newton_euler(
    tree: Sequence[Body],
    q: Mapping[str, SX],
    qd: Mapping[str, SX],
    qdd: Mapping[str, SX],
    gravity: float,
    shares: Mapping[str, SX] | None = None,
) -> tuple[dict[str, SX], Wrench]:
    """Joint torques of a tree whose first body stands still on the ground.

    Args:
        tree: bodies, parents first (see ``robots.tree.tree_from``).
        q: joint angles by name [rad]; an angle that is a constant costs no operations.
        qd: joint velocities by name [rad/s].
        qdd: joint accelerations by name [rad/s^2].
        gravity: magnitude, acting along -z [m/s^2].
        shares: factors on mass and inertia of links by name, for a link that two trees carry together.

    Returns:
        Torques by joint name [Nm], and the wrench of the ground on the first body about its reference point.

    Source:
        Gives the torques of Gupta, Pratihar, Deb (2023), eqs. (15)-(18); the recursion is that of Luh, Walker and Paul
        (1980), with each link seen from the joint through which it is reached.
    """
    rotations = [relative_rotation(body, q) for body in tree]
    forces, moments = _forward(tree, rotations, qd, qdd, gravity)
    for i, body in enumerate(tree):
        if shares is not None and body.link.name in shares:  # force and moment are linear in mass and inertia
            forces[i] *= shares[body.link.name]
            moments[i] *= shares[body.link.name]
    torques: dict[str, SX] = {}
    for i in range(len(tree) - 1, 0, -1):
        body = tree[i]
        assert body.joint is not None  # only the first body has none; for the type checker
        torques[body.joint.name] = body.direction * ca.dot(DM(body.joint.axis), moments[i])
        force = rotations[i] @ forces[i]
        moment = rotations[i] @ moments[i]
        forces[body.parent] += force
        moments[body.parent] += moment + _cross(DM(body.offset_m), force)
    return torques, Wrench(forces[0], moments[0])


def _forward(
    tree: Sequence[Body], rotations: Sequence[SX], qd: Mapping[str, SX], qdd: Mapping[str, SX], gravity: float
) -> tuple[list[SX], list[SX]]:
    """Force and moment that each body's own motion asks for, about its reference point, in its axes."""
    spins: list[SX] = []
    spin_rates: list[SX] = []
    accelerations: list[SX] = []
    forces: list[SX] = []
    moments: list[SX] = []
    for body, rotation in zip(tree, rotations, strict=True):
        if body.joint is None:
            spin, spin_rate = SX(3, 1), SX(3, 1)
            acceleration = SX(DM([0, 0, gravity]))  # gravity as an upward acceleration of the ground
        else:
            axis = body.direction * DM(body.joint.axis)
            rate, rate_rate = axis * qd[body.joint.name], axis * qdd[body.joint.name]
            carried = rotation.T @ spins[body.parent]
            spin = carried + rate
            spin_rate = rotation.T @ spin_rates[body.parent] + _cross(carried, rate) + rate_rate
            acceleration = rotation.T @ _at_offset(
                accelerations[body.parent], spins[body.parent], spin_rates[body.parent], DM(body.offset_m)
            )
        com = DM(body.com_offset_m)
        inertia = DM(inertia_matrix(body.link))
        force = body.link.mass_kg * _at_offset(acceleration, spin, spin_rate, com)
        spins.append(spin)
        spin_rates.append(spin_rate)
        accelerations.append(acceleration)
        forces.append(force)
        moments.append(inertia @ spin_rate + _cross(spin, inertia @ spin) + _cross(com, force))
    return forces, moments


def _at_offset(acceleration: SX, spin: SX, spin_rate: SX, offset: DM) -> SX:
    """Acceleration of a point fixed to a body, at an offset from its reference point."""
    return acceleration + _cross(spin_rate, offset) + _cross(spin, _cross(spin, offset))


def _cross(a: SX | DM, b: SX | DM) -> SX:
    return ca.cross(SX(a), SX(b))
