"""A robot's links: masses and inertias; trees from any fixed link, locked, turned or reversed joints, mirror images of joints."""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any, NamedTuple, Self

import numpy as np

from nlp_gait.errors import InputError, RobotDataError
from nlp_gait.robots.robot import Joint, Link, Robot, Vector

Array = np.ndarray[Any, np.dtype[np.float64]]

# A tensor about the joint gives ratios below 1 (see ``compute_joint_ratio``); printed digits may increase one by some percent.
GREATEST_JOINT_RATIO = 1.05
# Above one half, the joint is at least as far from the centre of mass as the matter is spread, if the tensor is about the joint.
FAR_RATIO = 0.5
LEAST_LINKS = 5  # fewer links than this prove nothing
LEAST_MOMENT = 1e-30  # keeps the ratio of a point mass finite [kg m^2]


class Mass(NamedTuple):
    """Mass and its distribution, whether or not a rigid body can have them."""

    mass_kg: float
    com_m: Array  # (3,) centre of mass
    tensor_kgm2: Array  # (3, 3) inertia about the centre of mass

    @classmethod
    def of_link(cls, link: Link) -> Self:
        """Return the mass of a link."""
        return cls(link.mass_kg, np.array(link.com_m), link.inertia_matrix)

    def to_link(self, name: str) -> Link:
        """Return the mass as a link, which may be faulty."""
        moments = list_moments(self.tensor_kgm2)
        return Link(name=name, mass_kg=float(self.mass_kg), com_m=to_vector(self.com_m), inertia_com_kgm2=moments)

    def move(self, offset: Array) -> Self:
        """Return the mass in a frame from which its own is ``offset`` (3,) away [m]."""
        return self._replace(com_m=self.com_m + offset)

    def turn(self, rotation: Array) -> Self:
        """Return the mass along other axes, by a rotation (3, 3)."""
        return self._replace(com_m=rotation @ self.com_m, tensor_kgm2=rotation @ self.tensor_kgm2 @ rotation.T)


def combine_masses(masses: Sequence[Mass]) -> Mass:
    """Return several masses in one frame as one; without any mass, the centre is that of the first."""
    mass = sum(body.mass_kg for body in masses)
    com = sum((body.mass_kg * body.com_m for body in masses), np.zeros(3)) / mass if mass > 0.0 else masses[0].com_m
    tensor = sum(
        (body.tensor_kgm2 + compute_point_inertia(body.mass_kg, body.com_m - com) for body in masses), np.zeros((3, 3))
    )
    return Mass(mass, com, tensor)


def list_moments(matrix: Array) -> tuple[float, float, float, float, float, float]:
    """Return (ixx, iyy, izz, ixy, ixz, iyz) of a symmetric tensor (3, 3), as in ``Link``."""
    (ixx, ixy, ixz), (_, iyy, iyz), (_, _, izz) = matrix.tolist()
    return ixx, iyy, izz, ixy, ixz, iyz


def rotate(axis: Array, angle: float) -> Array:
    """Return the rotation (3, 3) about an axis (3,) by an angle [rad]."""
    k = np.cross(np.eye(3), axis)
    return np.asarray(np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k)


def compute_point_inertia(mass: float, offset: Array) -> Array:
    """Return the tensor (3, 3) of a point mass [kg] about a point at a distance ``offset`` (3,) [m]."""
    tensor: Array = mass * (offset @ offset * np.eye(3) - np.outer(offset, offset))
    return tensor


def compute_joint_ratio(link: Link) -> float:
    """Return the squared distance of joint and centre of mass, in units of the matter's spread along that direction.

    With s for a tensor about the centre of mass, the same link described by the tensor about its joint has s / (1 + s), which
    is below 1. A uniform rod held at its end has s = 3, and 0.75 with the wrong tensor.
    """
    inertia, com = link.inertia_matrix, np.array(link.com_m)
    second_moments, axes = np.linalg.eigh(np.trace(inertia) / 2 * np.eye(3) - inertia)
    return float(link.mass_kg * np.sum((com @ axes) ** 2 / np.maximum(second_moments, LEAST_MOMENT)))


def check_inertias(robot: str, links: Sequence[Link]) -> None:
    """Refuse tensors that seem to refer to the joints.

    Most links have ratios above 1. If none of at least five links does, and most are above one half, all tensors were probably
    taken about the joints: raises RobotDataError. One wrong tensor among right ones is not found.
    """
    ratios = {link.name: compute_joint_ratio(link) for link in links}
    far = sorted((name for name in ratios if ratios[name] > FAR_RATIO), key=lambda name: -ratios[name])
    if len(ratios) < LEAST_LINKS or max(ratios.values()) > GREATEST_JOINT_RATIO or 2 * len(far) < len(ratios):
        return
    listed = ", ".join(f"{name} {ratios[name]:.2f}" for name in far[:3])
    raise RobotDataError(
        f"robot {robot!r}: the inertia tensors look as if taken about the joints, not about the centres of mass: none of its "
        f"{len(ratios)} links is farther from its joint than its matter is spread (ratios {listed}, ...; a rod has 3, by the "
        'wrong tensor 0.75). If so, write "inertia_about": "joint" into the robot file and they are shifted; if they are '
        'right, write "inertia_about": "com"'
    )


