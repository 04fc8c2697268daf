"""Places of both feet along a walk: read from a file or along an arc, seen from the standing foot, and their soles."""

import math
from collections.abc import Sequence
from itertools import pairwise
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from nlp_gait.errors import InputError
from nlp_gait.files import read_text
from nlp_gait.formulation import Array
from nlp_gait.formulation.display import find_hull, make_rectangle
from nlp_gait.robots import Foot

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
