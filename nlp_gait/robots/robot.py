"""Frozen, validated data of a legged robot: links, joints, motors, feet."""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, fields
from functools import cached_property
from typing import Any

import numpy as np

from nlp_gait.errors import RobotDataError, unknown
from nlp_gait.files import convert_errors

Vector = tuple[float, float, float]

LONGEST_NAME = 100
LARGEST_NUMBER = 1e9  # in the unit of its field: above those of any robot, and its squares stay finite
TRIANGLE_TOLERANCE = 1e-6  # published tensors carry six digits: a rod's triangle equality may be missed by that much


def check_robot_name(name: str, where: str) -> None:
    """Raise ValueError for a name that is empty, too long, or not printable."""
    if not name or len(name) > LONGEST_NAME or not name.isprintable():
        raise ValueError(f"{where}: a name has 1 to {LONGEST_NAME} printable characters, got {name[:LONGEST_NAME]!r}")


def check_numbers(owner: str, record: Any, positive: Collection[str], infinite: Collection[str] = ()) -> None:
    """Raise RobotDataError for a number of a dataclass that is not finite, not within ``LARGEST_NUMBER``, or not positive.

    Those in ``infinite`` may be infinite.
    """
    for item in fields(record):
        value = getattr(record, item.name)
        if item.name in infinite and value == math.inf:
            continue
        if item.name in positive and not value > 0.0:  # NaN fails too
            raise RobotDataError(f"{owner}: {item.name} must be > 0, got {value}")
        if isinstance(value, (int, float, tuple)) and not are_plausible(value):
            raise RobotDataError(
                f"{owner}: {item.name} must be finite numbers within {LARGEST_NUMBER:g}, got {value!r}"
            )


def are_plausible(numbers: Any) -> bool:
    """Return whether all numbers of a sequence or array of any depth are finite and within ``LARGEST_NUMBER``."""
    return bool((np.abs(numbers) <= LARGEST_NUMBER).all())  # NaN is not


def make_unit_axis(axis: Vector) -> Vector:
    """Return a unit vector of rounded digits (0.7071) as an exact one, and any other vector as it is."""
    x, y, z = axis
    length = math.hypot(*axis)
    return (x / length, y / length, z / length) if 0.99 < length < 1.01 else axis


# Smaller moments are placeholders, without influence on any motion: a sphere of 1 mg and 1 mm has 4e-13.
NEGLIGIBLE_KGM2 = 1e-12


@dataclass(frozen=True, slots=True, kw_only=True)
class Link:
    """Rigid link; a file's may be faulty until it is part of a ``Robot``."""

    name: str
    mass_kg: float
    com_m: Vector  #: centre of mass in the link frame [m]
    #: (ixx, iyy, izz, ixy, ixz, iyz) about the centre of mass, link axes [kg m^2]
    inertia_com_kgm2: tuple[float, float, float, float, float, float]

    def check(self) -> None:
        """Raise RobotDataError unless a rigid body can have this mass and inertia."""
        owner = f"link {self.name!r}"
        check_numbers(owner, self, positive=("mass_kg",))
        low, middle, high = np.linalg.eigvalsh(self.inertia_matrix)
        if low < -max(TRIANGLE_TOLERANCE * high, NEGLIGIBLE_KGM2) or self.is_unbalanced:
            raise RobotDataError(
                f"{owner}: inertia_com_kgm2 has principal moments {low:.3e}, {middle:.3e}, {high:.3e} kg m^2; a rigid body "
                "needs all >= 0 and none above the sum of the other two. Tensors about any point satisfy that: is a number "
                "mistyped, or was the tensor shifted to the centre of mass twice?"
            )

    @property
    def is_unbalanced(self) -> bool:
        """Whether a principal moment is above the sum of the other two, which no rigid body has."""
        low, middle, high = np.linalg.eigvalsh(self.inertia_matrix)
        return bool(low + middle < high - max(TRIANGLE_TOLERANCE * high, NEGLIGIBLE_KGM2))

    @property
    def inertia_matrix(self) -> np.ndarray:
        """(3, 3) inertia about the centre of mass, link axes [kg m^2]."""
        ixx, iyy, izz, ixy, ixz, iyz = self.inertia_com_kgm2
        return np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]], dtype=float)