def shift_to_com(link: Link) -> Link:
    """Return the link whose tensor was taken about its joint, shifted to the centre of mass."""
    about_com = link.inertia_matrix - compute_point_inertia(link.mass_kg, np.array(link.com_m))
    return replace(link, inertia_com_kgm2=list_moments(about_com))


MIRROR_M, MIRROR_COSINE = 2e-3, 0.999  # mirrored axes and places agree to this, and directions to this cosine
LEAST_SINE = 0.1  # least sine of the angle between axes that must not be parallel


@dataclass(frozen=True, slots=True, kw_only=True)
class TreeBody:
    """Link in a tree from the fixed link; its reference point is the joint to its parent in the tree."""

    link: Link  # mass and inertia, in link axes
    parent: int  # index of the parent body; -1 for the fixed one
    joint: Joint | None  # joint to the parent; None for the fixed one
    direction: int  # +1 if the joint's child link is this body's, else -1
    offset_m: Vector  # from the parent's reference point to this one, in the parent's axes [m]
    com_offset_m: Vector  # from the reference point to the centre of mass, in link axes [m]


def make_tree(robot: Robot, fixed_link: str, joints: Collection[str] | None = None) -> tuple[TreeBody, ...]:
    """Return the bodies from the fixed link outwards, parents before children, connected by some joints (None: by all).

    The fixed link's reference point is its frame's origin. Raises InputError for an unknown link, UnknownNameError for a joint.
    """
    if fixed_link not in robot.links:
        raise InputError(f"robot {robot.name!r} has no link {fixed_link!r}")
    neighbours: dict[str, list[tuple[str, Joint]]] = {name: [] for name in robot.links}
    for between in robot.joints.values() if joints is None else map(robot.joint, joints):
        neighbours[between.parent].append((between.child, between))
        neighbours[between.child].append((between.parent, between))
    bodies: list[TreeBody] = []
    waiting: list[tuple[str, int, Joint | None, Vector]] = [(fixed_link, -1, None, (0.0, 0.0, 0.0))]
    while waiting:
        name, parent, joint, parent_reference = waiting.pop()
        forward = joint is None or joint.child == name
        # The joint's centre lies at its origin in the parent's frame and at zero in the child's.
        centre_in_parent = (0.0, 0.0, 0.0) if joint is None or not forward else joint.origin_m
        reference = (0.0, 0.0, 0.0) if joint is None or forward else joint.origin_m
        link = robot.links[name]
        body = TreeBody(
            link=link,
            parent=parent,
            joint=joint,
            direction=1 if forward else -1,
            offset_m=to_vector(np.subtract(centre_in_parent, parent_reference)),
            com_offset_m=to_vector(np.subtract(link.com_m, reference)),
        )
        bodies.append(body)
        index = len(bodies) - 1
        waiting += [(to, index, via, reference) for to, via in reversed(neighbours[name]) if via is not joint]
    return tuple(bodies)


def weld(robot: Robot, joints: Collection[str]) -> Robot:
    """Return the robot with some joints locked at zero: their child links become part of the parents."""
    links, remaining = dict(robot.links), dict(robot.joints)
    # From the leaves inwards, so that a welded child already contains its own welded children.
    for name in sorted(joints, key=lambda name: -len(robot.path_to_root(robot.joint(name).child))):
        weld_child(links, remaining, name)
    return replace(robot, links=links, joints=remaining)


def weld_child(links: dict[str, Link], joints: dict[str, Joint], name: str) -> None:
    """Lock a joint at zero: its child link becomes part of the parent, and is removed like the joint."""
    joint = joints.pop(name)
    child = Mass.of_link(links.pop(joint.child)).move(np.array(joint.origin_m))
    links[joint.parent] = combine_masses([Mass.of_link(links[joint.parent]), child]).to_link(joint.parent)
    for joint_below in [j for j in joints.values() if j.parent == joint.child]:
        origin_m = to_vector(np.add(joint.origin_m, joint_below.origin_m))
        joints[joint_below.name] = replace(joint_below, parent=joint.parent, origin_m=origin_m)


def turn_parts(links: dict[str, Link], joints: dict[str, Joint], rotation: Array) -> None:
    """Express all links and joints along other axes, by a rotation (3, 3)."""
    for name, link in links.items():
        links[name] = Mass.of_link(link).turn(rotation).to_link(name)
    for name, joint in joints.items():
        origin, axis = (to_vector(rotation @ np.array(vector)) for vector in (joint.origin_m, joint.axis))
        joints[name] = replace(joint, origin_m=origin, axis=axis)


