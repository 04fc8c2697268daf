"""Robots from URDF files, in the form of a JSON robot file; a URDF says nothing about soles, which come from the latter.

The file is parsed by ``urdf_parser_py`` of ROS (extra ``urdf``), which refuses incomplete links and joints by name.
"""

from __future__ import annotations

import math
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from nlp_gait.errors import MissingExtraError, RobotDataError
from nlp_gait.files import read_bytes
from nlp_gait.robots.fields import LARGEST_NUMBER, sound
from nlp_gait.robots.tree import inertia_moments, point_inertia

Array = np.ndarray[Any, np.dtype[np.float64]]

# What is read of a URDF; shapes, transmissions and plugins are dropped before parsing.
READ = {"link": {"inertial"}, "joint": {"origin", "parent", "child", "axis", "limit", "mimic"}}
TURNING = ("revolute", "continuous")


def urdf_record(path: str, *, about_joint: bool = False) -> dict[str, Any]:
    """Links and joints of a URDF by the schema of a robot file, without feet.

    All frames get the root's axes at the zero pose. Links that do not turn against each other become one: those behind fixed,
    prismatic, planar and floating joints, held at zero.

    Args:
        path: of the file.
        about_joint: the tensors are about the origins of the link frames, not about the centres of mass.

    Raises:
        MissingExtraError: the parser is not installed.
        RobotDataError: the file cannot be read, or is not a URDF.
        ValueError: its links do not form a tree, or one of its values is missing or not allowed.
    """
    model = _parsed(path)
    joints = {joint.child: joint for joint in model.joints}
    frames = _zero_pose(model, joints)
    carriers = {name: _carrier(name, joints) for name in frames}
    bodies: dict[str, list[tuple[float, Array, Array]]] = {}
    for link in model.links:
        bodies.setdefault(carriers[link.name], []).append(_matter(link, frames[link.name], about_joint))
    return {
        "schema": 1,
        "name": model.name,
        "description": f"from {Path(path).name}",
        "root": next(name for name in frames if name not in joints),
        "links": {name: _link(parts, frames[name][:3, 3]) for name, parts in bodies.items()},
        "joints": {j.name: _joint(j, frames, carriers) for j in model.joints if j.type in TURNING},
    }


def _parsed(path: str) -> Any:
    """``urdf_parser_py.urdf.Robot`` of a file."""
    if find_spec("urdf_parser_py") is None:
        raise MissingExtraError(
            f"robot file {path!r}: URDF files need the package urdf-parser-py, which is not installed: "
            "pip install 'nlp-gait[urdf]'"
        )
    etree = import_module("lxml.etree")
    parser: Any = import_module("urdf_parser_py.xml_reflection.core")
    data = read_bytes(Path(path), "robot file", error=RobotDataError)
    try:
        root = etree.fromstring(data, etree.XMLParser(resolve_entities=False, no_network=True, remove_comments=True))
    except (etree.XMLSyntaxError, ValueError) as error:
        raise RobotDataError(f"robot file {path!r} is not valid XML: {' '.join(str(error).split())}") from error
    if root.getroottree().docinfo.internalDTD is not None:  # a URDF has none; entities could read other files
        raise ValueError("a URDF must not have a DOCTYPE or entities; remove them")
    for element in list(root):
        kept = READ.get(element.tag)
        if kept is None:
            root.remove(element)
            continue
        for part in list(element):
            if part.tag not in kept:
                element.remove(part)
    tolerant, parser.on_error = parser.on_error, _refuse
    try:
        return import_module("urdf_parser_py.urdf").URDF.from_xml_string(etree.tostring(root))
    except Exception as error:  # the parser raises its own, KeyError, ValueError and AssertionError
        said = " ".join(str(error).split()) or type(error).__name__
        raise RobotDataError(f"robot file {path!r} is not a URDF of a robot: {said}") from error
    finally:
        parser.on_error = tolerant


def _refuse(message: str) -> None:
    """Replaces the parser's own answer to unknown tags and attributes and to repeated tags: a line on stderr."""
    raise RobotDataError(message)


def _zero_pose(model: Any, joints: dict[str, Any]) -> dict[str, Array]:
    """(4, 4) pose of each link's frame in the root's at zero angles, parents first; refuses links that do not form a tree."""
    names = [link.name for link in model.links]
    for kind, found in (("link", names), ("joint", [joint.name for joint in model.joints])):
        twice = sorted({name for name in found if found.count(name) > 1})
        if twice:
            raise ValueError(f"{kind} {twice[0]!r} appears twice")
    for joint in model.joints:
        for end in (joint.parent, joint.child):
            if end not in names:
                raise ValueError(f"joint {joint.name!r}: link {end!r} does not exist")
        if joints[joint.child] is not joint:
            raise ValueError(f"joint {joint.name!r}: link {joint.child!r} already has a parent")
    roots = [name for name in names if name not in joints]
    if len(roots) != 1:
        raise ValueError(f"exactly one link must have no parent, got {', '.join(roots) or 'none'}")
    frames: dict[str, Array] = {roots[0]: np.eye(4)}
    waiting = list(model.joints)
    while waiting:
        ready = [joint for joint in waiting if joint.parent in frames]
        if not ready:
            raise ValueError(f"joint {waiting[0].name!r} is part of a ring of joints")
        for joint in ready:
            frames[joint.child] = frames[joint.parent] @ _pose(joint.origin, f"joint {joint.name!r}")
        waiting = [joint for joint in waiting if joint.child not in frames]
    return frames


