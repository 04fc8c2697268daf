"""A robot's links as seen from any link held fixed, for example the support foot."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace

import numpy as np

from nlp_gait.errors import InputError
from nlp_gait.robots.robot import Joint, Link, Robot, Vector


@dataclass(frozen=True, slots=True, kw_only=True)
class Body:
    """Link in a tree that starts at the fixed link; its reference point is the joint through which it is reached.

    Attributes:
        link: mass and inertia, in link axes.
        parent: index of the body before it; -1 for the fixed one.
        joint: joint to that body; None for the fixed one.
        direction: +1 if the joint is passed from its parent to its child link, else -1.
        offset_m: from the parent's reference point to this one, in the parent's axes [m].
        com_offset_m: from the reference point to the centre of mass, in link axes [m].
        armature_kgm2: inertia of the rotor at the joint, if the robot's dynamics take it into account [kg m^2].
    """

    link: Link
    parent: int
    joint: Joint | None
    direction: int
    offset_m: Vector
    com_offset_m: Vector
    armature_kgm2: float = 0.0


def tree_from(robot: Robot, fixed_link: str, joints: Collection[str] | None = None) -> tuple[Body, ...]:
    """Bodies ordered from the fixed link outwards, parents before children.

    The fixed link's reference point is its frame's origin.

    Args:
        robot: whose links they are.
        fixed_link: name of the first body's link.
        joints: pass through these only, for a part of the robot; None means all.
    """
    if fixed_link not in robot.links:
        raise InputError(f"robot {robot.name!r} has no link {fixed_link!r}")
    neighbours: dict[str, list[tuple[str, Joint]]] = {name: [] for name in robot.links}
    for passage in robot.joints.values() if joints is None else map(robot.joint, joints):
        neighbours[passage.parent].append((passage.child, passage))
        neighbours[passage.child].append((passage.parent, passage))
    bodies: list[Body] = []
    waiting: list[tuple[str, int, Joint | None, Vector]] = [(fixed_link, -1, None, (0.0, 0.0, 0.0))]
    while waiting:
        name, parent, joint, parent_reference = waiting.pop()
        forward = joint is None or joint.child == name
        # The joint's centre lies at its origin in the parent's frame and at zero in the child's.
        centre_in_parent = (0.0, 0.0, 0.0) if joint is None or not forward else joint.origin_m
        reference = (0.0, 0.0, 0.0) if joint is None or forward else joint.origin_m
        link = robot.links[name]
        bodies.append(
            Body(
                link=link,
                parent=parent,
                joint=joint,
                direction=1 if forward else -1,
                offset_m=_minus(centre_in_parent, parent_reference),
                com_offset_m=_minus(link.com_m, reference),
                armature_kgm2=0.0 if joint is None else robot.armatures_kgm2.get(joint.name, 0.0),
            )
        )
        index = len(bodies) - 1
        waiting += [(to, index, via, reference) for to, via in reversed(neighbours[name]) if via is not joint]
    return tuple(bodies)


def weld(robot: Robot, joints: Collection[str]) -> Robot:
    """The same robot with some joints locked at zero: their child links become one with the parents.

    Masses add up, centres of mass and inertias are combined by the parallel-axis theorem.
    """
    links = dict(robot.links)
    kept = dict(robot.joints)
    # From the leaves inwards, so that a welded child already holds what was welded to it.
    by_depth = sorted(joints, key=lambda name: -len(robot.path_to_root(robot.joint(name).child)))
    for name in by_depth:
        joint = kept.pop(name)
        links[joint.parent] = _welded(links[joint.parent], links.pop(joint.child), joint.origin_m)
        for other in [j for j in kept.values() if j.parent == joint.child]:
            kept[other.name] = replace(other, parent=joint.parent, origin_m=plus(joint.origin_m, other.origin_m))
    return replace(robot, links=links, joints=kept)


def posed(robot: Robot, angles: Mapping[str, float]) -> Robot:
    """The same robot with some joints turned: where they stand then is zero, and all links get the root's axes there.

    Args:
        robot: to begin with; its feet must not turn.
        angles: by joint [rad].
    """
    turns = {robot.root: np.eye(3)}
    joints: dict[str, Joint] = {}
    links = dict(robot.links)
    waiting = [joint for joint in robot.joints.values() if joint.parent == robot.root]
    while waiting:
        joint = waiting.pop()
        before, angle = turns[joint.parent], angles.get(joint.name, 0.0)
        if angle:
            turns[joint.child] = before @ _rotation(joint.axis, angle)
        else:
            turns[joint.child] = before
        joints[joint.name] = _seen(joint, before, angle)
        links[joint.child] = _turned(links[joint.child], turns[joint.child])
        waiting += [other for other in robot.joints.values() if other.parent == joint.child]
    return replace(robot, links=links, joints={name: joints[name] for name in robot.joints})


def _rotation(axis: Vector, angle: float) -> np.ndarray:
    """(3, 3) rotation about a unit axis."""
    k = np.cross(np.eye(3), np.array(axis))
    turn: np.ndarray = np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k
    return turn


def _seen(joint: Joint, turn: np.ndarray, angle: float) -> Joint:
    """A joint whose parent was turned, counted from an angle of its own."""
    if not angle and np.array_equal(turn, np.eye(3)):
        return joint
    axis = turn @ np.array(joint.axis)
    (low, high), (plan_low, plan_high) = joint.limits_rad, joint.planning_limits_rad
    return replace(
        joint,
        origin_m=_vector(turn @ np.array(joint.origin_m)),
        axis=_vector(axis / np.linalg.norm(axis)),
        limits_rad=(low - angle, high - angle),
        planning_limits_rad=(plan_low - angle, plan_high - angle),
    )


def _turned(link: Link, turn: np.ndarray) -> Link:
    if np.array_equal(turn, np.eye(3)):
        return link
    tensor = inertia_moments(turn @ link.inertia_matrix @ turn.T)
    return replace(link, com_m=_vector(turn @ np.array(link.com_m)), inertia_com_kgm2=tensor)


def _vector(values: np.ndarray) -> Vector:
    x, y, z = values.tolist()
    return x, y, z


def reversed_joint(joint: Joint) -> Joint:
    """The same joint with its angle counted the other way round."""
    (low, high), (plan_low, plan_high) = joint.limits_rad, joint.planning_limits_rad
    x, y, z = joint.axis
    return replace(joint, axis=(-x, -y, -z), limits_rad=(-high, -low), planning_limits_rad=(-plan_high, -plan_low))


def point_masses(robot: Robot) -> Robot:
    """The same robot with every link's inertia about its centre of mass set to zero."""
    zero = (0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    links: Mapping[str, Link] = {n: replace(link, inertia_com_kgm2=zero) for n, link in robot.links.items()}
    return replace(robot, links=links)


def inertia_moments(matrix: np.ndarray) -> tuple[float, float, float, float, float, float]:
    """(ixx, iyy, izz, ixy, ixz, iyz) of a symmetric tensor (3, 3), as ``Link`` has them."""
    (ixx, ixy, ixz), (_, iyy, iyz), (_, _, izz) = matrix.tolist()
    return ixx, iyy, izz, ixy, ixz, iyz


def point_inertia(mass: float, offset: np.ndarray) -> np.ndarray:
    """(3, 3) tensor of a point mass [kg] about a point at a distance ``offset`` (3,) [m]."""
    tensor: np.ndarray = mass * (offset @ offset * np.eye(3) - np.outer(offset, offset))
    return tensor


def _welded(parent: Link, child: Link, origin: Vector) -> Link:
    mass = parent.mass_kg + child.mass_kg
    coms = [np.array(parent.com_m), np.array(child.com_m) + np.array(origin)]
    com = (parent.mass_kg * coms[0] + child.mass_kg * coms[1]) / mass
    inertia = np.zeros((3, 3))
    for link, c in zip((parent, child), coms, strict=True):
        inertia += link.inertia_matrix + point_inertia(link.mass_kg, c - com)
    x, y, z = com.tolist()
    return Link(name=parent.name, mass_kg=mass, com_m=(x, y, z), inertia_com_kgm2=inertia_moments(inertia))


def _minus(a: Vector, b: Vector) -> Vector:
    return plus(a, (-b[0], -b[1], -b[2]))


def plus(a: Vector, b: Vector) -> Vector:
    """Sum of two vectors."""
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])