@dataclass(frozen=True, slots=True, kw_only=True)
class Motor:
    """Motor and gear of a joint, with the torques of its data sheet at the motor's shaft."""

    make: str
    gear_ratio: float
    stall_torque_mNm: float
    continuous_torque_mNm: float

    def __post_init__(self) -> None:
        positive = ("gear_ratio", "stall_torque_mNm", "continuous_torque_mNm")
        check_numbers(f"motor {self.make!r}", self, positive)

    @property
    def stall_torque_Nm(self) -> float:
        """Torque at the joint with a lossless gear [Nm]."""
        return self.gear_ratio * self.stall_torque_mNm / 1000.0

    @property
    def continuous_torque_Nm(self) -> float:
        """Torque at the joint with a lossless gear [Nm]."""
        return self.gear_ratio * self.continuous_torque_mNm / 1000.0


ANY_ANGLE = (-math.pi, math.pi)  # limits of a joint whose file states none [rad]
POSITIVE_LIMITS = ("velocity_limit_rad_s", "torque_limit_Nm", "nominal_torque_Nm")  # of a joint


@dataclass(frozen=True, slots=True, kw_only=True)
class Joint:
    """Revolute joint; at q = 0 the child frame is at its origin with the parent's axes. A file's may be faulty, as a link."""

    name: str
    parent: str
    child: str
    origin_m: Vector  #: joint centre in the parent frame [m]
    axis: Vector  #: unit vector of positive rotation
    limits_rad: tuple[float, float]  #: (lower, upper) mechanical limits [rad]
    #: (lower, upper) limits of planned gaits [rad]; by default the mechanical ones
    planning_limits_rad: tuple[float, float] = ()  # type: ignore[assignment]
    velocity_limit_rad_s: float  #: infinite: no limit
    torque_limit_Nm: float  #: infinite: no limit
    armature_kgm2: float = 0.0  #: inertia of the rotor at the joint
    damping_Nms_rad: float = 0.0  #: friction torque per rate
    friction_Nm: float = 0.0  #: dry friction; in simulations only
    #: torque by which drives of a joint without a limit are as stiff as those of one with this limit
    nominal_torque_Nm: float = math.inf
    motor: Motor | None = None

    def __post_init__(self) -> None:
        if not self.planning_limits_rad:
            object.__setattr__(self, "planning_limits_rad", self.limits_rad)

    def check(self) -> None:
        """Raise RobotDataError for an axis that is no unit vector, or limits that are not allowed."""
        owner = f"joint {self.name!r}"
        check_numbers(owner, self, POSITIVE_LIMITS, POSITIVE_LIMITS)
        for name in ("armature_kgm2", "damping_Nms_rad", "friction_Nm"):
            if getattr(self, name) < 0.0:
                raise RobotDataError(f"{owner}: {name} must be >= 0, got {getattr(self, name)}")
        if abs(math.hypot(*self.axis) - 1.0) > 1e-9:
            raise RobotDataError(f"{owner}: axis must be a unit vector, got {self.axis}")
        for name, (low, high) in (("limits_rad", self.limits_rad), ("planning_limits_rad", self.planning_limits_rad)):
            if not low < high:
                raise RobotDataError(f"{owner}: {name} must be ordered (lower < upper), got [{low}, {high}]")


def rank_joints(links: Collection[str], joints: Sequence[Any]) -> tuple[str, list[Any]]:
    """Return the root of links, and the joints (of any kind) from there outwards; raises ValueError unless they are a tree."""
    children = set[str]()
    for joint in joints:
        for end in (joint.parent, joint.child):
            if end not in links:
                raise ValueError(f"joint {joint.name!r}: link {end!r} does not exist")
        if joint.child in children:
            raise ValueError(f"joint {joint.name!r}: link {joint.child!r} already has a parent")
        children.add(joint.child)
    roots = [name for name in links if name not in children]
    if len(roots) != 1:
        raise ValueError(f"exactly one link must have no parent, got {', '.join(roots) or 'none'}")
    reached, ordered, waiting = {roots[0]}, list[Any](), joints
    while waiting:
        ready = [joint for joint in waiting if joint.parent in reached]
        if not ready:
            raise ValueError(f"joint {waiting[0].name!r} is part of a ring of joints")
        ordered += ready
        reached.update(joint.child for joint in ready)
        waiting = [joint for joint in waiting if joint.child not in reached]
    return roots[0], ordered


