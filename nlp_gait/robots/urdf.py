"""URDF files in the form of a JSON robot file; ``urdf_parser_py`` of ROS (extra ``urdf``) refuses incomplete links and joints."""

import math
import re
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from nlp_gait.errors import MissingExtraError, RobotDataError, warn_once
from nlp_gait.files import protect_input, read_bytes
from nlp_gait.robots.meshes import (
    FootShapes,
    find_mesh,
    list_box_points,
    list_cylinder_points,
    make_pose,
    parse_xml,
    read_mesh_points,
)
from nlp_gait.robots.robot import LARGEST_NUMBER, are_plausible
from nlp_gait.robots.tree import Array, Mass, combine_masses, compute_point_inertia

# Elements that are read; shapes, transmissions and plugins are removed before parsing.
READ = {"link": {"inertial"}, "joint": {"origin", "parent", "child", "axis", "limit", "mimic"}}
TURNING = ("revolute", "continuous")
SHAPES = ("collision", "visual")
MOST_PARTS = 2000  # links and joints; the time to read them grows with the square
# The parser's message for an unknown attribute of an element without numbers.
OWNER = re.compile(r"^Unknown attribute .* in (/robot[^/]*)?/?(robot|link|joint)(\[[^\]]*\])?$")


def read_urdf(path: str, *, about_joint: bool = False) -> dict[str, Any]:
    """Read links and joints of a URDF by the schema of a robot file, without feet.

    All frames get the root's axes at the zero pose. Links that do not turn against each other become one: those behind fixed,
    prismatic, planar and floating joints, which stay at zero. With ``about_joint``, the tensors refer to the origins of the
    link frames instead of the centres of mass. Raises MissingExtraError without the parser, RobotDataError if the file cannot be
    read or is not a URDF, or ValueError if its links do not form a tree, or a value is missing or not allowed.
    """
    model = _parse(_read_xml(path), path)
    joints = {joint.child: joint for joint in model.joints}
    frames = _place_links(model, joints)
    carriers = {name: _find_carrier(name, joints) for name in frames}
    bodies: dict[str, list[Mass]] = {}
    for link in model.links:
        bodies.setdefault(carriers[link.name], []).append(_read_mass(link, frames[link.name], about_joint))
    return {
        "schema": 1,
        "name": model.name,
        "description": f"from {Path(path).name}",
        "root": next(name for name in frames if name not in joints),
        "links": {name: combine_masses(parts).move(-frames[name][:3, 3]).to_record() for name, parts in bodies.items()},
        "joints": {j.name: _describe_joint(j, frames, carriers) for j in model.joints if j.type in TURNING},
    }


def find_moving_link(path: str, link: str) -> str:
    """Return the link that turns with a link behind fixed joints, or the link itself; raises as ``read_urdf``."""
    joints = {joint.child: joint for joint in _parse(_read_xml(path), path).joints}
    return _find_carrier(link, joints)


def read_foot_shapes(path: str, link: str) -> FootShapes:
    """Return the points of all shapes that move with a link, from its joint, along the root's axes at zero angles.

    Visual shapes count only if none of these links has a collision shape. Raises as ``read_urdf``, or for a damaged mesh.
    """
    tree = _read_xml(path)
    shapes = {kind: {part.get("name"): part.findall(kind) for part in tree.iter("link")} for kind in SHAPES}
    model = _parse(tree, path)
    joints = {joint.child: joint for joint in model.joints}
    frames = {name: frame for name, frame in _place_links(model, joints).items() if _find_carrier(name, joints) == link}
    kind = next((kind for kind in SHAPES if any(shapes[kind][name] for name in frames)), SHAPES[0])
    found, missing = [np.zeros((0, 3))], []
    for name, frame in frames.items():
        for shape in shapes[kind][name]:
            geometries = [part for geometry in shape.findall("geometry") for part in geometry]
            origin = {} if shape.find("origin") is None else shape.find("origin").attrib
            place, angles = (_parse_numbers(origin.get(key, "0 0 0"), 3, name) for key in ("xyz", "rpy"))
            pose = make_pose(-frames[link][:3, 3]) @ frame @ make_pose(place, angles)
            for geometry in geometries:
                points = _list_shape_points(geometry, pose, Path(path), name)
                if points is None:
                    missing.append(str(geometry.get("filename")))
                else:
                    found.append(points)
    return FootShapes(np.concatenate(found), kind, tuple(missing))


def list_meshes(path: str) -> list[str]:
    """Return the files of the meshes of collision shapes, or of visual shapes of links without; raises as ``read_urdf``."""
    shapes = (link.findall(SHAPES[0]) or link.findall(SHAPES[1]) for link in _read_xml(path).iter("link"))
    addresses = {mesh.get("filename", "") for listed in shapes for shape in listed for mesh in shape.iter("mesh")}
    return [str(file) for address in addresses if (file := find_mesh(address, Path(path))) is not None]


def _list_shape_points(kind: Any, pose: Array, file: Path, link: str) -> Array | None:
    """Return points (N, 3) of a shape at a pose (4, 4); None for a mesh that does not exist."""
    if kind.tag == "mesh":
        mesh = find_mesh(kind.get("filename", ""), file)
        if mesh is None:
            return None
        points = read_mesh_points(mesh) * _parse_numbers(kind.get("scale", "1 1 1"), 3, link)
    elif kind.tag == "box":
        points = list_box_points(np.array(_parse_numbers(kind.get("size", ""), 3, link)) / 2)
    elif kind.tag == "sphere":
        centre, (radius,) = pose[:3, 3], _parse_numbers(kind.get("radius", ""), 1, link)
        return np.array([centre - [0.0, 0.0, radius]])
    elif kind.tag in ("cylinder", "capsule"):
        (radius,), (length,) = (_parse_numbers(kind.get(name, ""), 1, link) for name in ("radius", "length"))
        points = list_cylinder_points(radius, length / 2)
    else:
        return np.zeros((0, 3))
    return np.asarray(points @ pose[:3, :3].T + pose[:3, 3])


