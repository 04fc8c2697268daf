"""Masses and inertia tensors of links: sums, shifts, repairs, and tensors that refer to the wrong point."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from nlp_gait.errors import RobotDataError
from nlp_gait.robots.robot import Link, make_tensor

Array = np.ndarray[Any, np.dtype[np.float64]]

# A tensor about the joint gives ratios below 1 (see ``compute_joint_ratio``); printed digits may increase one by some percent.
GREATEST_JOINT_RATIO = 1.05
# Above one half, the joint is at least as far from the centre of mass as the matter is spread, if the tensor is about the joint.
FAR_RATIO = 0.5
# Fewer links than this prove nothing.
LEAST_LINKS = 5
# Keeps the ratio of a point mass finite [kg m^2].
LEAST_MOMENT = 1e-30


class Mass(NamedTuple):
    """Mass and its distribution, whether or not a rigid body can have them."""

    mass_kg: float
    com_m: Array  # (3,) centre of mass
    tensor_kgm2: Array  # (3, 3) inertia about the centre of mass

    @classmethod
    def from_record(cls, raw: Mapping[str, Any]) -> Mass:
        """Return the mass of a link as a robot file describes it."""
        tensor = make_tensor(raw["inertia_com_kgm2"])
        return cls(float(raw["mass_kg"]), np.array(raw["com_m"], dtype=float), tensor)

    def to_record(self) -> dict[str, Any]:
        """Return the fields of a link in a robot file."""
        moments = list(inertia_moments(self.tensor_kgm2))
        return {"mass_kg": float(self.mass_kg), "com_m": self.com_m.tolist(), "inertia_com_kgm2": moments}

    def move(self, offset: Array) -> Mass:
        """Return the mass in a frame from which its own is ``offset`` (3,) away [m]."""
        return self._replace(com_m=self.com_m + offset)

    def turn(self, rotation: Array) -> Mass:
        """Return the mass along other axes, by a rotation (3, 3)."""
        return Mass(self.mass_kg, rotation @ self.com_m, rotation @ self.tensor_kgm2 @ rotation.T)

    def repair(self) -> Mass:
        """Return the mass with the nearest tensor of a rigid body: no second moment of its matter is negative."""
        trace = np.trace(self.tensor_kgm2)
        moments, axes = np.linalg.eigh(trace / 2 * np.eye(3) - self.tensor_kgm2)
        spread = axes @ np.diag(np.maximum(moments, 0.0)) @ axes.T
        return self._replace(tensor_kgm2=np.trace(spread) * np.eye(3) - spread)


def combine_masses(parts: Sequence[Mass]) -> Mass:
    """Return several masses in one frame as one; without any mass, the centre is that of the first."""
    mass = sum(part.mass_kg for part in parts)
    com = sum((part.mass_kg * part.com_m for part in parts), np.zeros(3)) / mass if mass > 0.0 else parts[0].com_m
    tensor = sum((part.tensor_kgm2 + point_inertia(part.mass_kg, part.com_m - com) for part in parts), np.zeros((3, 3)))
    return Mass(mass, com, tensor)


def inertia_moments(matrix: Array) -> tuple[float, float, float, float, float, float]:
    """Return (ixx, iyy, izz, ixy, ixz, iyz) of a symmetric tensor (3, 3), as in ``Link``."""
    (ixx, ixy, ixz), (_, iyy, iyz), (_, _, izz) = matrix.tolist()
    return ixx, iyy, izz, ixy, ixz, iyz


def rotate(axis: Array, angle: float) -> Array:
    """Return the rotation (3, 3) about an axis (3,) by an angle [rad]."""
    k = np.cross(np.eye(3), axis)
    return np.asarray(np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k)


def point_inertia(mass: float, offset: Array) -> Array:
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
    """Return the link whose tensor was taken about its joint; raises RobotDataError if no rigid body has such a tensor."""
    about_com = link.inertia_matrix - point_inertia(link.mass_kg, np.array(link.com_m))
    return replace(link, inertia_com_kgm2=inertia_moments(about_com))
