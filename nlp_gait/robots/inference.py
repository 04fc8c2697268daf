"""Feet of a robot whose file does not state them: their links and soles, and the forward direction."""

import math
from collections.abc import Mapping
from itertools import combinations
from typing import Any, Literal, NamedTuple

import numpy as np

from nlp_gait.errors import RobotDataError
from nlp_gait.robots.leg import LEG_JOINT_COUNT, find_bend
from nlp_gait.robots.robot import Joint
from nlp_gait.robots.tree import (
    LEAST_SINE,
    Array,
    compare_axes,
    find_nearest_on_axis,
    turn_parts,
)
from nlp_gait.robots.welding import Joints, Links, ReadShapes

Side = Literal["left", "right"]
SIDES: tuple[Side, Side] = ("left", "right")
Feet = dict[str, dict[str, Any]]  # by side, as in a robot file

# Keys of a foot in a robot file, except its link.
EXTENTS = ("ankle_height_m", "front_m", "back_m", "left_m", "right_m")
FORWARD_ANGLES = {"x": 0.0, "y": -math.pi / 2, "-x": math.pi, "-y": math.pi / 2}  # about z, of the turn to x
SOLE_THICKNESS_M = 0.004  # points of a foot this close to its lowest one are on the ground
CLEARLY_LOWER_M = 0.1  # the joints of the feet are lower than those of any other mirrored pair by this
CLEAR_LEAD_M = 0.03  # soles whose parts in front of and behind the ankle differ by this show the forward direction
CLEAR_LEAD = 1 / 3  # of their length, by which they contradict the knees
NEGLIGIBLE_INERTIA = 0.01  # of a link, as a share of that of the robot's mass at its size
NEGLIGIBLE_MASS = 0.005  # of a link, as a share of the robot's
DENSEST = 22590.0  # of solids, osmium [kg/m^3]
PAIRED_M, PAIRED_COSINE = 1e-2, 0.99  # axes of a pair of joints are images of each other to this
LEAST_JOINTS = 3  # of limbs that may be legs
LEAST_WIDTH_M = 0.01  # a narrower sole is a line or a point


class PlacedJoint(NamedTuple):
    """A joint at zero angles."""

    joint: Joint
    place: Array  # (3,) from the root's origin [m]


Chain = list[PlacedJoint]  # joints from a link towards the root


class InferredSole(NamedTuple):
    """Part of a foot that touches the ground, from its joint, along the root's axes [m]."""

    height: float  # of the joint above it
    low: Array  # (2,) least x and y
    high: Array  # (2,) greatest x and y
    points: int  # number of points on the ground
    kind: str  # of the shapes


class Legs(NamedTuple):
    """The two legs of a robot, in any order."""

    feet: tuple[str, str]
    chains: tuple[Chain, Chain]  # joints of each leg from the foot to where both meet

    @property
    def links(self) -> set[str]:
        """Links that the joints of the legs carry."""
        return {placed.joint.child for chain in self.chains for placed in chain}

    @property
    def ankles_m(self) -> tuple[Array, Array]:
        """Point of each leg's last axis that is nearest to the one before."""
        one, opposite = (_find_nearest(*chain[:2]) for chain in self.chains)
        return one, opposite

    @property
    def hip_m(self) -> Array:
        """Point of the first axis of one leg that is nearest to the next one."""
        return _find_nearest(*self.chains[0][:-3:-1])


