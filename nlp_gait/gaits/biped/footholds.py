"""Places of both feet along a walk, from a file or along an arc, as the standing foot sees them; soles; a flight of stairs."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import casadi as ca
import numpy as np
from casadi import DM, SX
from numpy.polynomial import Polynomial

from nlp_gait.errors import InputError
from nlp_gait.files import read_text
from nlp_gait.formulation import Array
from nlp_gait.formulation.display import Tread, find_hull, make_rectangle
from nlp_gait.robots import Foot
from nlp_gait.symbolic.trajectories import Motion, add_motions, constant_motion

COLUMNS = "x_m,y_m,z_m,yaw_deg"
MOST_FOOTHOLDS = 100
FARTHEST_M, MOST_DEG = 1e4, 36000.0
SWING_SAMPLES = 41  # of a swing, at which both soles are compared


class Foothold(NamedTuple):
    """Place of a foot on a level floor: the point below its ankle [m], and the direction of its toes, to the left [rad]."""

    x: float
    y: float
    yaw: float

    def seen_from(self, stance: "Foothold", left: bool, stance_y: float) -> "Foothold":
        """Return it from a standing foot at (0, ``stance_y``) that points forward; mirrored unless that is the left one."""
        x, y = stance._replace(yaw=-stance.yaw).turn(self.x - stance.x, self.y - stance.y)
        sign = 1.0 if left else -1.0
        return Foothold(x, sign * y + stance_y, sign * (self.yaw - stance.yaw))

    def turn(self, x: Any, y: Any) -> tuple[Any, Any]:
        """Return a vector (x, y) in the axes of the floor from one in its own axes; numbers or expressions."""
        cos, sin = math.cos(self.yaw), math.sin(self.yaw)
        return cos * x - sin * y, sin * x + cos * y

    def outline(self, foot: Foot) -> Array:
        """Return the corners (4, 2) of a sole on it [m]."""
        x, y, _ = make_rectangle(-foot.back_m, foot.front_m, -foot.right_m, foot.left_m).T
        return np.array([self.x, self.y]) + np.stack(self.turn(x, y), axis=1)


def parse_footholds(text: str) -> tuple[Foothold, ...]:
    """Return footholds from rows ``x,y,z,yaw`` [m, degrees], separated by semicolons, all at height zero; raises InputError."""
    footholds = []
    for k, row in enumerate(text.split(";"), 1):
        try:
            x, y, z, yaw = (float(cell) for cell in row.split(","))
        except ValueError:
            raise InputError(f"foothold {k} must be four numbers {COLUMNS}, got {row.strip()!r}") from None
        if not (abs(x) <= FARTHEST_M and abs(y) <= FARTHEST_M and abs(yaw) <= MOST_DEG and math.isfinite(z)):
            limits = f"{FARTHEST_M:g} m and {MOST_DEG:g} degrees"
            raise InputError(f"foothold {k} must be finite and within {limits} of the start, got {row.strip()!r}")
        if z:
            raise InputError(
                f"foothold {k} is {z:g} m high, but footholds are planned on a level floor; write 0, or climb with stairs"
            )
        footholds.append(Foothold(x, y, math.radians(yaw)))
    if not 2 <= len(footholds) <= MOST_FOOTHOLDS:
        raise InputError(f"a walk has 2 to {MOST_FOOTHOLDS} footholds, got {len(footholds)}")
    return tuple(footholds)


def read_footholds(path: str | Path) -> str:
    """Return the footholds of a CSV file with the header ``x_m,y_m,z_m,yaw_deg`` for ``parse_footholds``; raises InputError."""
    header, *rows = read_text(Path(path), "footholds").strip().splitlines() or [""]
    if header.replace(" ", "") != COLUMNS:
        raise InputError(f"{path}: the first line must be {COLUMNS}, got {header!r}")
    return ";".join(row for row in rows if row.strip())


def list_arc(turn_deg: float, steps: int, distance_m: float, feet_y: tuple[float, float]) -> str:
    """Return the footholds of a turn to the left along an arc, or of a line; steps advance equally, and the last foot closes."""
    rows, turn = [], math.radians(turn_deg)
    for k in range(1, steps + 1):
        share, y = min(k / (steps - 1), 1.0), feet_y[k % 2]
        if turn:
            x, y = Foothold(0.0, 0.0, share * turn).turn(0.0, y - distance_m / turn)
            y += distance_m / turn
        else:
            x = share * distance_m
        rows.append(",".join(f"{value:.9g}" for value in (x, y, 0.0, share * turn_deg)))
    return ";".join(rows)


def list_swings(footholds: Sequence[Foothold], feet_y: tuple[float, float]) -> list[tuple[Foothold, Foothold]]:
    """Return where the foot of each step, first the right one, lifts and lands, as a right foot seen from a left one."""
    feet = list_feet(footholds, feet_y)
    views = ((feet[k - 1], feet[k], feet[k + 1], k % 2 == 1) for k in range(1, len(feet) - 1))
    return [
        (a.seen_from(stance, left, feet_y[0]), b.seen_from(stance, left, feet_y[0])) for a, stance, b, left in views
    ]


def list_feet(footholds: Sequence[Foothold], feet_y: tuple[float, float]) -> tuple[Foothold, ...]:
    """Return the right and the left foot at the start, and the footholds."""
    return Foothold(0.0, feet_y[1], 0.0), Foothold(0.0, feet_y[0], 0.0), *footholds


def meets(standing: Array, foot: Foot, lifted: Foothold, landed: Foothold) -> bool:
    """Return whether a foot that swings straight from foothold to foothold passes over a standing sole (4, 2)."""
    shares = np.linspace(0.0, 1.0, SWING_SAMPLES)[:, None]
    path = np.array(lifted) + shares * (np.array(landed) - np.array(lifted))
    return not all(_separate(standing, Foothold(*place).outline(foot)) for place in path.tolist())


def _separate(first: Array, second: Array) -> bool:
    """Return whether a side of one of two rectangles (4, 2) separates them."""
    for corners in (first, second):
        for a, b in pairwise(corners[:3]):
            one, second_along = ((outline @ (b - a)) for outline in (first, second))
            if one.max() <= second_along.min() or second_along.max() <= one.min():
                return True
    return False


def find_support_sides(soles: Sequence[Array]) -> Array:
    """Return the sides (n, 3) of the hull of soles: outward unit normal, and its product with the points of the side [m]."""
    corners = find_hull(np.concatenate(soles))
    assert corners is not None  # soles have an area
    along = np.roll(corners, -1, axis=0) - corners  # counter-clockwise
    normals = np.stack([along[:, 1], -along[:, 0]], axis=1) / np.linalg.norm(along, axis=1)[:, None]
    return np.column_stack([normals, (normals * corners).sum(axis=1)])


# Shares of a swing's path over time: forward at rest and unaccelerated at both ends, upward at rest, and its bow.
FORWARD, UPWARD = Polynomial([0, 0, 0, 10, -15, 6]), Polynomial([0, 0, 3, -2])
BOW = Polynomial([0, 0, 16, -32, 16])
CLEARANCE_M = 0.005  # of a swinging sole above the edges, of NAO's size
LEAST_RUN = 1.1  # of a tread, in lengths of the sole
FINE = 1001  # instants at which a swing is compared with the stairs


@dataclass(frozen=True, kw_only=True)
class Flight:
    """Equal treads, each with a foot in its middle; the robot begins in front of the first one."""

    rise_m: float  # of each tread
    run_m: float  # depth of each tread, which is also the step length
    foot: Foot
    clearance_m: float = CLEARANCE_M  # least height of a swinging sole above the edges

    def __post_init__(self) -> None:
        if not 0.0 < self.rise_m < math.inf:
            raise InputError(f"the rise of stairs must be a finite number > 0, got {self.rise_m!r} m")

    def check_run(self, longest_m: float) -> None:
        """Raise InputError if the sole does not fit on a tread, or the robot's longest step is shorter than one."""
        least = LEAST_RUN * (self.foot.back_m + self.foot.front_m)
        if not least <= self.run_m <= longest_m:
            raise InputError(
                f"the run of stairs must be at least {least:.3g} m, {LEAST_RUN:g} lengths of the sole, "
                f"and at most {longest_m:.3g} m, the longest step of this robot; got {self.run_m!r} m"
            )

    @property
    def slope(self) -> float:
        """Rise for each metre."""
        return self.rise_m / self.run_m

    def swing(self, start_x: SX, end_x: SX, lift: SX, duration: SX, s: SX) -> tuple[Motion, Motion]:
        """Return the share of its path that a foot has swung from tread to tread, and its height, with a bow of ``lift`` [m]."""

        def shape(polynomial: Polynomial, factor: SX) -> Motion:
            return Motion(*(factor * ca.polyval(DM(polynomial.deriv(k).coef[::-1]), s) / duration**k for k in range(3)))

        rise = add_motions(constant_motion(self.slope * start_x), shape(UPWARD, self.slope * (end_x - start_x)))
        return shape(FORWARD, SX(1)), add_motions(rise, shape(BOW, lift))

    def find_least_lift(self, treads: int) -> float:
        """Return the least bow of a swing by 1 or 2 ``treads``, of two if it passes the standing foot, over all edges [m].

        The sole is high enough before its toe has come halfway to an edge.
        """
        s = np.linspace(0.0, 1.0, FINE)[1:-1]
        from_tread = 1 - treads
        toe = (from_tread + treads * FORWARD(s)) * self.run_m + self.foot.front_m + self._free / 4
        below = np.floor((toe + self._setback) / self.run_m) * self.rise_m
        above = (from_tread + treads * UPWARD(s)) * self.rise_m
        return float(np.ceil(1e3 * (np.max((below - above) / BOW(s)) + self.clearance_m)) / 1e3)

    def list_treads(self, count: int) -> tuple[Tread, ...]:
        """Return the first ``count`` treads, for a robot whose feet begin at x = 0."""
        return tuple(
            Tread(edge_m=k * self.run_m - self._setback, height_m=k * self.rise_m) for k in range(1, count + 1)
        )

    @property
    def _setback(self) -> float:
        """From an edge to the ankle above its tread [m]."""
        return self.foot.back_m + self._free / 2

    @property
    def _free(self) -> float:
        """Depth of a tread that the sole does not cover [m]."""
        return self.run_m - self.foot.back_m - self.foot.front_m
