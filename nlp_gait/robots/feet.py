"""Feet of a robot whose file does not name them: which links they are, what of them touches the ground, which way is forward."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple

import numpy as np

from nlp_gait.errors import RobotDataError
from nlp_gait.robots.leg import LEG_JOINT_COUNT

Array = np.ndarray[Any, np.dtype[np.float64]]
Side = Literal["left", "right"]
SIDES: tuple[Side, Side] = ("left", "right")

# Points of a foot this near to its lowest one are on the ground.
SOLE_THICKNESS_M = 0.004
# Mirrored places agree to this, and mirrored axes to this cosine: names mislead, geometry does not.
MIRROR_M, MIRROR_COSINE = 2e-3, 0.999
# Feet are a pair whose joints are lower than those of any other pair by this.
CLEARLY_LOWER_M = 0.1
# Soles whose parts before and behind the ankle differ by this say which way is forward.
CLEAR_LEAD_M = 0.03
# A narrower sole is a line or a point.
LEAST_WIDTH_M = 0.01


class Passage(NamedTuple):
    """A joint as the search sees it.

    Attributes:
        parent: link.
        child: link.
        place: (3,) from the root's origin, at zero angles [m].
        axis: (3,), along the root's axes.
        limits: least and greatest angle [rad].
    """

    parent: str
    child: str
    place: Array
    axis: Array
    limits: tuple[float, float]


@dataclass(frozen=True, kw_only=True)
class Sole:
    """What of a foot touches the ground, from its joint, along the root's axes [m].

    Attributes:
        height: of the joint above it.
        low: (x, y) least.
        high: (x, y) greatest.
        points: how many.
    """

    height: float
    low: tuple[float, float]
    high: tuple[float, float]
    points: int


Cloud = Callable[[str], tuple[Array, tuple[str, ...]]]


def find_feet(robot: str, joints: Mapping[str, Passage]) -> tuple[str, str]:
    """Links of the two feet, in no order: the lowest pair of mirrored links with six turning joints to where their ways meet.

    Raises:
        RobotDataError: there is none, or not one that is clearly lower than the others.
    """
    to = {joint.child: joint for joint in joints.values()}
    paths = {child: way_to_root(child, to) for child in to}
    pairs: list[tuple[float, str, str]] = []
    names = sorted(paths)
    for i, first in enumerate(names):
        for second in names[i + 1 :]:
            one, other = own_chains(paths[first], paths[second])
            if len(one) == len(other) == LEG_JOINT_COUNT and _mirrored(one, other):
                pairs.append((one[0].place[2], first, second))
    pairs.sort()
    if not pairs:
        raise RobotDataError(
            f"robot {robot!r}: no feet found: two links, mirror images of each other, with {LEG_JOINT_COUNT} turning joints each "
            f"below the link that both legs leave; {_remedy()}"
        )
    close = [pair for pair in pairs if pair[0] < pairs[0][0] + CLEARLY_LOWER_M]
    if len(close) > 1:
        listed = "; ".join(f"{first!r} and {second!r}" for _, first, second in close)
        raise RobotDataError(f"robot {robot!r}: several pairs of links may be the feet: {listed}; {_remedy()}")
    return pairs[0][1:]


def _remedy() -> str:
    return (
        'name them in the JSON file beside it: "feet": {"left": {"link": "..."}, "right": {"link": "..."}} '
        "(docs/custom-robots.md says which legs are taken)"
    )


def own_chains(first: list[Passage], second: list[Passage]) -> tuple[list[Passage], list[Passage]]:
    """What two ways to the root do not share, from the far end."""
    shared = {joint.child for joint in first} & {joint.child for joint in second}
    return [j for j in first if j.child not in shared], [j for j in second if j.child not in shared]


def way_to_root(link: str, to: Mapping[str, Passage]) -> list[Passage]:
    """Joints from a link on, by their child; it ends where they go in a circle."""
    path: list[Passage] = []
    while link in to and len(path) <= len(to):
        path.append(to[link])
        link = path[-1].parent
    return path


def _mirrored(one: list[Passage], other: list[Passage]) -> bool:
    """Whether two chains are mirror images in x or in y."""
    return any(
        all(mirrored(a.place, a.axis, b.place, b.axis, across) for a, b in zip(one, other, strict=True))
        and abs(one[0].place[across] - other[0].place[across]) > LEAST_WIDTH_M
        for across in (1, 0)
    )


def mirrored(place: Array, axis: Array, other_place: Array, other_axis: Array, across: int = 1) -> bool:
    """Whether two joints are each other's image in the plane through the root across an axis."""
    image = np.ones(3)
    image[across] = -1.0
    near = math.dist(image * place, other_place) <= MIRROR_M
    return near and abs(float((image * axis) @ other_axis)) >= MIRROR_COSINE


