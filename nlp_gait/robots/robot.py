"""Frozen, validated records of a legged robot: links, joints, feet."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np

from nlp_gait.errors import RobotDataError, unknown
from nlp_gait.robots.fields import check_numbers

Vector = tuple[float, float, float]

# Published tensors carry six digits: a rod's triangle equality may be missed by that much.
TRIANGLE_TOLERANCE = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class Link:
    """Rigid link.

    Attributes:
        name: link name.
        mass_kg: mass [kg].
        com_m: centre of mass in the link frame [m].
        inertia_com_kgm2: (ixx, iyy, izz, ixy, ixz, iyz) about the centre of mass, link axes [kg m^2].
    """

    name: str
    mass_kg: float
    com_m: Vector
    inertia_com_kgm2: tuple[float, float, float, float, float, float]

    def __post_init__(self) -> None:
        """Refuse what no rigid body can have."""
        owner = f"link {self.name!r}"
        check_numbers(owner, self, positive=("mass_kg",))
        low, middle, high = np.linalg.eigvalsh(self.inertia_matrix)
        slack = TRIANGLE_TOLERANCE * high
        if low < -slack or low + middle < high - slack:
            raise RobotDataError(
                f"{owner}: inertia_com_kgm2 has principal moments {low:.3e}, {middle:.3e}, {high:.3e} kg m^2; a rigid body "
                "needs all >= 0 and none above the sum of the other two. A tensor about the joint origin in place of "
                "the centre of mass is the usual cause: subtract m (c.c I - c c^T)"
            )

    @property
    def inertia_matrix(self) -> np.ndarray:
        """(3, 3) inertia about the centre of mass, link axes [kg m^2]."""
        ixx, iyy, izz, ixy, ixz, iyz = self.inertia_com_kgm2
        return np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]])


@dataclass(frozen=True, slots=True, kw_only=True)
class Motor:
    """Motor and gear of a joint (data-sheet values at the motor shaft); the rotor's inertia if it is known."""

    make: str
    gear_ratio: float
    no_load_rpm: float
    stall_torque_mNm: float
    continuous_torque_mNm: float
    rotor_inertia_gcm2: float | None = None

    def __post_init__(self) -> None:
        """All ratings are positive."""
        ratings = ["gear_ratio", "no_load_rpm", "stall_torque_mNm", "continuous_torque_mNm"]
        known = ratings if self.rotor_inertia_gcm2 is None else [*ratings, "rotor_inertia_gcm2"]
        check_numbers(f"motor {self.make!r}", self, positive=known)

    @property
    def reflected_inertia_kgm2(self) -> float | None:
        """Of the rotor at the joint: it turns as many times faster as the gear's ratio, which counts twice [kg m^2]."""
        return None if self.rotor_inertia_gcm2 is None else self.gear_ratio**2 * self.rotor_inertia_gcm2 * 1e-7

    @property
    def stall_torque_Nm(self) -> float:
        """At the joint, the gear without loss [Nm]."""
        return self.gear_ratio * self.stall_torque_mNm / 1000.0

    @property
    def continuous_torque_Nm(self) -> float:
        """At the joint, the gear without loss [Nm]."""
        return self.gear_ratio * self.continuous_torque_mNm / 1000.0

    @property
    def no_load_rad_s(self) -> float:
        """At the joint [rad/s]."""
        return self.no_load_rpm * 2.0 * math.pi / 60.0 / self.gear_ratio

    @property
    def heat_W_per_Nm2(self) -> float:
        """Heat of the winding for each squared torque at the joint, R / (k_t gear)^2 [W/(Nm)^2].

        With torque k_t I, stall torque k_t V / R and no-load speed V / k_t that is no-load speed / stall torque, at the joint:
        the voltage V drops out. Friction, and the winding's growing resistance when it is warm, are left out.
        """
        return self.no_load_rad_s / self.stall_torque_Nm


@dataclass(frozen=True, slots=True, kw_only=True)
class Joint:
    """Revolute joint; the child frame stands at its origin with the parent's axes when q = 0.

    Attributes:
        name: joint name.
        parent: parent link.
        child: child link.
        origin_m: joint centre in the parent frame [m].
        axis: unit vector of positive rotation.
        limits_rad: (lower, upper) mechanical limits [rad].
        planning_limits_rad: (lower, upper) that a gait is planned within [rad]; the mechanical ones if none are stated.
        velocity_limit_rad_s: [rad/s].
        torque_limit_Nm: [Nm].
        motor: motor and gear, if known.
    """

    name: str
    parent: str
    child: str
    origin_m: Vector
    axis: Vector
    limits_rad: tuple[float, float]
    planning_limits_rad: tuple[float, float]
    velocity_limit_rad_s: float
    torque_limit_Nm: float
    motor: Motor | None = None

    def __post_init__(self) -> None:
        """Unit axis, ordered limits."""
        owner = f"joint {self.name!r}"
        check_numbers(owner, self, positive=("velocity_limit_rad_s", "torque_limit_Nm"))
        if abs(math.hypot(*self.axis) - 1.0) > 1e-9:
            raise RobotDataError(f"{owner}: axis must be a unit vector, got {self.axis}")
        for name, (low, high) in (("limits_rad", self.limits_rad), ("planning_limits_rad", self.planning_limits_rad)):
            if not low < high:
                raise RobotDataError(f"{owner}: {name} must be ordered (lower < upper), got [{low}, {high}]")