def _parse_numbers(text: str, count: int, link: str) -> list[float]:
    values = [float(word) for word in text.split()]
    if len(values) != count or not are_plausible(values):
        raise ValueError(f"link {link!r}: a shape needs {count} finite numbers, got {text[:60]!r}")
    return values


def _read_xml(path: str) -> Any:
    if find_spec("urdf_parser_py") is None:
        raise MissingExtraError(
            f"robot file {path!r}: URDF files need the package urdfdom-py, which is not installed: "
            "pip install 'nlp-gait[urdf]'"
        )
    data = read_bytes(Path(path), "robot file", error=RobotDataError)
    try:
        root = parse_xml(data)
    except ValueError as error:
        raise RobotDataError(f"robot file {path!r} is not valid XML: {error}") from error
    if root.getroottree().docinfo.internalDTD is not None:  # a URDF has none; entities could read other files
        raise ValueError("a URDF must not have a DOCTYPE or entities; remove them")
    parts = len(root.findall("link")) + len(root.findall("joint"))
    if parts > MOST_PARTS:
        raise ValueError(f"it has {parts} links and joints, more than {MOST_PARTS}; simplify the file")
    for mesh in filter(None, (find_mesh(element.get("filename", ""), Path(path)) for element in root.iter("mesh"))):
        protect_input(mesh)
    return root


def _parse(root: Any, path: str) -> Any:
    """Return a ``urdf_parser_py.urdf.Robot``, after removing all elements that are not read."""
    etree = import_module("lxml.etree")
    parser: Any = import_module("urdf_parser_py.xml_reflection.core")
    for element in list(root):
        if element.tag not in READ:
            root.remove(element)
            continue
        for part in list(element):
            if part.tag not in READ[element.tag]:
                element.remove(part)
    tolerant, parser.on_error = parser.on_error, partial(_handle_message, path)
    try:
        return import_module("urdf_parser_py.urdf").URDF.from_xml_string(etree.tostring(root))
    except Exception as error:  # the parser raises its own, KeyError, ValueError and AssertionError
        reason = " ".join(str(error).split()) or type(error).__name__
        raise RobotDataError(f"robot file {path!r} is not a URDF of a robot: {reason}") from error
    finally:
        parser.on_error = tolerant


def _handle_message(path: str, message: str) -> None:
    """Warn of an unknown attribute of a link or joint; raise for other messages, such as a misspelt number of a limit."""
    if not OWNER.search(message):
        raise RobotDataError(message)
    warn_once("robot file %r: %s; it is ignored, and may be removed", path, message)


def _place_links(model: Any, joints: dict[str, Any]) -> dict[str, Array]:
    """Return the pose (4, 4) of each link's frame in the root's at zero angles, parents first; raises ValueError."""
    names = [link.name for link in model.links]
    for kind, found in (("link", names), ("joint", [joint.name for joint in model.joints])):
        duplicates = sorted({name for name in found if found.count(name) > 1})
        if duplicates:
            raise ValueError(f"{kind} {duplicates[0]!r} appears twice")
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
            frames[joint.child] = frames[joint.parent] @ _read_pose(joint.origin, f"joint {joint.name!r}")
        waiting = [joint for joint in waiting if joint.child not in frames]
    return frames


def _find_carrier(link: str, joints: dict[str, Any]) -> str:
    """Return the first link from this one to the root that turns against its parent, or the root."""
    while link in joints and joints[link].type not in TURNING:
        link = joints[link].parent
    return link


def _read_mass(link: Any, frame: Array, about_joint: bool) -> Mass:
    inertial = link.inertial
    if inertial is None:
        return Mass(0.0, frame[:3, 3], np.zeros((3, 3)))
    if inertial.mass is None or inertial.inertia is None:
        raise ValueError(f"link {link.name!r}: <inertial> must hold <mass> and <inertia>")
    if not are_plausible([inertial.mass, *np.ravel(inertial.inertia.to_matrix())]):
        raise ValueError(f"link {link.name!r}: <mass> and <inertia> must hold finite numbers within {LARGEST_NUMBER:g}")
    pose = frame @ _read_pose(inertial.origin, f"link {link.name!r}")
    tensor = pose[:3, :3] @ np.array(inertial.inertia.to_matrix()) @ pose[:3, :3].T
    if about_joint:
        tensor = tensor - compute_point_inertia(inertial.mass, pose[:3, 3] - frame[:3, 3])
    return Mass(inertial.mass, pose[:3, 3], tensor)


def _describe_joint(joint: Any, frames: dict[str, Array], carriers: dict[str, str]) -> dict[str, Any]:
    limit = joint.limit
    if limit is None:
        raise ValueError(
            f"joint {joint.name!r}: <limit> must give effort and velocity, and lower and upper if revolute"
        )
    if not are_plausible(joint.axis or ()):
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


def _read_pose(origin: Any, owner: str) -> Array:
    if origin is None:
        return np.eye(4)
    if not are_plausible([*(origin.rpy or ()), *(origin.xyz or ())]):
        raise ValueError(f"{owner}: <origin> must hold finite numbers, got xyz {origin.xyz}, rpy {origin.rpy}")
    return make_pose(origin.xyz or (0.0, 0.0, 0.0), origin.rpy or (0.0, 0.0, 0.0))