def sole_of(robot: str, link: str, cloud: Cloud) -> Sole:
    """Lowest part of a foot's collision shapes.

    Raises:
        RobotDataError: it has none, or nothing that stands flat.
    """
    points, missing = cloud(link)
    write = (
        'write its sole into the JSON file beside it: "ankle_height_m", "front_m", "back_m", "left_m", "right_m" '
        "(see docs/custom-robots.md)"
    )
    if missing:
        raise RobotDataError(
            f"robot {robot!r}: the sole of {link!r} is to be taken from the mesh {missing[0]!r}, which is not there; put it "
            f"there, name its package's folder in ROS_PACKAGE_PATH, or {write}"
        )
    if not len(points):
        raise RobotDataError(f"robot {robot!r}: {link!r} has no collision shape to take its sole from; {write}")
    on_ground = points[points[:, 2] < points[:, 2].min() + SOLE_THICKNESS_M]
    low, high = on_ground.min(axis=0), on_ground.max(axis=0)
    if min(high[:2] - low[:2]) < LEAST_WIDTH_M:
        raise RobotDataError(
            f"robot {robot!r}: the lowest part of {link!r} at zero angles is {1e3 * (high[0] - low[0]):.1f} mm by "
            f"{1e3 * (high[1] - low[1]):.1f} mm: no flat sole; {write}"
        )
    return Sole(
        height=-float(points[:, 2].min()),
        low=(float(low[0]), float(low[1])),
        high=(float(high[0]), float(high[1])),
        points=len(on_ground),
    )


def forward_of(robot: str, chains: tuple[list[Passage], list[Passage]], soles: tuple[Sole, Sole]) -> float:
    """Angle about z by which the root's x axis must be turned to point forward: a multiple of a quarter turn [rad].

    Forward is across the line from foot to foot, and knees bend so that the feet go back; the longer part of the soles must
    not say the contrary.

    Args:
        robot: its name.
        chains: both legs from the foot on.
        soles: of both feet.

    Raises:
        RobotDataError: the knees do not agree, or the soles contradict them.
    """
    apart = chains[0][0].place - chains[1][0].place
    axis = 0 if abs(apart[1]) >= abs(apart[0]) else 1  # forward is along it
    knees = [_knee_lead(chain)[axis] for chain in chains]
    lead = sum(sole.high[axis] + sole.low[axis] for sole in soles) / 2
    contradicted = abs(lead) >= CLEAR_LEAD_M and lead * knees[0] < 0
    if knees[0] * knees[1] <= 0 or contradicted:
        raise RobotDataError(
            f"robot {robot!r}: knees {chains[0][2].child!r} and {chains[1][2].child!r} and the soles do not agree on which way "
            'is forward; write "forward": "x", "-x", "y" or "-y" into the JSON file beside it'
        )
    if axis == 0:
        return 0.0 if knees[0] > 0 else math.pi
    return -math.pi / 2 if knees[0] > 0 else math.pi / 2


def _knee_lead(chain: list[Passage]) -> Array:
    """(3,) horizontal direction in which the knee points when it bends, the way of its larger range."""
    _, fifth, knee, *_ = chain
    bend = 1.0 if knee.limits[1] >= -knee.limits[0] else -1.0
    return np.asarray(-bend * np.cross(knee.axis, fifth.place - knee.place))
