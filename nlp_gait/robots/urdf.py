"""Robots from URDF files, in the form of a JSON robot file; a URDF says nothing about soles, which come from the latter.

The file is parsed by ``urdf_parser_py`` of ROS (extra ``urdf``), which refuses incomplete links and joints by name.
"""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from nlp_gait.errors import MissingExtraError, RobotDataError, warn_once
from nlp_gait.files import read_bytes
from nlp_gait.robots.fields import LARGEST_NUMBER, sound
from nlp_gait.robots.meshes import mesh_file, mesh_points
from nlp_gait.robots.tree import inertia_moments, point_inertia

Array = np.ndarray[Any, np.dtype[np.float64]]

# What is read of a URDF; shapes, transmissions and plugins are dropped before parsing.
READ = {"link": {"inertial"}, "joint": {"origin", "parent", "child", "axis", "limit", "mimic"}}
TURNING = ("revolute", "continuous")
RIM = 24  # points of a cylinder's edge
# The parser's words for an unknown attribute of what holds no number itself.
OWNER = re.compile(r"^Unknown attribute .* in (/robot[^/]*)?/?(robot|link|joint)(\[[^\]]*\])?$")


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
    model = _parsed(_xml(path), path)
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


def collision_points(path: str, link: str) -> tuple[Array, tuple[str, ...]]:
    """Points of all collision shapes that move with a link, from its joint, along the root's axes at zero angles.

    Args:
        path: of the file.
        link: as ``urdf_record`` has it.

    Returns:
        (N, 3) corners of boxes and meshes, edges of cylinders and lowest points of spheres [m], and meshes that are not there.

    Raises:
        RobotDataError: as ``urdf_record``, or a mesh that cannot be read.
        ValueError: likewise.
    """
    tree = _xml(path)
    shapes = {element.get("name"): element.findall("collision") for element in tree.iter("link")}
    model = _parsed(tree, path)
    joints = {joint.child: joint for joint in model.joints}
    frames = _zero_pose(model, joints)
    found, missing = [np.zeros((0, 3))], []
    for name, frame in frames.items():
        if _carrier(name, joints) != link:
            continue
        for shape in shapes.get(name, ()):
            kinds = [kind for geometry in shape.findall("geometry") for kind in geometry]
            pose = np.linalg.inv(_at(frames[link][:3, 3])) @ frame @ _shape_pose(shape.find("origin"), name)
            for kind in kinds:
                points = _shape_points(kind, pose, Path(path), name)
                if points is None:
                    missing.append(str(kind.get("filename")))
                else:
                    found.append(points)
    return np.concatenate(found), tuple(missing)


def _shape_points(kind: Any, pose: Array, file: Path, link: str) -> Array | None:
    """(N, 3) of one shape at a pose (4, 4); None for a mesh that is not there."""
    if kind.tag == "mesh":
        mesh = mesh_file(kind.get("filename", ""), file)
        if mesh is None:
            return None
        points = mesh_points(mesh) * _numbers(kind.get("scale", "1 1 1"), 3, link)
    elif kind.tag == "box":
        half = np.array(_numbers(kind.get("size", ""), 3, link)) / 2
        points = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]) * half
    elif kind.tag == "sphere":
        centre, (radius,) = pose[:3, 3], _numbers(kind.get("radius", ""), 1, link)
        return np.array([centre - [0.0, 0.0, radius]])
    elif kind.tag in ("cylinder", "capsule"):
        (radius,), (length,) = (_numbers(kind.get(name, ""), 1, link) for name in ("radius", "length"))
        turns = np.linspace(0.0, 2.0 * math.pi, RIM, endpoint=False)
        rim = radius * np.stack([np.cos(turns), np.sin(turns), np.zeros(RIM)], axis=1)
        points = np.concatenate([rim + [0.0, 0.0, end * length / 2] for end in (-1, 1)])
    else:
        return np.zeros((0, 3))
    return np.asarray(points @ pose[:3, :3].T + pose[:3, 3])


def _shape_pose(origin: Any, link: str) -> Array:
    if origin is None:
        return np.eye(4)
    pose = _at(np.array(_numbers(origin.get("xyz", "0 0 0"), 3, link)))
    roll, pitch, yaw = _numbers(origin.get("rpy", "0 0 0"), 3, link)
    pose[:3, :3] = _turn(2, yaw) @ _turn(1, pitch) @ _turn(0, roll)
    return pose


def _at(place: Array) -> Array:
    pose = np.eye(4)
    pose[:3, 3] = place
    return pose


def _numbers(text: str, count: int, link: str) -> list[float]:
    values = [float(word) for word in text.split()]
    if len(values) != count or not sound(values):
        raise ValueError(f"link {link!r}: a collision shape needs {count} finite numbers, got {text[:60]!r}")
    return values


def _xml(path: str) -> Any:
    """Root element of a file."""
    if find_spec("urdf_parser_py") is None:
        raise MissingExtraError(
            f"robot file {path!r}: URDF files need the package urdf-parser-py, which is not installed: "
            "pip install 'nlp-gait[urdf]'"
        )
    etree = import_module("lxml.etree")
    data = read_bytes(Path(path), "robot file", error=RobotDataError)
    try:
        root = etree.fromstring(data, etree.XMLParser(resolve_entities=False, no_network=True, remove_comments=True))
    except (etree.XMLSyntaxError, ValueError) as error:
        raise RobotDataError(f"robot file {path!r} is not valid XML: {' '.join(str(error).split())}") from error
    if root.getroottree().docinfo.internalDTD is not None:  # a URDF has none; entities could read other files
        raise ValueError("a URDF must not have a DOCTYPE or entities; remove them")
    return root


def _parsed(root: Any, path: str) -> Any:
    """``urdf_parser_py.urdf.Robot`` of a root element, from which what is not read is removed."""
    etree = import_module("lxml.etree")
    parser: Any = import_module("urdf_parser_py.xml_reflection.core")
    for element in list(root):
        kept = READ.get(element.tag)
        if kept is None:
            root.remove(element)
            continue
        for part in list(element):
            if part.tag not in kept:
                element.remove(part)
    tolerant, parser.on_error = parser.on_error, _told(path)
    try:
        return import_module("urdf_parser_py.urdf").URDF.from_xml_string(etree.tostring(root))
    except Exception as error:  # the parser raises its own, KeyError, ValueError and AssertionError
        said = " ".join(str(error).split()) or type(error).__name__
        raise RobotDataError(f"robot file {path!r} is not a URDF of a robot: {said}") from error
    finally:
        parser.on_error = tolerant


def _told(path: str) -> Callable[[str], None]:
    """Replaces the parser's own answer, a line on stderr: an unknown attribute of a link or joint is a warning.

    One of a limit or an origin is an error, as anything else: it may be a misspelt number.
    """

    def tell(message: str) -> None:
        if not OWNER.search(message):
            raise RobotDataError(message)
        warn_once("robot file %r: %s; it is not read, and may be removed", path, message)

    return tell


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
