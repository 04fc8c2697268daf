"""Links that become one: those of a file that do not turn against each other, and those that cannot be used as they are."""

from collections.abc import Callable, Collection, Mapping, Sequence
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from nlp_gait.errors import RobotDataError
from nlp_gait.robots.robot import Joint, Link
from nlp_gait.robots.tree import Array, Mass, combine_masses, list_moments, to_vector, weld_child


class FootShapes(NamedTuple):
    """Shapes that move with a foot."""

    points: Array  #: (N, 3) corners of boxes and meshes, edges of cylinders and lowest points of spheres [m]
    kind: str  #: ``"collision"``, or ``"visual"`` if the foot has no collision shapes
    missing: tuple[str, ...] = ()  #: meshes that do not exist
    others: tuple[str, ...] = ()  #: kinds of shapes without a flat side


Links = dict[str, Link]
Joints = dict[str, Joint]
SLIGHT_M = 1e-3  # radius of gyration of negative moments that rounding explains
ReadShapes = Callable[[str], FootShapes]  # shapes that move with a link


class LinkFrame(NamedTuple):
    """A link of a URDF or a body of an MJCF at zero angles, in the axes and from the origin of the root."""

    parent: str | None  # None for the root
    turns: bool  # against its parent
    origin_m: Array  # (3,) the joint to its parent
    mass: Mass


class RobotParts(NamedTuple):
    """A robot as a URDF or MJCF describes it, in which some links and joints may be faulty."""

    name: str
    root: str
    links: Links
    joints: Joints
    carriers: Mapping[str, str]  # the link of ``links`` that each link of the file is part of
    read_shapes: ReadShapes
    notes: tuple[str, ...]  # what of the file is not used, and what it does not state
    unusable: Mapping[str, str]  # by link, why its joint cannot be part of a leg, in words


def list_carriers(frames: Mapping[str, LinkFrame]) -> dict[str, str]:
    """Return the first link from each one to the root that turns against its parent, or the root."""

    def find_carrier(name: str) -> str:
        while not frames[name].turns and (parent := frames[name].parent) is not None:
            name = parent
        return name

    return {name: find_carrier(name) for name in frames}


def join_frames(
    name: str,
    frames: Mapping[str, LinkFrame],
    turning: Sequence[Joint],
    read_shapes: ReadShapes,
    notes: Sequence[str],
    unusable: Mapping[str, str],
) -> RobotParts:
    """Return a robot whose links are the frames that do not turn against each other, as one each."""
    carriers = list_carriers(frames)
    masses: dict[str, list[Mass]] = {}
    for link, frame in frames.items():
        masses.setdefault(carriers[link], []).append(frame.mass)
    links = {link: combine_masses(pieces).move(-frames[link].origin_m).to_link(link) for link, pieces in masses.items()}
    joints = {}
    for joint in turning:
        parent = carriers[joint.parent]
        origin = to_vector(frames[joint.child].origin_m - frames[parent].origin_m)
        joints[joint.name] = replace(joint, parent=parent, origin_m=origin)
    root = next(link for link, frame in frames.items() if frame.parent is None)
    return RobotParts(name, root, links, joints, carriers, read_shapes, tuple(notes), unusable)


def correct_tensors(links: Links, notes: list[str]) -> None:
    """Make slightly negative principal moments zero; where one is above the sum of the others, give all three their mean."""
    corrected = []
    for name in find_faults(links):
        link = links[name]
        moments, axes = np.linalg.eigh(link.inertia_matrix)
        if moments[0] < -link.mass_kg * SLIGHT_M**2 or link.mass_kg <= 0.0:
            continue
        corrected.append(f"{name} ({', '.join(f'{moment:.2g}' for moment in moments)} kg m^2)")
        positive = np.maximum(moments, 0.0)
        links[name] = replace(link, inertia_com_kgm2=list_moments(axes * positive @ axes.T))
        if links[name].is_unbalanced:
            links[name] = replace(link, inertia_com_kgm2=list_moments(positive.mean() * np.eye(3)))
    if corrected:
        notes.append(
            "no rigid body has these principal moments; negative ones are zero, and if one is above the sum of the others, each "
            f"is their mean, as with MuJoCo's balanceinertia: {'; '.join(corrected)}"
        )


def weld_faults(links: Links, joints: Joints, legs: Collection[str], notes: list[str]) -> None:
    """Weld links and joints that cannot be used to their parents; raise RobotDataError for one of a leg."""
    faults = find_faults(joints)
    for name, fault in faults.items():
        if joints[name].child in legs:
            raise fault
        weld_child(links, joints, name)
    if faults:
        notes.append(
            f"{len(faults)} joint{'s' * (len(faults) > 1)} cannot be driven and stay at zero, welded: {', '.join(faults)}; the "
            f"first: {next(iter(faults.values()))}"
        )
    while faults := find_faults(links):
        loose = (name for name, joint in joints.items() if joint.child in faults and joint.child not in legs)
        name = next(loose, None) or _find_child_of_root(links, joints, legs, faults)
        parent, child = joints[name].parent, joints[name].child
        notes.append(f"{child!r} is welded to its parent {parent!r}: {faults.get(child) or faults[parent]}")
        weld_child(links, joints, name)


def find_faults(pieces: Mapping[str, Link] | Mapping[str, Joint]) -> dict[str, RobotDataError]:
    """Return what is wrong with links or joints, by name."""
    faults = {}
    for name, piece in pieces.items():
        try:
            piece.check()
        except RobotDataError as fault:
            faults[name] = fault
    return faults


def _find_child_of_root(
    links: Links, joints: Joints, legs: Collection[str], faults: Mapping[str, RobotDataError]
) -> str:
    """Return the joint from the faulty root to its heaviest child outside the legs."""
    root = next((name for name in faults if name not in legs), None)
    below = [name for name, joint in joints.items() if joint.parent == root and joint.child not in legs]
    if root is None or not below:
        raise RobotDataError(
            f"{next(iter(faults.values()))}. It moves in every gait, so it matters; correct it, or write the link into the JSON "
            'file next to the model: "links": {"NAME": {"mass_kg": ..., "com_m": ..., "inertia_com_kgm2": ...}}'
        )
    return max(below, key=lambda name: links[joints[name].child].mass_kg)