def _carrier(link: str, joints: dict[str, Any]) -> str:
    """The first link on the way to the root, itself included, that turns against its parent, or the root."""
    while link in joints and joints[link].type not in TURNING:
        link = joints[link].parent
    return link


def _matter(link: Any, frame: Array, about_joint: bool) -> tuple[float, Array, Array]:
    """Mass, centre of mass (3,) and tensor about it (3, 3), in the root's frame."""
    inertial = link.inertial
    if inertial is None:
        return 0.0, frame[:3, 3], np.zeros((3, 3))
    if inertial.mass is None or inertial.inertia is None:
        raise ValueError(f"link {link.name!r}: <inertial> must hold <mass> and <inertia>")
    if not sound([inertial.mass, *np.ravel(inertial.inertia.to_matrix())]):
        raise ValueError(f"link {link.name!r}: <mass> and <inertia> must hold finite numbers within {LARGEST_NUMBER:g}")
    pose = frame @ _pose(inertial.origin, f"link {link.name!r}")
    tensor = pose[:3, :3] @ np.array(inertial.inertia.to_matrix()) @ pose[:3, :3].T
    if about_joint:
        tensor = tensor - point_inertia(inertial.mass, pose[:3, 3] - frame[:3, 3])
    return inertial.mass, pose[:3, 3], tensor


def _link(parts: list[tuple[float, Array, Array]], origin: Array) -> dict[str, Any]:
    """Record of links that move as one, whose joint is at ``origin`` (3,)."""
    mass = sum(part[0] for part in parts)
    com = sum((m * c for m, c, _ in parts), np.zeros(3)) / mass if mass > 0.0 else origin
    tensor = sum((about + point_inertia(m, c - com) for m, c, about in parts), np.zeros((3, 3)))
    return {"mass_kg": mass, "com_m": (com - origin).tolist(), "inertia_com_kgm2": list(inertia_moments(tensor))}


def _joint(joint: Any, frames: dict[str, Array], carriers: dict[str, str]) -> dict[str, Any]:
    limit = joint.limit
    if limit is None:
        raise ValueError(
            f"joint {joint.name!r}: <limit> must give effort and velocity, and lower and upper if revolute"
        )
    if not sound(joint.axis or ()):
        raise ValueError(
            f"joint {joint.name!r}: <axis> must hold finite numbers within {LARGEST_NUMBER:g}, got {joint.axis}"
        )
    frame, parent = frames[joint.child], carriers[joint.parent]
    limits = [limit.lower, limit.upper] if joint.type == "revolute" else [-math.pi, math.pi]
    return {
        "parent": parent,
        "child": joint.child,
        "origin_m": (frame[:3, 3] - frames[parent][:3, 3]).tolist(),
        "axis": (frame[:3, :3] @ np.array(joint.axis or (1.0, 0.0, 0.0))).tolist(),
        "limits_rad": limits,
        "velocity_limit_rad_s": limit.velocity,
        "torque_limit_Nm": limit.effort,
    }


def _pose(origin: Any, owner: str) -> Array:
    """(4, 4) pose of an ``<origin>``: roll, pitch, yaw about fixed axes, then the position."""
    pose = np.eye(4)
    if origin is None:
        return pose
    if not sound([*(origin.rpy or ()), *(origin.xyz or ())]):
        raise ValueError(f"{owner}: <origin> must hold finite numbers, got xyz {origin.xyz}, rpy {origin.rpy}")
    roll, pitch, yaw = origin.rpy or (0.0, 0.0, 0.0)
    pose[:3, :3] = _turn(2, yaw) @ _turn(1, pitch) @ _turn(0, roll)
    pose[:3, 3] = origin.xyz or (0.0, 0.0, 0.0)
    return pose


def _turn(axis: int, angle: float) -> Array:
    """(3, 3) rotation about a coordinate axis; exact where the angle is zero."""
    i, j = (axis + 1) % 3, (axis + 2) % 3
    rotation = np.eye(3)
    rotation[[i, j], [i, j]] = math.cos(angle)
    rotation[i, j], rotation[j, i] = -math.sin(angle), math.sin(angle)
    return rotation
