"""What a URDF or MJCF leaves out, or has in a way that cannot be used: feet, forward, parts without mass or with bad tensors."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from nlp_gait.errors import GaitError, RobotDataError
from nlp_gait.robots.feet import (
    SIDES,
    Cloud,
    Passage,
    Side,
    Sole,
    find_feet,
    forward_of,
    own_chains,
    sole_of,
    way_to_root,
)
from nlp_gait.robots.leg import LEG_JOINT_COUNT
from nlp_gait.robots.mending import Mass, repaired

Array = np.ndarray[Any, np.dtype[np.float64]]
Raw = Mapping[str, Any]

# What a link without mass gets where the file asks for repair, as shares of the robot's mass, and its radius.
LEAST_MASS_SHARE, LEAST_RADIUS_M = 1e-6, 0.01
# Keys of a foot in a robot file, but for its link.
EXTENTS = ("ankle_height_m", "front_m", "back_m", "left_m", "right_m")
TURNS = {"x": 0.0, "y": -math.pi / 2, "-x": math.pi, "-y": math.pi / 2}  # about z, that makes the direction x


@dataclass(frozen=True, kw_only=True)
class Understood:
    """A robot's records as they can be used.

    Attributes:
        links: raw records by name.
        joints: likewise.
        feet: likewise, by side.
        notes: what was derived or changed, a sentence each.
    """

    links: dict[str, dict[str, Any]]
    joints: dict[str, dict[str, Any]]
    feet: dict[str, dict[str, Any]]
    notes: tuple[str, ...]


def understood(
    robot: str,
    links: Mapping[str, Raw],
    joints: Mapping[str, Raw],
    feet: Mapping[str, Raw],
    *,
    cloud: Cloud,
    forward: str | None,
    repair: bool,
    fault_of_link: Callable[[str, Raw], GaitError | None],
    fault_of_joint: Callable[[str, Raw], GaitError | None],
) -> Understood:
    """Feet, the way forward, and parts that cannot be used made one with what carries them.

    Args:
        robot: its name, for messages.
        links: records by the schema of a robot file, not yet checked.
        joints: likewise.
        feet: what the robot file says of them, perhaps only their links, or nothing.
        cloud: collision points of a link.
        forward: direction in the root's axes, if the file says it.
        repair: whether tensors and masses that matter and cannot be are replaced by the nearest that can.
        fault_of_link: what is wrong with a record, if anything.
        fault_of_joint: likewise.

    Raises:
        RobotDataError: no feet, no soles, or a leg that cannot be used.
    """
    notes: list[str] = []
    passages = _passages(joints)
    if feet:
        pair = (str(feet.get("left", {}).get("link")), str(feet.get("right", {}).get("link")))
    else:
        pair = find_feet(robot, passages)
    to = {joint.child: joint for joint in passages.values()}
    chains = own_chains(way_to_root(pair[0], to), way_to_root(pair[1], to))
    legs = {joint.child for chain in chains for joint in chain}
    mended_links, mended_joints = {k: dict(v) for k, v in links.items()}, {k: dict(v) for k, v in joints.items()}
    if repair:
        _repair(mended_links, legs, fault_of_link, notes)
    _weld_faults(mended_links, mended_joints, legs, fault_of_link, fault_of_joint, notes)
    if all(set(EXTENTS) <= set(feet.get(side, ())) for side in SIDES):
        found = {side: dict(foot) for side, foot in feet.items()}
        return Understood(links=mended_links, joints=mended_joints, feet=found, notes=tuple(notes))
    for link, chain in zip(pair, chains, strict=True):
        if len(chain) != LEG_JOINT_COUNT:
            raise RobotDataError(
                f"robot {robot!r}: a leg must have {LEG_JOINT_COUNT} turning joints from where both legs meet to the foot, "
                f"{link!r} has {len(chain)}: {', '.join(joint.child for joint in chain) or 'none'}"
            )
    soles = tuple(sole_of(robot, link, cloud) for link in pair)
    places = [to[link].place for link in pair]
    angle = TURNS[forward] if forward else forward_of(robot, chains, (soles[0], soles[1]))
    if angle:
        notes.append(
            f"forward is not along the root's x axis: the robot was turned by {math.degrees(angle):.0f} degrees about z"
        )
        _turn(mended_links, mended_joints, angle)
    turned = [_turned_sole(sole, angle) for sole in soles]
    across = [float((_about_z(angle) @ place)[1]) for place in places]
    sides: list[Side] = ["left", "right"] if across[0] > across[1] else ["right", "left"]
    if feet and sides[0] != "left":
        raise RobotDataError(
            f"robot {robot!r}: {pair[0]!r} is named the left foot, but it is on the right of {pair[1]!r}, seen forward; exchange "
            'them, or write which way is forward: "forward": "x", "-x", "y" or "-y"'
        )
    found = {}
    for link, side, sole in zip(pair, sides, turned, strict=True):
        found[side] = {"link": link, **_extents(sole), **feet.get(side, {})}
        notes.append(
            f"{side} foot: {link!r}, its sole {found[side]['back_m'] + found[side]['front_m']:.3f} m by "
            f"{found[side]['left_m'] + found[side]['right_m']:.3f} m, from {sole.points} lowest points of its collision shapes"
        )
    return Understood(links=mended_links, joints=mended_joints, feet=found, notes=tuple(notes))


def _passages(joints: Mapping[str, Raw]) -> dict[str, Passage]:
    """Joints with their places at zero angles from the root."""
    to = {raw["child"]: raw for raw in joints.values()}

    def place(raw: Raw) -> Array:
        at, seen = np.array(raw["origin_m"], dtype=float), 0
        while raw["parent"] in to and seen < len(to):
            raw, seen = to[raw["parent"]], seen + 1
            at = at + np.array(raw["origin_m"], dtype=float)
        return at

    return {
        name: Passage(
            raw["parent"], raw["child"], place(raw), np.array(raw["axis"], dtype=float), tuple(raw["limits_rad"])
        )
        for name, raw in joints.items()
    }


def _repair(
    links: dict[str, dict[str, Any]],
    legs: set[str],
    fault_of: Callable[[str, Raw], GaitError | None],
    notes: list[str],
) -> None:
    total = sum(float(raw["mass_kg"]) for raw in links.values())
    for name, raw in links.items():
        fault = fault_of(name, raw) if name in legs else None
        if fault is None:
            continue
        if not float(raw["mass_kg"]) > 0.0:
            mass = LEAST_MASS_SHARE * total
            moment = 0.4 * mass * LEAST_RADIUS_M**2
            raw |= {"mass_kg": mass, "inertia_com_kgm2": [moment, moment, moment, 0.0, 0.0, 0.0]}
        else:
            raw |= repaired(raw)
        notes.append(f"repaired as asked: {fault}")


def _weld_faults(
    links: dict[str, dict[str, Any]],
    joints: dict[str, dict[str, Any]],
    legs: set[str],
    fault_of_link: Callable[[str, Raw], GaitError | None],
    fault_of_joint: Callable[[str, Raw], GaitError | None],
    notes: list[str],
) -> None:
    """Join what cannot be used to what carries it, from the far ends on; refuse a leg that cannot be used."""
    held: dict[str, GaitError] = {}
    for name, raw in list(joints.items()):
        fault = fault_of_joint(name, raw)
        if fault is not None:
            if raw["child"] in legs:
                raise fault
            _weld(links, joints, name)
            held[name] = fault
    if held:
        notes.append(
            f"{len(held)} joint{'s' * (len(held) > 1)} cannot be driven and stay at zero, made one with what carries them: "
            f"{', '.join(held)}; the first: {next(iter(held.values()))}"
        )
    while True:
        faults = {name: fault for name, raw in links.items() if (fault := fault_of_link(name, raw)) is not None}
        if not faults:
            return
        to = {raw["child"]: name for name, raw in joints.items()}
        loose = [name for name in faults if name not in legs and name in to]
        if not loose:  # the root, or a leg
            roots = [name for name in faults if name not in legs]
            below = [j for j, raw in joints.items() if roots and raw["parent"] == roots[0] and raw["child"] not in legs]
            if not below:
                name, fault = next(iter(faults.items()))
                raise RobotDataError(
                    f"{fault}. It moves in every gait, so it matters; correct it, or have it replaced by the nearest one that a "
                    'body can have: "unphysical": "repair" in the JSON file beside the robot\'s'
                )
            heaviest = max(below, key=lambda j: float(links[joints[j]["child"]]["mass_kg"]))
            notes.append(f"{joints[heaviest]['child']!r} is one with {roots[0]!r}: {faults[roots[0]]}")
            _weld(links, joints, heaviest)
            continue
        name = loose[0]
        notes.append(f"{name!r} is one with {joints[to[name]]['parent']!r}, which carries it: {faults[name]}")
        _weld(links, joints, to[name])


def _weld(links: dict[str, dict[str, Any]], joints: dict[str, dict[str, Any]], name: str) -> None:
    joint = joints.pop(name)
    origin = np.array(joint["origin_m"], dtype=float)
    child = links.pop(joint["child"])
    parent = links[joint["parent"]]
    parent |= Mass(parent).with_child(Mass(child), origin).record()
    for other in joints.values():
        if other["parent"] == joint["child"]:
            other |= {
                "parent": joint["parent"],
                "origin_m": (np.array(other["origin_m"], dtype=float) + origin).tolist(),
            }


def _about_z(angle: float) -> Array:
    c, s = round(math.cos(angle)), round(math.sin(angle))  # quarter turns are exact
    return np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])


def _turn(links: dict[str, dict[str, Any]], joints: dict[str, dict[str, Any]], angle: float) -> None:
    """See all links along other axes."""
    turn = _about_z(angle)
    for raw in links.values():
        mass = Mass(raw)
        mass.com_m, mass.tensor = turn @ mass.com_m, turn @ mass.tensor @ turn.T
        raw |= mass.record()
    for raw in joints.values():
        raw |= {key: (turn @ np.array(raw[key], dtype=float)).tolist() for key in ("origin_m", "axis")}


def _turned_sole(sole: Sole, angle: float) -> Sole:
    corners = np.array([[*sole.low, 0.0], [*sole.high, 0.0]]) @ _about_z(angle).T
    low, high = corners.min(axis=0), corners.max(axis=0)
    return Sole(height=sole.height, low=(low[0], low[1]), high=(high[0], high[1]), points=sole.points)


def _extents(sole: Sole) -> dict[str, float]:
    """As a robot file has them, to a tenth of a millimetre: collision shapes are no more exact."""
    (back, right), (front, left) = sole.low, sole.high
    values = (sole.height, front, -back, left, -right)
    return {name: round(float(value), 4) for name, value in zip(EXTENTS, values, strict=True)}
