"""Stick figures of a gait: lines between joints, soles, ground, centre of mass and zero-moment point over time."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from nlp_gait.formulation.signals import Array, Signals

LEFT, RIGHT, TRUNK = "left", "right", "trunk"


@dataclass(frozen=True, kw_only=True, eq=False)
class Limb:
    """Chain of joints from end to end."""

    side: str  # left, right or trunk; determines the colour
    points: Array  # (T, K, 3) [m]


@dataclass(frozen=True, kw_only=True, eq=False)
class Sole:
    """Outline of a foot."""

    side: str  # left or right
    corners: Array  # (T, K, 3) [m]
    supports: np.ndarray[tuple[int], np.dtype[np.bool_]]  # (T,) whether it carries load


@dataclass(frozen=True, kw_only=True, eq=False)
class Skeleton:
    """Drawing of a gait; x forward, y left, z up."""

    t: Array  # (T,) [s]
    limbs: tuple[Limb, ...]  # lines
    soles: tuple[Sole, ...]  # outlines
    ground: Array  # (K, 2) line (x, z) of the floor or stair, seen from the side [m]
    com: Array | None  # (T, 3) centre of mass [m], if known
    zmp: Array | None  # (T, 3) zero-moment point on the ground [m], if known
    planar: bool = False  # only the side view is meaningful
    title: str = ""  # one line

    def support(self, k: int) -> Array | None:
        """Return the support polygon (M, 2) at a sample, the hull of the loaded soles from above [m]; None without one."""
        loaded = [sole.corners[k, :, :2] for sole in self.soles if sole.supports[k]]
        return _hull(np.concatenate(loaded)) if loaded else None

    def margin(self) -> Array:
        """Return the distance (T,) of the zero-moment point from the nearest edge of the support polygon [m], negative outside.

        NaN where it is unknown or no sole carries load. The first and the last instant use the loaded soles of their neighbour: a
        foot that only touches the ground there carries no load.
        """
        if self.zmp is None:
            return np.full(len(self.t), np.nan)
        last = len(self.t) - 1
        bearing = [min(max(k, 1), max(last - 1, 0)) for k in range(last + 1)]
        return np.array([self._margin_at(k, self.zmp[k], bearing[k]) for k in range(last + 1)])

    def _margin_at(self, k: int, zmp: Array, bearing: int) -> float:
        loaded = [sole.corners[k] for sole in self.soles if sole.supports[bearing]]
        if not loaded:
            return math.nan
        corners = _hull(np.concatenate(loaded)[:, :2])
        if corners is None:  # a planar model: only its length counts
            x = np.concatenate(loaded)[:, 0]
            return float(min(zmp[0] - x.min(), x.max() - zmp[0]))
        edges = np.roll(corners, -1, axis=0) - corners  # counter-clockwise
        away = zmp[:2] - corners
        inside = (edges[:, 0] * away[:, 1] - edges[:, 1] * away[:, 0]) / np.linalg.norm(edges, axis=1)
        if (inside >= 0.0).all():
            return float(inside.min())
        along = np.clip((away * edges).sum(axis=1) / (edges**2).sum(axis=1), 0.0, 1.0)
        return -float(np.linalg.norm(away - along[:, None] * edges, axis=1).min())

    def box(self) -> tuple[Array, Array]:
        """Return the smallest and largest coordinates of everything that moves, (3,) each [m]."""
        parts = [limb.points for limb in self.limbs] + [sole.corners for sole in self.soles]
        everything = np.concatenate([part.reshape(-1, 3) for part in parts])
        return everything.min(axis=0), everything.max(axis=0)


def _hull(points: Array) -> Array | None:
    """Return corners (M, 2) of the convex hull of points (N, 2), counter-clockwise; None for points on a line."""
    from scipy.spatial import ConvexHull, QhullError  # costs 0.1 s to import

    try:
        return np.asarray(points[ConvexHull(points).vertices])
    except QhullError:  # soles without width, as in a planar model
        return None


def make_flat_skeleton(signals: Signals, limbs: Sequence[Limb], soles: Sequence[Sole]) -> Skeleton:
    """Return a gait on a flat floor, with the centre of mass and the zero-moment point of its time histories."""
    arrays = signals.arrays
    return Skeleton(
        t=arrays["t"],
        limbs=tuple(limbs),
        soles=tuple(soles),
        ground=make_flat_ground(*(sole.corners for sole in soles)),
        com=arrays["com"],
        zmp=append_zero_height(arrays["zmp"]),
    )


def make_flat_ground(*points: Array) -> Array:
    """Return a line (x, z) at height zero below all points (..., 3)."""
    x = np.concatenate([p[..., 0].ravel() for p in points])
    return np.array([[x.min() - 0.05, 0.0], [x.max() + 0.05, 0.0]])


def make_rectangle(back: float, front: float, right: float, left: float) -> Array:
    """Return corners (4, 3) at height zero."""
    return np.array([[front, left, 0.0], [back, left, 0.0], [back, right, 0.0], [front, right, 0.0]])


def append_zero_height(zmp: Array) -> Array:
    """Return (T, 3) from (T, 2)."""
    return np.column_stack([zmp, np.zeros(len(zmp))])