@dataclass(frozen=True, slots=True, kw_only=True)
class Foot:
    """Flat sole under an ankle; distances from the ankle's projection on the ground.

    Attributes:
        link: the foot's link, whose frame stands at the ankle.
        ankle_height_m: ankle above the sole [m].
        front_m: extent of the sole rectangle forward [m], likewise ``back_m``, ``left_m``, ``right_m``.
        sole_polygon_m: true outline of the sole, (x, y) from the ankle [m], in order.
    """

    link: str
    ankle_height_m: float
    front_m: float
    back_m: float
    left_m: float
    right_m: float
    sole_polygon_m: tuple[tuple[float, float], ...] = ()

    def __post_init__(self) -> None:
        """A sole has an extent; the ankle may lie on the ground, and above the sole's rear edge."""
        owner = f"foot {self.link!r}"
        check_numbers(owner, self, positive=("front_m", "left_m", "right_m"))
        for name in ("ankle_height_m", "back_m"):
            if getattr(self, name) < 0.0:
                raise RobotDataError(f"{owner}: {name} must be >= 0, got {getattr(self, name)}")


@dataclass(frozen=True, kw_only=True, eq=False)
class Robot:
    """Tree of links joined by revolute joints.

    Attributes:
        name: for example ``"nao-v5"``.
        description: one sentence.
        sources: where each group of numbers comes from.
        root: link with no parent (the torso).
        links: by name.
        joints: by name.
        feet: ``"left"`` and ``"right"``.
        toes: what lies on the ground beyond a toe joint, by side; its link's frame stands at that joint.
        armatures_kgm2: by joint, inertia of rotors at the joint, where the dynamics take it into account; none by default.
        posture_rad: angles at which joints are held that a gait does not move; zero, or the nearest limit, where not stated.
        heat_loss_W_per_Nm2: heat of the motors for each squared torque, if the robot's file says it.
        notes: what was derived from a file, or changed, when the robot was read; a sentence each.
    """

    name: str
    description: str
    sources: Mapping[str, str]
    root: str
    links: Mapping[str, Link]
    joints: Mapping[str, Joint]
    feet: Mapping[str, Foot]
    toes: Mapping[str, Foot] = field(default_factory=dict)
    armatures_kgm2: Mapping[str, float] = field(default_factory=dict)
    posture_rad: Mapping[str, float] = field(default_factory=dict)
    heat_loss_W_per_Nm2: float | None = None
    notes: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Links and joints form one tree."""
        if self.root not in self.links:
            raise RobotDataError(f"robot {self.name!r}: root {self.root!r} is not a link")
        children: set[str] = set()
        for joint in self.joints.values():
            for end in (joint.parent, joint.child):
                if end not in self.links:
                    raise RobotDataError(f"joint {joint.name!r}: link {end!r} does not exist")
            if joint.child in children or joint.child == self.root:
                raise RobotDataError(f"joint {joint.name!r}: link {joint.child!r} already has a parent or is the root")
            children.add(joint.child)
        loose = set(self.links) - children - {self.root}
        if loose:
            raise RobotDataError(f"robot {self.name!r}: no joint carries link {', '.join(sorted(loose))}")
        for link in self.links:  # a ring of joints apart from the root has parents all round
            self.path_to_root(link)
        for side in ("left", "right"):
            if side not in self.feet or self.feet[side].link not in self.links:
                raise RobotDataError(f"robot {self.name!r}: foot {side!r} is missing or names no link")
        for side, toe in self.toes.items():
            if side not in self.feet or toe.link not in self.links:
                raise RobotDataError(f"robot {self.name!r}: toe {side!r} belongs to no foot or names no link")

    @cached_property
    def soles(self) -> Mapping[str, Foot]:
        """Everything that stands on the ground, feet and toes, by link."""
        return {foot.link: foot for part in (self.feet, self.toes) for foot in part.values()}

    @cached_property
    def mass_kg(self) -> float:
        """Total mass [kg]."""
        return sum(link.mass_kg for link in self.links.values())

    @cached_property
    def joint_to(self) -> Mapping[str, Joint]:
        """The joint that carries each link but the root."""
        return {joint.child: joint for joint in self.joints.values()}

    def joint(self, name: str) -> Joint:
        """Joint by name; raises UnknownNameError."""
        if name not in self.joints:
            raise unknown(f"joint of robot {self.name}", name, self.joints)
        return self.joints[name]

    def path_to_root(self, link: str) -> tuple[Joint, ...]:
        """Joints from a link up to the root, in that order."""
        path: list[Joint] = []
        below = link
        while below != self.root:
            if len(path) > len(self.joints):
                raise RobotDataError(f"robot {self.name!r}: joints above link {link!r} form a ring")
            path.append(self.joint_to[below])
            below = path[-1].parent
        return tuple(path)