def find_legs(robot: str, links: Links, joints: Joints, feet: Feet) -> Legs:
    """Find the legs by the feet of the robot file, by side, or else by geometry.

    The feet are the lowest pair of mirrored links with six turning joints each to where their legs meet, below the centre of mass
    of the other links: limbs that begin above it are arms. Raises RobotDataError if there is no such pair, or if it is not
    clearly lower than others.
    """
    chains = _find_chains(joints)
    if feet:
        left, right = (str(feet.get(side, {}).get("link")) for side in SIDES)
        return Legs((left, right), _split_chains(chains.get(left, []), chains.get(right, [])))
    candidates: list[tuple[float, Legs]] = []
    failed: list[tuple[tuple[bool, float, int], str, tuple[str, str]]] = []
    for pair in combinations(sorted(chains), 2):
        legs = Legs(pair, _split_chains(chains[pair[0]], chains[pair[1]]))
        count = len(legs.chains[0])
        if count != len(legs.chains[1]) or count < LEAST_JOINTS:
            continue
        heights = [float(ankle[2]) for ankle in legs.ankles_m]
        fault, are_arms = _find_direction_fault(legs) or _find_mirror_fault(legs), _are_arms(legs, links, chains)
        if are_arms and not fault:
            fault = "belongs to arms: they begin above the other links' centre of mass"
        elif count != LEG_JOINT_COUNT and not fault:
            fault = f"has legs of {count} joints, which is not supported"
        if fault:
            failed.append(((are_arms, round(max(heights), 2), -count), fault, pair))
        else:
            candidates.append((heights[0], legs))
    remedy = (
        'name the feet in the JSON file next to the model: "feet": {"left": {"link": "..."}, "right": {"link": "..."}} '
        "(docs/robots.md describes the supported legs)"
    )
    if not candidates:
        hint = "no two links have the same number of turning joints below where they meet; "
        if failed:
            _, fault, pair = min(failed)
            hint = f"the lowest pair, {pair[0]!r} and {pair[1]!r}, {fault}; if these or other links are the feet, "
        raise RobotDataError(
            f"robot {robot!r}: no feet found: two links, mirror images of each other (z is up), with {LEG_JOINT_COUNT} turning "
            f"joints each below the link where both legs meet; {hint}{remedy}"
        )
    candidates.sort(key=lambda item: (item[0], item[1].feet))
    lowest, *rivals = [legs for height, legs in candidates if height < candidates[0][0] + CLEARLY_LOWER_M]
    if rivals:
        listed = "; ".join("{!r} and {!r}".format(*legs.feet) for legs in (lowest, *rivals))
        raise RobotDataError(f"robot {robot!r}: several pairs of links may be the feet: {listed}; {remedy}")
    return lowest


def find_middle(legs: Legs) -> Array:
    """Return the place (3,) of the plane of symmetry: the middle of the legs along the axis that separates them, else zero."""
    across = int(np.argmax(np.abs(np.subtract(*legs.ankles_m))[:2]))
    middle = np.zeros(3)
    # A joint's origin may be anywhere on its axis, so that an axis across the plane does not show where it is.
    places = [
        (one.place[across] + opposite.place[across]) / 2
        for one, opposite in zip(*legs.chains, strict=False)
        if abs(one.joint.axis[across]) < LEAST_SINE
    ]
    middle[across] = np.median(places) if places else 0.0
    return middle


def _find_direction_fault(legs: Legs) -> str:
    """Return the direction of the legs at zero angles in words; "" if it is down."""
    leg = legs.ankles_m[0] - legs.hip_m
    axis = int(np.argmax(np.abs(leg)))
    if axis == 2 and leg[2] < 0.0:
        return ""
    return (
        f"points along {'-' if leg[axis] < 0.0 else ''}{'xyz'[axis]} at zero angles, and z must be up: turn the root, as by the "
        "rpy of a fixed joint above it"
    )


def _find_mirror_fault(legs: Legs) -> str:
    """Return which joints of two legs are not mirror images, the nearest to the body first, in words; "" if all are."""
    middle = find_middle(legs)
    across = int(np.argmax(np.abs(np.subtract(*legs.ankles_m))[:2]))
    mirror = np.ones(3)
    mirror[across] = -1.0
    for one, opposite in reversed(list(zip(*legs.chains, strict=True))):
        names = f"{one.joint.name!r} and {opposite.joint.name!r}"
        for joint in (one.joint, opposite.joint):
            if not any(joint.axis):
                return f"turns about the axis 0 0 0 at {joint.name!r}"
        gap, angle = compare_axes(
            mirror * (one.place - middle),
            mirror * one.joint.axis,
            opposite.place - middle,
            np.array(opposite.joint.axis),
        )
        if gap > PAIRED_M or math.cos(angle) < PAIRED_COSINE:
            return (
                f"is not mirrored: the axes of {names} are {1e3 * gap:.1f} mm and {math.degrees(angle):.1f} degrees from being "
                f"images, and may be {1e3 * PAIRED_M:g} mm and {math.degrees(math.acos(PAIRED_COSINE)):.1f} degrees"
            )
    if abs(float(np.subtract(*legs.ankles_m)[across])) <= LEAST_WIDTH_M:
        return "has both ankles at one place"
    return ""