def move_root(root: str, links: dict[str, Link], joints: dict[str, Joint], offset: Array) -> None:
    """Move the origin of the root by an offset (3,) [m]; its body and its joints stay where they are."""
    links[root] = replace(links[root], com_m=to_vector(links[root].com_m - offset))
    for name, joint in joints.items():
        if joint.parent == root:
            joints[name] = replace(joint, origin_m=to_vector(joint.origin_m - offset))


def move_along_axis(links: dict[str, Link], joints: dict[str, Joint], name: str, offset: Array) -> None:
    """Move the origin of a joint, and with it its child's frame, along its axis by an offset (3,) [m]; no body moves."""
    joint = joints[name]
    joints[name] = replace(joint, origin_m=to_vector(joint.origin_m + offset))
    move_root(joint.child, links, joints, offset)


def pose_robot(robot: Robot, angles: Mapping[str, float]) -> Robot:
    """Return the robot with joints turned by angles [rad], which then count as zero; all links get the root's axes there."""
    turns = {robot.root: np.eye(3)}
    joints: dict[str, Joint] = {}
    links = dict(robot.links)
    waiting = [joint for joint in robot.joints.values() if joint.parent == robot.root]
    while waiting:
        joint = waiting.pop()
        before, angle = turns[joint.parent], angles.get(joint.name, 0.0)
        turns[joint.child] = before @ rotate(np.array(joint.axis), angle) if angle else before
        joints[joint.name] = _turn_joint(joint, before, angle)
        turn, link = turns[joint.child], links[joint.child]
        if not np.array_equal(turn, np.eye(3)):
            links[joint.child] = Mass.of_link(link).turn(turn).to_link(link.name)
        waiting += [joint_below for joint_below in robot.joints.values() if joint_below.parent == joint.child]
    return replace(robot, links=links, joints={name: joints[name] for name in robot.joints})


def _turn_joint(joint: Joint, turn: np.ndarray, angle: float) -> Joint:
    """Return a joint whose parent was turned, with its angle counted from another zero."""
    if not angle and np.array_equal(turn, np.eye(3)):
        return joint
    axis = turn @ np.array(joint.axis)
    (low, high), (plan_low, plan_high) = joint.limits_rad, joint.planning_limits_rad
    return replace(
        joint,
        origin_m=to_vector(turn @ np.array(joint.origin_m)),
        axis=to_vector(axis / np.linalg.norm(axis)),
        limits_rad=(low - angle, high - angle),
        planning_limits_rad=(plan_low - angle, plan_high - angle),
    )


def to_vector(values: np.ndarray) -> Vector:
    """Return an array (3,) as a tuple."""
    x, y, z = values.tolist()
    return x, y, z


def make_point_masses(robot: Robot) -> Robot:
    """Return the robot with every link's inertia about its centre of mass set to zero."""
    links = {name: replace(link, inertia_com_kgm2=(0.0,) * 6) for name, link in robot.links.items()}
    return replace(robot, links=links)


def find_partner(name: str) -> str:
    """Return the joint on the other side by name, LKneePitch for RKneePitch; a joint of neither side is its own partner."""
    swapped = {"L": "R", "R": "L"}.get(name[0])
    return swapped + name[1:] if swapped and name[1:2].isupper() else name


def find_partners(robot: Robot) -> Mapping[str, str]:
    """Return the mirror image of every joint: of the legs by their order from the foot, because names mislead, else by name."""
    left, right = ([joint.name for joint in robot.path_to_root(robot.feet[side].link)] for side in ("left", "right"))
    images = {name: image if (image := find_partner(name)) in robot.joints else name for name in robot.joints}
    return {**images, **dict(zip(left, right, strict=False)), **dict(zip(right, left, strict=False))}


MIRROR = np.array([1.0, -1.0, 1.0])  # in the plane y = 0


def compare_axes(place: Array, axis: Array, other_place: Array, other_axis: Array) -> tuple[float, float]:
    """Return how far two lines (3,) are apart, at the first one's place [m], and the angle between them [rad]."""
    gap = np.linalg.norm(np.cross(other_place - place, other_axis))
    return float(gap), math.acos(min(1.0, abs(float(axis @ other_axis))))


def find_nearest_on_axis(place: Array, axis: Array, other_place: Array, other_axis: Array) -> Array:
    """Return the point (3,) of a line that is nearest to another one; its given place if they are nearly parallel."""
    normal = np.cross(axis, other_axis)
    if np.linalg.norm(normal) < LEAST_SINE:
        return place
    along = np.linalg.det([other_place - place, other_axis, normal]) / (normal @ normal)
    return np.asarray(place + along * axis)


def mirror_sign(robot: Robot, joint: str, image: str) -> float:
    """Return +1 if a joint and its image turn the same way in motions mirrored left to right, otherwise -1.

    A reflection at the plane y = 0 turns an axis (x, y, z) of rotation into (-x, y, -z). Raises UnknownNameError.
    """
    (x, y, z), image_axis = robot.joint(joint).axis, robot.joint(image).axis
    return 1.0 if -x * image_axis[0] + y * image_axis[1] - z * image_axis[2] > 0.0 else -1.0
