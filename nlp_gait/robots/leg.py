"""Geometry of a leg with six turning joints, and the nearest leg whose inverse kinematics has a closed form."""

import math
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from nlp_gait.errors import InputError
from nlp_gait.robots.robot import Robot
from nlp_gait.robots.tree import LEAST_SINE, Array

LEG_JOINT_COUNT = 6
MEETING_M = 1e-9  # axes this close to a point pass through it; smaller than the rounding of published origins
SHORTEST_M = 1e-3
CLEAR_RANGE = 1.5  # a knee bends to the side on which its range is this many times the other side's


@dataclass(frozen=True, kw_only=True, eq=False)
class Leg:
    """Six turning joints from the torso to a foot, at zero angles, in the torso's axes and from its origin [m].

    Legs of equal content are equal. Raises InputError without a knee, three different axes at the hip, or two at the ankle.
    """

    joints: tuple[str, ...]  # names, the hip's first
    axes: Array  # (6, 3) unit vectors
    points: Array  # (6, 3) one point of each axis
    foot_m: Array  # (3,) origin of the foot's link
    limits_rad: Array  # (6, 2) limits of planned gaits

    def __post_init__(self) -> None:
        a = self.axes
        shortest = min(np.linalg.norm(self.thigh_m), np.linalg.norm(self.shank_m))
        if abs(float(np.linalg.det(a[:3]))) < LEAST_SINE:
            what = f"the axes of the first three must not lie in one plane, {', '.join(self.joints[:3])}"
        elif float(np.linalg.norm(np.cross(a[4], a[5]))) < LEAST_SINE:
            what = f"the axes of the last two must not be parallel, {', '.join(self.joints[4:])}"
        elif shortest < SHORTEST_M or self.knee_gain < SHORTEST_M**2:
            what = f"the fourth must be a knee, which changes the leg's length, {self.joints[3]}"
        else:
            return
        raise InputError(f"a leg of joints {', '.join(self.joints)} is not supported: {what}")

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Leg) and self._content == other._content

    def __hash__(self) -> int:
        return hash(self._content)

    @cached_property
    def _content(self) -> tuple[object, ...]:
        arrays = (self.axes, self.points, self.foot_m, self.limits_rad)
        return self.joints, *(np.asarray(array, dtype=float).tobytes() for array in arrays)

    @cached_property
    def hip_m(self) -> Array:
        """(3,) point nearest to the first three axes."""
        return find_nearest_point(self.axes[:3], self.points[:3])

    @cached_property
    def ankle_m(self) -> Array:
        """(3,) point nearest to the last two axes."""
        return find_nearest_point(self.axes[4:], self.points[4:])

    @cached_property
    def knee_m(self) -> Array:
        """(3,) point of the knee's axis nearest to the middle between hip and ankle."""
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
        """Constant and the factors of cosine and sine in thigh . shank, turned by the knee's angle [m^2]."""
        u, w, a = self.thigh_m, self.shank_m, self.axes[3]
        constant = float((u @ a) * (w @ a))
        return constant, float(u @ w) - constant, float(u @ np.cross(a, w))

    @property
    def knee_gain(self) -> float:
        """Amplitude by which the knee's angle changes thigh . shank [m^2]."""
        _, c, s = self.knee_terms
        return math.hypot(c, s)

    @property
    def straight_rad(self) -> float:
        """Angle of the knee at which the leg is longest."""
        _, c, s = self.knee_terms
        return math.atan2(s, c)

    @cached_property
    def bend(self) -> float:
        """Sign of the direction in which the knee bends: as its limits show, otherwise forward, along x."""
        low, high = self.limits_rad[3] - self.straight_rad
        return find_bend(low, high) or (1.0 if np.cross(self.axes[3], self.shank_m)[0] < 0 else -1.0)

    @cached_property
    def length_m(self) -> float:
        """Greatest distance of hip and ankle."""
        u, w = self.thigh_m, self.shank_m
        return math.sqrt(float(u @ u + w @ w) + 2 * (self.knee_terms[0] + self.knee_gain))

    @cached_property
    def meeting_points(self) -> Array:
        """(6, 3) point of each axis: the hip or ankle if it passes through, otherwise the nearest one."""
        centres = [self.hip_m] * 3 + [self.points[3]] + [self.ankle_m] * 2
        points = []
        for axis, point, centre in zip(self.axes, self.points, centres, strict=True):
            near = point + (axis @ (centre - point)) * axis
            points.append(centre if np.linalg.norm(near - centre) < MEETING_M else near)
        return np.array(points)


def find_bend(low: float, high: float) -> float:
    """Return the sign of a knee's clearly larger range on both sides of its straight angle, 0 if they are alike."""
    larger, smaller = max(high, -low), min(high, -low)
    if larger < CLEAR_RANGE * smaller:
        return 0.0
    return 1.0 if high >= -low else -1.0


def make_leg(robot: Robot, side: str) -> Leg:
    """Return the leg on side ``"left"`` or ``"right"``: the six joints between the root and that foot; raises as ``Leg``."""
    path = robot.path_to_root(robot.feet[side].link)[::-1]
    points = np.cumsum([joint.origin_m for joint in path], axis=0)
    return Leg(
        joints=tuple(joint.name for joint in path),
        axes=np.array([joint.axis for joint in path]),
        points=points,
        foot_m=points[-1],
        limits_rad=np.array([joint.planning_limits_rad for joint in path]),
    )


def find_nearest_point(axes: Array, points: Array) -> Array:
    """Return the point (3,) with the least sum of squared distances to axes (k, 3) through points (k, 3)."""
    across = [np.eye(3) - np.outer(axis, axis) for axis in axes]
    solution: Array = np.linalg.lstsq(
        np.sum(across, axis=0), np.sum([p @ x for p, x in zip(across, points, strict=True)], axis=0), rcond=None
    )[0]
    # If the axes meet in one of the given points, return it exactly.
    for point in points:
        if np.linalg.norm(solution - point) < MEETING_M:
            return np.asarray(point)
    return solution