def _find_nearest(placed: PlacedJoint, other: PlacedJoint | None = None) -> Array:
    """Return the point (3,) of a joint's axis that is nearest to another one's; its origin without another one."""
    if other is None:
        return placed.place
    return find_nearest_on_axis(placed.place, np.array(placed.joint.axis), other.place, np.array(other.joint.axis))


def check_sizes(robot: str, links: Links, joints: Joints, notes: list[str]) -> None:
    """Note links more concentrated than any matter; raise RobotDataError for one too heavy or spread too far for root and joints.

    Of all bodies of a mass and a largest density, a ball has the least trace of the tensor, 6/5 m r^2. Light links do not matter.
    """
    places = [np.zeros(3), *(chain[0].place for chain in _find_chains(joints).values())]
    size = float(np.linalg.norm(np.ptp(places, axis=0)))
    mass_kg = sum(link.mass_kg for link in links.values())
    heaviest = max(links.values(), key=lambda link: link.mass_kg)
    if 0.0 < DENSEST * size**3 < mass_kg:
        raise RobotDataError(
            f"robot {robot!r}: {heaviest.name!r} has {heaviest.mass_kg:.3g} kg, root and joints span {size:.3g} m; masses are in "
            "kg: is it in g, or of another scale?"
        )
    for name, link in links.items():
        trace = max(float(np.trace(link.inertia_matrix)), 0.0)
        if link.mass_kg <= 0.0 or (radius := math.sqrt(trace / (2 * link.mass_kg))) <= size:
            continue
        fault = (
            f"the tensor of {name!r} spreads {link.mass_kg:.3g} kg by {radius:.3g} m, root and joints by {size:.3g} m"
        )
        if link.mass_kg * radius**2 > NEGLIGIBLE_INERTIA * mass_kg * size**2:
            raise RobotDataError(
                f"robot {robot!r}: {fault}; tensors are in kg m^2: is it in kg mm^2, or of another scale?"
            )
        notes.append(f"{fault}; it is too light to matter")
    points = [
        name
        for name, link in links.items()
        if link.mass_kg > NEGLIGIBLE_MASS * mass_kg
        and np.trace(link.inertia_matrix) < 1.2 * link.mass_kg * (3 * link.mass_kg / (4 * math.pi * DENSEST)) ** (2 / 3)
    ]
    if points:
        notes.append(
            f"tensors of {', '.join(points)} are smaller than of a ball of osmium of that mass: another unit, or point masses?"
        )


def infer_feet(
    robot: str,
    legs: Legs,
    links: Links,
    joints: Joints,
    feet: Feet,
    read_shapes: ReadShapes,
    forward: str | None,
    notes: list[str],
) -> Feet:
    """Return both feet with their soles, and turn links and joints so that the robot faces along x.

    What the robot file states about the feet and the forward direction has precedence; ``notes`` receive what was inferred.
    Raises RobotDataError for a leg without six joints, without a flat sole, or without a clear forward direction.
    """
    for link, chain in zip(legs.feet, legs.chains, strict=True):
        if len(chain) != LEG_JOINT_COUNT:
            raise RobotDataError(
                f"robot {robot!r}: a leg must have {LEG_JOINT_COUNT} turning joints from where both legs meet to the foot, "
                f"{link!r} has {len(chain)}: {', '.join(placed.joint.child for placed in chain) or 'none'}"
            )
        _check_lowest(robot, link, joints, read_shapes)
    _check_knees(robot, legs)
    soles = [
        _find_sole(robot, link, read_shapes, ankle - chain[0].place, float(np.linalg.norm(legs.hip_m - ankle)))
        for link, chain, ankle in zip(legs.feet, legs.chains, legs.ankles_m, strict=True)
    ]
    angle = FORWARD_ANGLES[forward] if forward else _find_forward(robot, legs, soles, notes)
    c, s = round(math.cos(angle)), round(math.sin(angle))  # exact: quarter turns
    turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
    if angle:
        degrees = math.degrees(angle)
        notes.append(f"forward is not along the root's x axis: the robot was turned by {degrees:.0f} degrees about z")
        turn_parts(links, joints, turn)
    across = [float((turn @ ankle)[1]) for ankle in legs.ankles_m]
    sides = SIDES if across[0] > across[1] else SIDES[::-1]
    if feet and sides[0] != "left":
        raise RobotDataError(
            f"robot {robot!r}: {legs.feet[0]!r} is named the left foot, but it is to the right of {legs.feet[1]!r}; "
            'exchange them, or write the forward direction: "forward": "x", "-x", "y" or "-y"'
        )
    completed: Feet = {}
    for link, side, sole in zip(legs.feet, sides, soles, strict=True):
        corners = np.array([sole.low, sole.high]) @ turn[:2, :2].T
        (back, right), (front, left) = corners.min(axis=0), corners.max(axis=0)
        # To a tenth of a millimetre: collision shapes are no more exact.
        extents = [round(float(value), 4) for value in (sole.height, front, -back, left, -right)]
        foot = {"link": link, **dict(zip(EXTENTS, extents, strict=True)), **feet.get(side, {})}
        notes.append(
            f"{side} foot: {link!r}, its sole {foot['back_m'] + foot['front_m']:.3f} m by "
            f"{foot['left_m'] + foot['right_m']:.3f} m, from {sole.points} lowest points of its {sole.kind} shapes"
        )
        completed[side] = foot
    return completed