@dataclass(frozen=True, slots=True, kw_only=True)
class Foot:
    """Flat sole under an ankle; distances are from the ankle's projection on the ground."""

    link: str  #: the foot's link, whose frame is at the ankle
    ankle_height_m: float  #: ankle above the sole [m]
    front_m: float  #: extent of the sole rectangle forward [m], likewise ``back_m``, ``left_m``, ``right_m``
    back_m: float
    left_m: float
    right_m: float

    def __post_init__(self) -> None:
        owner = f"foot {self.link!r}"
        check_numbers(owner, self, positive=("front_m", "left_m", "right_m"))
        for name in ("ankle_height_m", "back_m"):
            if getattr(self, name) < 0.0:
                raise RobotDataError(f"{owner}: {name} must be >= 0, got {getattr(self, name)}")


@dataclass(frozen=True, kw_only=True, eq=False)
class Robot:
    """Tree of links joined by revolute joints; raises RobotDataError unless they are one, and free of faults."""

    name: str  #: for example ``"nao-v5"``
    description: str  #: one sentence
    sources: Mapping[str, str]  #: origin of each group of numbers
    root: str  #: link with no parent (the torso)
    links: Mapping[str, Link]  #: by name
    joints: Mapping[str, Joint]  #: by name
    feet: Mapping[str, Foot]  #: ``"left"`` and ``"right"``
    #: soles beyond a toe joint, by side; the frame of a toe's link is at that joint
    toes: Mapping[str, Foot] = field(default_factory=dict)
    #: angles of joints that a gait does not move; by default zero, or the nearest limit
    posture_rad: Mapping[str, float] = field(default_factory=dict)
    heat_loss_W_per_Nm2: float | None = None  #: heat of the motors per squared torque, if the robot's file states it
    #: by link, why the joint to it, such as a coupled one, cannot be part of a humanoid's leg, in words
    unusable: Mapping[str, str] = field(default_factory=dict)
    notes: tuple[str, ...] = ()  #: what was inferred or changed when the robot was read; a sentence each

    def __post_init__(self) -> None:
        pieces: tuple[Link | Joint, ...] = (*self.links.values(), *self.joints.values())
        for piece in pieces:
            piece.check()
        with convert_errors(f"robot {self.name!r}", RobotDataError):
            root, _ = rank_joints(self.links, list(self.joints.values()))
        if root != self.root:
            raise RobotDataError(f"robot {self.name!r}: root {self.root!r} is not the link without a parent, {root!r}")
        for side in ("left", "right"):
            if side not in self.feet or self.feet[side].link not in self.links:
                raise RobotDataError(f"robot {self.name!r}: foot {side!r} is missing or names no link")
        for side, toe in self.toes.items():
            if side not in self.feet or toe.link not in self.links:
                raise RobotDataError(f"robot {self.name!r}: toe {side!r} belongs to no foot or names no link")

    @cached_property
    def soles(self) -> Mapping[str, Foot]:
        """Feet and toes by link."""
        return {foot.link: foot for feet in (self.feet, self.toes) for foot in feet.values()}

    @cached_property
    def mass_kg(self) -> float:
        """Total mass [kg]."""
        return sum(link.mass_kg for link in self.links.values())

    @cached_property
    def joint_to(self) -> Mapping[str, Joint]:
        """Joint to each link except the root."""
        return {joint.child: joint for joint in self.joints.values()}

    def joint(self, name: str) -> Joint:
        """Return a joint by name; raises UnknownNameError."""
        if name not in self.joints:
            raise unknown(f"joint of robot {self.name}", name, self.joints)
        return self.joints[name]

    def path_to_root(self, link: str) -> tuple[Joint, ...]:
        """Return the joints from a link up to the root, in that order."""
        path: list[Joint] = []
        below = link
        while below != self.root:
            path.append(self.joint_to[below])
            below = path[-1].parent
        return tuple(path)
