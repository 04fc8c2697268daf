"""URDF files as links and joints of a robot; what a gait does not need, such as transmissions and plugins, is not read."""

import math
from collections import Counter
from collections.abc import Mapping
from functools import partial
from importlib.util import find_spec
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from nlp_gait.errors import MissingExtraError, RobotDataError
from nlp_gait.files import read_bytes
from nlp_gait.robots.meshes import (
    find_mesh,
    list_shape_points,
    make_pose,
    move_points,
    parse_xml,
    read_mesh_points,
    remove_namespace,
)
from nlp_gait.robots.robot import ANY_ANGLE, LARGEST_NUMBER, Joint, are_plausible, make_unit_axis, rank_joints
from nlp_gait.robots.tree import Array, Mass, compute_point_inertia, to_vector
from nlp_gait.robots.welding import FootShapes, LinkFrame, RobotParts, join_frames, list_carriers

MOMENTS = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")
LIMITS, DYNAMICS = ("effort", "velocity"), ("damping", "friction", "armature")  # the last one in files of Fourier
OWNERS = ("robot", "link", "joint")
# Attributes of the elements that are read, and elements without influence on a gait; others are listed as ignored.
ATTRIBUTES = {
    "robot": {"name", "version"},
    "link": {"name"},
    "joint": {"name", "type"},
    "inertial": set[str](),
    "origin": {"xyz", "rpy"},
    "mass": {"value"},
    "inertia": set(MOMENTS),
    "parent": {"link"},
    "child": {"link"},
    "axis": {"xyz"},
    "limit": {"lower", "upper", *LIMITS},
    "dynamics": set(DYNAMICS),
    "safety_controller": {"soft_lower_limit", "soft_upper_limit", "k_position", "k_velocity"},
}
WITHOUT_INFLUENCE = ("visual", "collision", "material")
TURNING = ("revolute", "continuous")
KINDS = (*TURNING, "prismatic", "floating", "planar", "fixed", "unknown")
SHAPES = ("collision", "visual")
WORLD = "world"
# Ends of the names of elements of xacro that change others.
XACRO = ("}arg", "}if", "}include", "}macro", "}property", "}unless")


def read_urdf(path: str, *, about_joint: bool = False) -> RobotParts:
    """Read the links and joints of a URDF.

    All frames get the root's axes at the zero pose. Links that do not turn against each other become one: those behind fixed,
    prismatic, planar and floating joints, which stay at zero. With ``about_joint``, the tensors refer to the origins of the
    link frames instead of the centres of mass. Raises MissingExtraError without lxml, RobotDataError if the file cannot be
    read, or ValueError if it is not a URDF, its links do not form a tree, or a value is missing or not allowed.
    """
    robot = _read_xml(path)
    _rename_world(robot)
    name = _read_text(robot, "name")
    links = {_read_text(link, "name"): link for link in robot.findall("link")}
    joints = [_read_joint(element) for element in robot.findall("joint")]
    poses = _place_links(robot, list(links), joints)
    joint_to = {joint.child: joint for joint in joints}
    frames = {}
    for link, element in links.items():
        parent, turns = (joint_to[link].parent, joint_to[link].kind in TURNING) if link in joint_to else (None, False)
        frames[link] = LinkFrame(parent, turns, poses[link][:3, 3], _read_mass(element, poses[link], about_joint))
    notes, turning = _list_ignored(robot), [joint for joint in joints if joint.kind in TURNING]
    unusable = {
        joint.child: f"mimics joint {mimic.get('joint')!r}: coupled joints are not supported; remove <mimic>"
        for joint in turning
        if (mimic := _find_part(joint.element, "mimic")) is not None
    }
    for key in LIMITS:
        zero = [joint for joint in turning if _read_limit(joint, key) == 0.0]
        if zero and len(zero) == len(turning):
            notes.append(f"{key} of every joint is 0: it is taken as not stated")
        else:
            unusable |= {joint.child: f"has {key} 0 in its <limit>: {NOT_DRIVEN}" for joint in zero}
    read_shapes = partial(_read_foot_shapes, Path(path), links, poses, list_carriers(frames))
    read = [_read_turning(joint, poses[joint.child]) for joint in turning]
    return join_frames(name, frames, read, read_shapes, notes, unusable)


def _rename_world(robot: Any) -> None:
    """Rename a link that has the name of the ground in MuJoCo, as the root of a robot often has in ROS."""
    for key, tags in (("name", ("link",)), ("link", ("parent", "child"))):
        for element in robot.iter(*tags):
            if element.get(key) == WORLD:
                element.set(key, f"{WORLD}_link")


NOT_DRIVEN = (
    "it is not driven, and closed chains are not supported; if it is, write its limit, or remove it for no limit"
)


class UrdfJoint(NamedTuple):
    """A joint of any kind."""

    element: Any  # of lxml
    name: str
    kind: str
    parent: str
    child: str


