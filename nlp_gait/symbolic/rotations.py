"""Rotations: about fixed axes by angles or their cosines and sines, of vectors, of quaternions, and between two directions."""

from collections.abc import Iterable, Sequence
from functools import lru_cache
from typing import Any

import casadi as ca
import numpy as np
from casadi import DM, SX

Array = np.ndarray[Any, np.dtype[np.float64]]
TINY = 1e-20  # keeps norms away from zero, where a pose is out of reach

FORWARD, TO_THE_LEFT, UP = (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), (0.0, 0.0, 1.0)  # axes of the world


def axis_rotation(axis: Sequence[float], angle: SX) -> SX:
    """Return the rotation (3, 3) about a fixed unit axis by an angle [rad]."""
    return build_rotation(tuple(axis))(ca.cos(angle), ca.sin(angle))


def turn_quaternion(attitude: Iterable[Any], cos: Any, sin: Any) -> list[Any]:
    """Return an attitude, a quaternion (w, x, y, z), after a rotation about the vertical by twice the angle of cos and sin."""
    w, x, y, z = attitude
    return [cos * w - sin * z, cos * x - sin * y, cos * y + sin * x, cos * z + sin * w]


@lru_cache
def build_rotation(axis: tuple[float, ...]) -> ca.Function:
    """Return the rotation (3, 3) about a fixed unit axis as a function of cosine and sine (Rodrigues), sparse if it can be."""
    k, cos, sin = DM(axis), SX.sym("cos"), SX.sym("sin")
    along = k @ k.T
    return ca.Function("rotation", [cos, sin], [SX(along) + cos * (DM.eye(3) - along) + sin * ca.skew(k)])


def find_rotation(axis: Array, before: SX, after: SX) -> tuple[SX, SX]:
    """Return cosine and sine of the rotation about an axis that takes one vector nearest to another."""
    k = DM(axis)
    cos = ca.dot(before, after) - ca.dot(k, before) * ca.dot(k, after)
    sin = ca.dot(k, ca.cross(before, after))
    scale = 1 / ca.sqrt(ca.fmax(cos**2 + sin**2, TINY**2))
    return cos * scale, sin * scale


def invert_turn(turn: tuple[SX, SX]) -> tuple[SX, SX]:
    """Return cosine and sine of the opposite angle."""
    return turn[0], -turn[1]


def rotate_vector(axis: SX, cos: SX, sin: SX, vector: SX) -> SX:
    """Return a vector (3,) after the rotation about a unit axis (Rodrigues)."""
    return cos * vector + sin * ca.cross(axis, vector) + ((1 - cos) * ca.dot(axis, vector)) * axis


def turn_about_vertical(points: Array, yaw: Array) -> Array:
    """Return points (..., 3) turned about the vertical through the origin by angles [rad] of the leading shape."""
    x, y, z = (points[..., i] for i in range(3))
    cos, sin = np.cos(yaw), np.sin(yaw)
    return np.stack(np.broadcast_arrays(cos * x - sin * y, sin * x + cos * y, z), axis=-1)
