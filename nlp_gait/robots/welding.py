"""Links and joints of a URDF or MJCF that cannot be used as they are, welded to their parents."""

from collections.abc import Callable, Collection, Mapping
from typing import Any

import numpy as np

from nlp_gait.errors import GaitError, RobotDataError
from nlp_gait.robots.tree import Array, Mass, combine_masses

Records = dict[str, dict[str, Any]]
# Returns what is wrong with a record of this name, or None.
FindFault = Callable[[str, Mapping[str, Any]], GaitError | None]


def weld_faults(
    links: Records,
    joints: Records,
    legs: Collection[str],
    find_link_fault: FindFault,
    find_joint_fault: FindFault,
    notes: list[str],
) -> None:
    """Weld links and joints that cannot be used to their parents; raise RobotDataError for one of a leg."""
    faults = {name: fault for name, raw in joints.items() if (fault := find_joint_fault(name, raw)) is not None}
    for name, fault in faults.items():
        if joints[name]["child"] in legs:
            raise fault
        _weld(links, joints, name)
    if faults:
        notes.append(
            f"{len(faults)} joint{'s' * (len(faults) > 1)} cannot be driven and stay at zero, welded: {', '.join(faults)}; the "
            f"first: {next(iter(faults.values()))}"
        )
    while faults := {name: fault for name, raw in links.items() if (fault := find_link_fault(name, raw)) is not None}:
        loose = (name for name, raw in joints.items() if raw["child"] in faults and raw["child"] not in legs)
        name = next(loose, None) or _find_child_of_root(links, joints, legs, faults)
        parent, child = joints[name]["parent"], joints[name]["child"]
        notes.append(f"{child!r} is welded to its parent {parent!r}: {faults.get(child) or faults[parent]}")
        _weld(links, joints, name)


def _find_child_of_root(links: Records, joints: Records, legs: Collection[str], faults: Mapping[str, GaitError]) -> str:
    """Return the joint from the faulty root to its heaviest child outside the legs."""
    root = next((name for name in faults if name not in legs), None)
    below = [name for name, raw in joints.items() if raw["parent"] == root and raw["child"] not in legs]
    if root is None or not below:
        raise RobotDataError(
            f"{next(iter(faults.values()))}. It moves in every gait, so it matters; correct it, or write the link into the JSON "
            'file next to the model: "links": {"NAME": {"mass_kg": ..., "com_m": ..., "inertia_com_kgm2": ...}}'
        )
    return max(below, key=lambda name: float(links[joints[name]["child"]]["mass_kg"]))


def _weld(links: Records, joints: Records, name: str) -> None:
    joint = joints.pop(name)
    origin = np.array(joint["origin_m"], dtype=float)
    child, parent = links.pop(joint["child"]), links[joint["parent"]]
    parent |= combine_masses([Mass.from_record(parent), Mass.from_record(child).move(origin)]).to_record()
    for other in joints.values():
        if other["parent"] == joint["child"]:
            moved = np.array(other["origin_m"], dtype=float) + origin
            other |= {"parent": joint["parent"], "origin_m": moved.tolist()}


def turn_records(links: Records, joints: Records, rotation: Array) -> None:
    """Express all links and joints along other axes, by a rotation (3, 3)."""
    for raw in links.values():
        raw |= Mass.from_record(raw).turn(rotation).to_record()
    for raw in joints.values():
        raw |= {key: (rotation @ np.array(raw[key], dtype=float)).tolist() for key in ("origin_m", "axis")}