def list_meshes(path: str) -> list[str]:
    """Return the files of the meshes of collision shapes, or of visual shapes of links without; raises as ``read_urdf``."""
    shapes = (link.findall(SHAPES[0]) or link.findall(SHAPES[1]) for link in _read_xml(path).iter("link"))
    addresses = {mesh.get("filename", "") for listed in shapes for shape in listed for mesh in shape.iter("mesh")}
    return [str(file) for address in addresses if (file := find_mesh(address, Path(path))) is not None]


def _read_foot_shapes(
    path: Path, links: Mapping[str, Any], poses: Mapping[str, Array], carriers: Mapping[str, str], foot: str
) -> FootShapes:
    """Return the points of all shapes that move with a link, from its joint, along the root's axes at zero angles.

    Visual shapes count only if none of these links has a collision shape. Raises RobotDataError for a damaged mesh.
    """
    moving = [name for name in links if carriers[name] == foot]
    kind = next((kind for kind in SHAPES if any(links[name].findall(kind) for name in moving)), SHAPES[0])
    points, missing, others = [np.zeros((0, 3))], [], []
    for name in moving:
        for shape in links[name].findall(kind):
            pose = make_pose(-poses[foot][:3, 3]) @ poses[name] @ _read_pose(shape)
            for geometry in (child for parent in shape.findall("geometry") for child in parent):
                corners = _list_shape_points(geometry, pose, path)
                if corners is None:
                    missing.append(str(geometry.get("filename")))
                elif len(corners):
                    points.append(corners)
                else:
                    others.append(str(geometry.tag))
    return FootShapes(np.concatenate(points), kind, tuple(missing), tuple(others))


def _list_shape_points(shape: Any, pose: Array, path: Path) -> Array | None:
    """Return points (N, 3) of a shape at a pose (4, 4); None for a mesh that does not exist."""
    size: list[float] = []
    if shape.tag == "mesh":
        mesh = find_mesh(shape.get("filename", ""), path)
        scale = _read_numbers(shape, "scale", 3, "1 1 1")
        return None if mesh is None else move_points(read_mesh_points(mesh) * scale, pose)
    if shape.tag == "box":
        size = [width / 2 for width in _read_numbers(shape, "size", 3)]
    elif shape.tag == "sphere":
        size = [_read_number(shape, "radius")]
    elif shape.tag in ("cylinder", "capsule"):
        size = [_read_number(shape, "radius"), _read_number(shape, "length") / 2]
    return list_shape_points("cylinder" if shape.tag == "capsule" else shape.tag, size, pose)


def _read_xml(path: str) -> Any:
    if find_spec("lxml") is None:
        raise MissingExtraError(
            f"robot file {path!r}: URDF files need the package lxml, which is not installed: pip install 'nlp-gait[urdf]'"
        )
    try:
        robot = parse_xml(read_bytes(Path(path), "robot file", error=RobotDataError))
        remove_namespace(robot)
    except ValueError as error:
        raise RobotDataError(f"robot file {path!r} is not valid XML: {error}") from error
    if robot.getroottree().docinfo.internalDTD is not None:  # a URDF has none; entities could read other files
        raise ValueError("a URDF must not have a DOCTYPE or entities; remove them")
    if any("xacro}" in element.tag and element.tag.endswith(XACRO) for element in robot.iter("*")):
        raise ValueError("it is a xacro file; expand it first: xacro FILE > ROBOT.urdf")
    if robot.tag != "robot":
        raise ValueError(f"it is not a URDF of a robot: it begins with <{robot.tag}>, not <robot>")
    return robot


def _list_ignored(robot: Any) -> list[str]:
    """Return a note on the elements and attributes that are not read, with their numbers; none without any."""
    owners = robot.findall("link") + robot.findall("joint")
    parts = [robot, *robot, *(part for owner in owners for part in (*owner, *owner.findall("inertial/*")))]
    ignored = Counter[str]()
    for part in parts:
        if part.tag in ATTRIBUTES:
            ignored.update(f"attribute {odd!r} of <{part.tag}>" for odd in set(part.attrib) - ATTRIBUTES[part.tag])
        elif part.tag not in WITHOUT_INFLUENCE:
            ignored[f"<{part.tag.rpartition('}')[2]}>"] += 1
    listed = ", ".join(f"{name} ({count})" for name, count in sorted(ignored.items()))
    return [f"ignored: {listed}"] if listed else []


def _read_joint(element: Any) -> UrdfJoint:
    kind = _read_text(element, "type")
    if kind not in KINDS:
        raise ValueError(f"{_name_owner(element)}: type must be one of {', '.join(KINDS)}, got {kind[:60]!r}")
    parent, child = (_read_text(_find_part(element, end, needed=True), "link") for end in ("parent", "child"))
    return UrdfJoint(element, _read_text(element, "name"), kind, parent, child)


def _place_links(robot: Any, names: list[str], joints: list[UrdfJoint]) -> dict[str, Array]:
    """Return the pose (4, 4) of each link's frame in the root's at zero angles, parents first; raises ValueError."""
    for kind in ("link", "joint"):
        listed = [element.get("name") for element in robot.findall(kind)]
        if duplicates := sorted({name for name in listed if listed.count(name) > 1}):
            raise ValueError(f"{kind} {duplicates[0]!r} appears twice")
    root, ordered = rank_joints(names, joints)
    poses: dict[str, Array] = {root: np.eye(4)}
    for joint in ordered:
        poses[joint.child] = poses[joint.parent] @ _read_pose(joint.element)
    return poses