def _find_chains(joints: Joints) -> dict[str, Chain]:
    """Return the joints from each link towards the root."""
    joint_to = {joint.child: joint for joint in joints.values()}
    paths: dict[str, list[Joint]] = {child: [] for child in joint_to}
    for link, path in paths.items():
        while link in joint_to and len(path) <= len(joint_to):  # joints may form a ring
            path.append(joint_to[link])
            link = joint_to[link].parent
    places = {child: np.sum([j.origin_m for j in path], axis=0, dtype=float) for child, path in paths.items()}
    return {child: [PlacedJoint(j, places[j.child]) for j in path] for child, path in paths.items()}


def _split_chains(first: Chain, second: Chain) -> tuple[Chain, Chain]:
    shared = {placed.joint.name for placed in first} & {placed.joint.name for placed in second}
    one, opposite = ([p for p in chain if p.joint.name not in shared] for chain in (first, second))
    return one, opposite


def _are_arms(legs: Legs, links: Links, chains: Mapping[str, Chain]) -> bool:
    """Return whether the limbs begin above the centre of mass of all other links, at zero angles."""
    remaining = [link for name, link in links.items() if name not in legs.links]
    mass = sum(link.mass_kg for link in remaining)
    heights = {name: chain[0].place[2] for name, chain in chains.items()}
    moment = sum(link.mass_kg * (heights.get(link.name, 0.0) + link.com_m[2]) for link in remaining)
    return bool(mass > 0.0 and legs.hip_m[2] > moment / mass)


def _check_lowest(robot: str, foot: str, joints: Joints, read_shapes: ReadShapes) -> None:
    """Raise RobotDataError if a link that turns against the foot reaches lower, as that behind a seventh joint of a leg does."""
    lowest = read_shapes(foot).points[:, 2].min(initial=math.inf)
    for joint in joints.values():
        if joint.parent != foot:
            continue
        below = joint.origin_m[2] + read_shapes(joint.child).points[:, 2].min(initial=math.inf)
        if below < lowest - SOLE_THICKNESS_M:
            raise RobotDataError(
                f"robot {robot!r}: {joint.child!r} reaches lower than {foot!r}, the sixth link of the leg, which carries it; "
                f"legs have {LEG_JOINT_COUNT} turning joints here: make fixed those that a gait does not need"
            )


