"""A leg of six turning joints, as numbers, and the leg nearest to it whose inverse kinematics has a closed form."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from nlp_gait.errors import InputError
from nlp_gait.robots.robot import Robot

Array = np.ndarray[Any, np.dtype[np.float64]]

LEG_JOINT_COUNT = 6
# Axes that pass a point this closely meet in it: below the rounding of published origins.
MEETING_M = 1e-9
# Least sine of the angle between axes that must not be parallel.
LEAST_SINE = 0.1
SHORTEST_M = 1e-3


@dataclass(frozen=True, kw_only=True, eq=False)
class Leg:
    """Six turning joints from the torso to a foot, at zero angles, in the torso's axes and from its origin [m].

    Attributes:
        joints: names, the hip's first.
        axes: (6, 3) unit vectors.
        points: (6, 3) of each axis one point.
        foot_m: (3,) origin of the foot's link.
        limits_rad: (6, 2) that a gait is planned within.

    Raises:
        InputError: a leg that has no bending knee, no hip with three different axes, or no ankle with two.
    """

    joints: tuple[str, ...]
    axes: Array
    points: Array
    foot_m: Array
    limits_rad: Array

    def __post_init__(self) -> None:
        """Refuse what has no nearest leg in closed form."""
        a = self.axes
        if abs(float(np.linalg.det(a[:3]))) < LEAST_SINE:
            raise InputError(self._misfit("the axes of the first three must not lie in one plane", self.joints[:3]))
        if float(np.linalg.norm(np.cross(a[4], a[5]))) < LEAST_SINE:
            raise InputError(self._misfit("the axes of the last two must not be parallel", self.joints[4:]))
        if (
            min(np.linalg.norm(self.thigh_m), np.linalg.norm(self.shank_m)) < SHORTEST_M
            or self.knee_gain < SHORTEST_M**2
        ):
            raise InputError(
                self._misfit("the fourth must be a knee, which changes the leg's length", self.joints[3:4])
            )

    @cached_property
    def hip_m(self) -> Array:
        """(3,) point nearest to the first three axes."""
        return nearest_point(self.axes[:3], self.points[:3])

    @cached_property
    def ankle_m(self) -> Array:
        """(3,) point nearest to the last two axes."""
        return nearest_point(self.axes[4:], self.points[4:])

    @cached_property
    def knee_m(self) -> Array:
        """(3,) point of the knee's axis halfway between hip and ankle along it."""
        middle = (self.hip_m + self.ankle_m) / 2
        return np.asarray(self.points[3] + (self.axes[3] @ (middle - self.points[3])) * self.axes[3])

    @property
    def thigh_m(self) -> Array:
        """(3,) from hip to knee."""
        return np.asarray(self.knee_m - self.hip_m)

    @property
    def shank_m(self) -> Array:
        """(3,) from knee to ankle."""
        return np.asarray(self.ankle_m - self.knee_m)

    @cached_property
    def knee_terms(self) -> tuple[float, float, float]:
        """Constant, cosine's and sine's factor in thigh . shank turned by the knee's angle [m^2]."""
        u, w, a = self.thigh_m, self.shank_m, self.axes[3]
        constant = float((u @ a) * (w @ a))
        return constant, float(u @ w) - constant, float(u @ np.cross(a, w))

    @property
    def knee_gain(self) -> float:
        """How much of thigh . shank the knee's angle moves [m^2]."""
        _, c, s = self.knee_terms
        return math.hypot(c, s)

    @property
    def straight_rad(self) -> float:
        """Angle of the knee at which the leg is longest."""
        _, c, s = self.knee_terms
        return math.atan2(s, c)

    @cached_property
    def bend(self) -> float:
        """+1 or -1: the way in which the knee bends, that of its larger range."""
        low, high = self.limits_rad[3]
        return 1.0 if high - self.straight_rad >= self.straight_rad - low else -1.0

    @cached_property
    def length_m(self) -> float:
        """Greatest distance of hip and ankle."""
        u, w = self.thigh_m, self.shank_m
        return math.sqrt(float(u @ u + w @ w) + 2 * (self.knee_terms[0] + self.knee_gain))

    @cached_property
    def meeting_points(self) -> Array:
        """(6, 3) of each axis the point at the hip or ankle if it passes there, else the one given."""
        centres = [self.hip_m] * 3 + [self.points[3]] + [self.ankle_m] * 2
        found = []
        for axis, point, centre in zip(self.axes, self.points, centres, strict=True):
            near = point + (axis @ (centre - point)) * axis
            found.append(centre if np.linalg.norm(near - centre) < MEETING_M else near)
        return np.array(found)

    def _misfit(self, what: str, joints: Sequence[str]) -> str:
        return f"a leg of joints {', '.join(self.joints)} is not one that is solved: {what}, {', '.join(joints)}"


def leg_of(robot: Robot, side: str) -> Leg:
    """Leg on side ``"left"`` or ``"right"``: the joints between the root and that foot.

    Raises:
        InputError: they are not six, or not those of a leg.
    """
    foot = robot.feet[side].link
    path = tuple(reversed(robot.path_to_root(foot)))
    if len(path) != LEG_JOINT_COUNT:
        raise InputError(
            f"robot {robot.name!r}: the {side} leg, from {robot.root!r} to {foot!r}, must have {LEG_JOINT_COUNT} turning joints, "
            f"got {len(path)}: {', '.join(joint.name for joint in path) or 'none'}"
        )
    points = np.cumsum([joint.origin_m for joint in path], axis=0)
    return Leg(
        joints=tuple(joint.name for joint in path),
        axes=np.array([joint.axis for joint in path]),
        points=points,
        foot_m=points[-1],
        limits_rad=np.array([joint.planning_limits_rad for joint in path]),
    )


def nearest_point(axes: Array, points: Array) -> Array:
    """(3,) point with the least sum of squared distances to some axes (k, 3) through points (k, 3)."""
    across = [np.eye(3) - np.outer(axis, axis) for axis in axes]
    found: Array = np.linalg.lstsq(
        np.sum(across, axis=0), np.sum([p @ x for p, x in zip(across, points, strict=True)], axis=0), rcond=None
    )[0]
    # On axes that meet in one of the given points, that point to the last bit.
    for point in points:
        if np.linalg.norm(found - point) < MEETING_M:
            return np.asarray(point)
    return found