def _read_mass(link: Any, frame: Array, about_joint: bool) -> Mass:
    inertial = _find_part(link, "inertial")
    if inertial is None:
        return Mass(0.0, frame[:3, 3], np.zeros((3, 3)))
    inertia = _find_part(inertial, "inertia", needed=True)
    mass_kg = _read_number(_find_part(inertial, "mass", needed=True), "value")
    ixx, iyy, izz, ixy, ixz, iyz = (_read_number(inertia, key) for key in MOMENTS)
    pose = frame @ _read_pose(inertial)
    tensor = pose[:3, :3] @ np.array([[ixx, ixy, ixz], [ixy, iyy, iyz], [ixz, iyz, izz]]) @ pose[:3, :3].T
    if about_joint:
        tensor = tensor - compute_point_inertia(mass_kg, pose[:3, 3] - frame[:3, 3])
    return Mass(mass_kg, pose[:3, 3], tensor)


def _read_turning(joint: UrdfJoint, frame: Array) -> Joint:
    limit, axis = _find_part(joint.element, "limit"), _find_part(joint.element, "axis")
    low, high = ANY_ANGLE
    if joint.kind == "revolute" and limit is not None and {"lower", "upper"} & set(limit.attrib):
        low, high = (_read_number(limit, key, "0", finite=False) for key in ("lower", "upper"))
    soft = _find_part(joint.element, "safety_controller")
    planned = [low, high]
    for k, (key, pick) in enumerate((("soft_lower_limit", max), ("soft_upper_limit", min))):
        if soft is not None and soft.get(key) is not None:
            planned[k] = pick(planned[k], _read_number(soft, key))
    dynamics = _find_part(joint.element, "dynamics")
    damping, friction, armature = (0.0 if dynamics is None else _read_number(dynamics, key, "0") for key in DYNAMICS)
    effort, velocity = (_read_limit(joint, key) or math.inf for key in LIMITS)
    direction = (1.0, 0.0, 0.0) if axis is None else _read_numbers(axis, "xyz", 3)
    return Joint(
        name=joint.name,
        parent=joint.parent,
        child=joint.child,
        origin_m=(0.0, 0.0, 0.0),  # ``join_frames`` places it
        axis=make_unit_axis(to_vector(frame[:3, :3] @ np.array(direction))),
        limits_rad=(low, high),
        planning_limits_rad=(planned[0], planned[1]),
        velocity_limit_rad_s=velocity,
        torque_limit_Nm=effort,
        damping_Nms_rad=damping,
        friction_Nm=friction,
        armature_kgm2=armature,
    )


def _read_limit(joint: UrdfJoint, key: str) -> float:
    """Return the limit of a joint's effort or velocity; infinite where it is not stated, negative or not plausible."""
    limit = _find_part(joint.element, "limit")
    value = math.inf if limit is None else _read_number(limit, key, "inf", finite=False)
    return value if 0.0 <= value <= LARGEST_NUMBER else math.inf


def _read_pose(element: Any) -> Array:
    """Return the pose (4, 4) that the <origin> of an element gives, without one the identity."""
    origin = _find_part(element, "origin")
    if origin is None:
        return np.eye(4)
    return make_pose(_read_numbers(origin, "xyz", 3, "0 0 0"), _read_numbers(origin, "rpy", 3, "0 0 0"))


def _find_part(element: Any, tag: str, *, needed: bool = False) -> Any:
    """Return the only element of a tag in another one, None without one; raises ValueError for several, or a needed one."""
    children = element.findall(tag)
    if len(children) > 1 or (needed and not children):
        raise ValueError(f"{_name_owner(element)}: <{element.tag}> must have one <{tag}>, got {len(children)}")
    return children[0] if children else None


def _read_text(element: Any, key: str) -> str:
    if element.get(key) is None:
        raise ValueError(f"{_name_owner(element)}: <{element.tag}> needs the attribute {key!r}")
    return str(element.get(key))


def _read_number(element: Any, key: str, default: str | None = None, *, finite: bool = True) -> float:
    return _read_numbers(element, key, 1, default, finite=finite)[0]


def _read_numbers(
    element: Any, key: str, count: int, default: str | None = None, *, finite: bool = True
) -> list[float]:
    text = _read_text(element, key) if default is None else element.get(key, default)
    try:
        values = [float(word) for word in text.split()]
    except ValueError:
        values = []
    if len(values) != count or (finite and not are_plausible(values)):
        wanted = f"{count} finite number{'s' * (count > 1)} within {LARGEST_NUMBER:g}"
        raise ValueError(f"{_name_owner(element)}: {key} of <{element.tag}> must be {wanted}, got {text[:60]!r}")
    return values


def _name_owner(element: Any) -> str:
    """Return the link or joint that contains an element, for messages."""
    owners = [node for node in (element, *element.iterancestors()) if node.tag in OWNERS]
    return f"{owners[0].tag} {owners[0].get('name')!r}"