def _find_sole(robot: str, link: str, read_shapes: ReadShapes, ankle_m: Array, leg_m: float) -> InferredSole:
    """Return the sole of a foot, from an ankle (3,) that is given from its joint's origin, under a leg of a length."""
    points, kind, missing, others = read_shapes(link)
    write = (
        'write its sole into the JSON file next to the model: "ankle_height_m", "front_m", "back_m", "left_m", "right_m" '
        "(see docs/robots.md)"
    )
    if missing:
        raise RobotDataError(
            f"robot {robot!r}: the sole of {link!r} depends on the mesh {missing[0]!r}, which does not exist; put it there, name "
            f"its package's folder in ROS_PACKAGE_PATH, or {write}"
        )
    if not len(points):
        found = f"only shapes that are not flat, {', '.join(sorted(set(others)))}" if others else "no shape"
        raise RobotDataError(f"robot {robot!r}: {link!r} has {found} for its sole; {write}")
    points = points - ankle_m
    on_ground = points[points[:, 2] < points[:, 2].min() + SOLE_THICKNESS_M]
    low, high = on_ground.min(axis=0), on_ground.max(axis=0)
    if min(high[:2] - low[:2]) < LEAST_WIDTH_M:
        raise RobotDataError(
            f"robot {robot!r}: the lowest part of {link!r} at zero angles is {1e3 * (high[0] - low[0]):.1f} mm by "
            f"{1e3 * (high[1] - low[1]):.1f} mm: no flat sole. If it is tilted at zero angles, turn an origin of "
            f"the ankle (rpy) until it is level, which moves the zero of that joint; else {write}"
        )
    if max(high[:2] - low[:2]) > leg_m:
        raise RobotDataError(
            f"robot {robot!r}: the sole of {link!r} would be {high[0] - low[0]:.3g} m by {high[1] - low[1]:.3g} m, and its leg "
            f'is {leg_m:.3g} m long; is its mesh in mm? Write scale="0.001 0.001 0.001" into <mesh>'
        )
    if (low[:2] > 0.0).any() or (high[:2] <= 0.0).any():
        x, y = (max(least, -most, 0.0) for least, most in zip(low[:2], high[:2], strict=True))
        raise RobotDataError(
            f"robot {robot!r}: the sole of {link!r} begins {1e3 * math.hypot(x, y):.0f} mm beside the point below its ankle, "
            f"where the last two axes are nearest; soles must lie below the ankle; {write}"
        )
    return InferredSole(-float(points[:, 2].min()), low[:2], high[:2], len(on_ground), kind)


def _find_forward(robot: str, legs: Legs, soles: list[InferredSole], notes: list[str]) -> float:
    """Return the angle about z that turns the forward direction to x: a multiple of a quarter turn [rad].

    Forward is perpendicular to the line between the feet, and knees bend so that the feet go back; the longer part of the soles
    must not contradict, and decides where knees may turn equally far both ways; else it is along the positive axis.
    """
    between = np.subtract(*legs.ankles_m)
    axis = 0 if abs(between[1]) >= abs(between[0]) else 1  # forward is along it
    knee = sum(direction[axis] for direction in _find_knee_directions(legs))
    lead = sum(sole.high[axis] + sole.low[axis] for sole in soles) / 2
    length = sum(sole.high[axis] - sole.low[axis] for sole in soles) / 2
    if abs(lead) < (CLEAR_LEAD * length if knee else CLEAR_LEAD_M):
        lead = 0.0
    if not (lead or knee):
        notes.append(f"neither knees nor soles show the forward direction: it is taken along {'xy'[axis]}")
        lead = 1.0
    if lead * knee < 0:
        raise RobotDataError(
            f"robot {robot!r}: knees {legs.chains[0][2].joint.child!r} and {legs.chains[1][2].joint.child!r} and the soles "
            'contradict each other; write the forward direction: "forward": "x", "-x", "y" or "-y" into the JSON file next to '
            "the model"
        )
    return FORWARD_ANGLES[f"{'' if (knee or lead) > 0 else '-'}{'xy'[axis]}"]


def _check_knees(robot: str, legs: Legs) -> None:
    """Raise RobotDataError if the limits of both knees make them bend in opposite directions."""
    one, opposite = _find_knee_directions(legs)
    if float(one @ opposite) < 0:
        ranges = " and ".join(
            f"{knee.child!r} by {knee.limits_rad[0]:.3g} to {knee.limits_rad[1]:.3g} rad about {np.round(knee.axis, 3) + 0.0}"
            for knee in (chain[2].joint for chain in legs.chains)
        )
        raise RobotDataError(
            f"robot {robot!r}: its knees bend in opposite directions, {ranges}; correct the axis or the limits of one of them"
        )


def _find_knee_directions(legs: Legs) -> list[Array]:
    """Return the direction (3,) in which each knee points when it bends, 0 if its limits do not show it."""
    directions = []
    for chain, ankle in zip(legs.chains, legs.ankles_m, strict=True):
        knee = chain[2]
        directions.append(-find_bend(*knee.joint.limits_rad) * np.cross(knee.joint.axis, ankle - knee.place))
    return directions
