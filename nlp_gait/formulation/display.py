"""What shows the gaits of a problem: time histories, stick figures, and what a physics engine needs to simulate them."""

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from nlp_gait.formulation.assembly import NumericPoint
from nlp_gait.formulation.signals import Array, Columns, Signals, make_vector_columns
from nlp_gait.robots.robot import Robot

FLAT_AREA = 1e-12  # of a triangle whose corners lie on a line [m^2]
LEFT, RIGHT, TRUNK = "left", "right", "trunk"

# What the engine needs of a motion in addition to the joints' q, qd and tau. The floor, or its lowest part, is at z = 0.
SIMULATED = {
    "zmp": make_vector_columns("m", "xy"),  # planned centre of pressure of everything that stands on the ground
    "hip": make_vector_columns("m"),  # origin of the robot's root
    "attitude": Columns(unit="1", labels=("w", "x", "y", "z")),  # of the root, a quaternion; upright if missing
    "left_foot": make_vector_columns("m"),  # the sole under the ankle
    "right_foot": make_vector_columns("m"),
    "feet_yaw": Columns(unit="rad", labels=("left", "right")),  # direction of the soles; forward if missing
    # 1 where any part of the foot is on the ground, else 0; if missing, a foot is on the ground when its sole is.
    "left_bears": Columns(unit="1"),
    "right_bears": Columns(unit="1"),
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Tread:
    """Level part of a staircase, from its edge to the next one."""

    edge_m: float  # x of its edge
    height_m: float  # above the floor


@dataclass(frozen=True, kw_only=True, eq=False)
class SimulationModel:
    """What a physics engine needs of a problem."""

    robot: Robot  #: as the engine models it, where links that never move are welded
    gravity: float  #: magnitude [m/s^2]
    slope_rad: float = 0.0  #: by which the floor rises forward; all places are in its axes
    heat_loss: str | None = None  #: parameter with the heat constant K [W/(Nm)^2]; None for motors without known heat
    repeats: bool = False  #: several steps can be simulated one after the other
    steps: int | None = None  #: of a whole walk; None for a phase, or for one step
    #: From a point to time histories on a dense grid, in the robot's joints and with the arrays of
    #: ``SIMULATED``; None if those of the problem are that already, and the next step is the mirror image
    motion: Callable[[NumericPoint], Signals] | None = None
    #: From a point to the stairs; None for a flat floor
    ground: Callable[[NumericPoint], tuple[Tread, ...]] | None = None
    planar: bool = False  #: the root moves in the sagittal plane only


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

    def margin(self) -> Array:
        """Return the distance (T,) of the zero-moment point from the nearest edge of the support polygon [m], negative outside.

        NaN where it is unknown or no sole carries load. The first and the last instant use the loaded soles of their neighbour: a
        foot that only touches the ground there carries no load.
        """
        if self.zmp is None:
            return np.full(len(self.t), np.nan)
        last = len(self.t) - 1
        return np.array([self._margin_at(k, zmp, min(max(k, 1), max(last - 1, 0))) for k, zmp in enumerate(self.zmp)])

    def _margin_at(self, k: int, zmp: Array, bearing: int) -> float:
        loaded = [sole.corners[k] for sole in self.soles if sole.supports[bearing]]
        if not loaded:
            return math.nan
        corners = find_hull(np.concatenate(loaded)[:, :2])
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
        moving = [limb.points for limb in self.limbs] + [sole.corners for sole in self.soles]
        everything = np.concatenate([points.reshape(-1, 3) for points in moving])
        return everything.min(axis=0), everything.max(axis=0)


@dataclass(frozen=True, kw_only=True, eq=False)
class Display:
    """What shows the gaits of a problem; no solver reads it."""

    motion: Callable[[NumericPoint], Signals] | None = None  #: time histories at a point of numbers
    #: Stick figures from time histories and the parameters by name
    skeleton: Callable[[Signals, Mapping[str, float]], Skeleton] | None = None
    simulation_model: SimulationModel | None = None  #: what a physics engine needs
    robot: Robot | None = None  #: whose joints move, if it is a tree of rigid links
    durations: tuple[str, ...] = ()  #: variables with the duration of each phase, in order


def find_hull(points: Array) -> Array | None:
    """Return corners (M, 2) of the convex hull of points (N, 2), counter-clockwise; None for points on a line.

    Andrew (1979), Another efficient algorithm for convex hulls in two dimensions: a lower and an upper chain of sorted points.
    """
    ordered = sorted(map(tuple, points.tolist()))
    corners: list[tuple[float, float]] = []
    for points_of_chain in (ordered, ordered[::-1]):
        chain: list[tuple[float, float]] = []
        for x, y in points_of_chain:
            while len(chain) > 1:
                (x1, y1), (x2, y2) = chain[-2:]
                if (x2 - x1) * (y - y1) - (y2 - y1) * (x - x1) > FLAT_AREA:  # a turn to the left
                    break
                chain.pop()
            chain.append((x, y))
        corners += chain[:-1]
    return np.array(corners) if len(corners) > 2 else None


def make_flat_skeleton(signals: Signals, limbs: Sequence[Limb], soles: Sequence[Sole]) -> Skeleton:
    """Return a gait on a flat floor, with the centre of mass and the zero-moment point of its time histories."""
    arrays = signals.arrays
    x = np.concatenate([sole.corners[..., 0].ravel() for sole in soles])
    ground = np.array([[x.min() - 0.05, 0.0], [x.max() + 0.05, 0.0]])
    return Skeleton(
        t=arrays["t"],
        limbs=tuple(limbs),
        soles=tuple(soles),
        ground=ground,
        com=arrays["com"],
        zmp=np.column_stack([arrays["zmp"], np.zeros(len(arrays["t"]))]),
    )


def make_rectangle(back: float, front: float, right: float, left: float) -> Array:
    """Return corners (4, 3) at height zero."""
    return np.array([[front, left, 0.0], [back, left, 0.0], [back, right, 0.0], [front, right, 0.0]])
