"""Points of collision shapes: primitives, and the corners of STL, OBJ and Collada files.

Nothing but corners is read, and hostile files are refused; libraries for meshes expand XML entities and skip damaged parts.
"""

import math
import os
from collections.abc import Callable, Sequence
from functools import partial
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from nlp_gait.errors import RobotDataError
from nlp_gait.files import read_bytes
from nlp_gait.robots.robot import are_plausible
from nlp_gait.robots.tree import Array, rotate

PACKAGES = ("package://", "model://")  # where a path begins with the name of a package or, in Gazebo, of a model
POINTER = b"version https://git-lfs"  # first bytes of a file whose content Git LFS has not fetched
FOLDER_VARIABLES = ("ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH")
STL_HEADER, STL_TRIANGLE = 84, 50  # bytes
RIM = 24  # points of a cylinder's edge


def find_mesh(address: str, robot_file: Path) -> Path | None:
    """Find the file of a mesh: one of a package or model above the robot's file or in ROS's folders, another one beside it.

    The name of a package need not be that of its folder; paths are often relative to the folder above.
    """
    if "\0" in address:
        return None
    above = robot_file.absolute().parents
    if not address.startswith(PACKAGES):
        path = Path(address.removeprefix("file://"))
        return next((file for folder in above[:2] if os.path.isfile(file := folder / path)), None)
    path = Path(address.partition("://")[2].lstrip("/"))
    if ".." in path.parts or not path.parts:
        return None
    listed = [
        Path(folder) for name in FOLDER_VARIABLES for folder in os.environ.get(name, "").split(os.pathsep) if folder
    ]
    inside = Path(*path.parts[1:])
    candidates = [folder / path for folder in (*above, *listed, *(folder / "share" for folder in listed))]
    candidates += [folder / inside for folder in (*above, *listed)]
    return next((file for file in candidates if os.path.isfile(file)), None)


def parse_xml(data: bytes) -> Any:
    """Return the root element; entities stay unresolved, and nothing else is read. Raises ValueError."""
    etree = import_module("lxml.etree")
    try:
        parser = etree.XMLParser(resolve_entities=False, no_network=True, remove_comments=True, remove_pis=True)
        return etree.fromstring(data, parser)
    except etree.XMLSyntaxError as error:
        raise ValueError(" ".join(str(error).split())) from error


def remove_namespace(root: Any) -> None:
    """Take the root's namespace out of the names of all elements."""
    namespace = root.tag.rpartition("}")[0] + "}"
    for element in root.iter("*"):  # not entities
        element.tag = element.tag.removeprefix(namespace)


def make_pose(place: Sequence[float] | Array, roll_pitch_yaw: Sequence[float] = (0.0, 0.0, 0.0)) -> Array:
    """Return the pose (4, 4) of a place (3,) [m] and angles about fixed axes [rad]."""
    from scipy.spatial.transform import Rotation

    pose = np.eye(4)
    pose[:3, :3] = Rotation.from_euler("xyz", roll_pitch_yaw).as_matrix()
    pose[:3, 3] = place
    return pose


def list_shape_points(kind: str, size: Sequence[float] | Array, pose: Array) -> Array:
    """Return points (N, 3) of a shape at a pose (4, 4): corners, edges, or the lowest points of round shapes; none of others.

    ``size``: half the sizes of a box, the radius of a sphere, radius and half the length of a cylinder or capsule along z.
    """
    if kind == "sphere":
        return np.array([pose[:3, 3] - [0.0, 0.0, size[0]]])
    if kind == "capsule":
        return move_points(np.array([[0.0, 0.0, -size[1]], [0.0, 0.0, size[1]]]), pose) - [0.0, 0.0, size[0]]
    if kind == "box":
        corners = [[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
        return move_points(np.array(corners) * np.asarray(size), pose)
    if kind == "cylinder":
        turns = np.linspace(0.0, 2.0 * math.pi, RIM, endpoint=False)
        rim = size[0] * np.stack([np.cos(turns), np.sin(turns), np.zeros(RIM)], axis=1)
        return move_points(np.concatenate([rim + [0.0, 0.0, end * size[1]] for end in (-1, 1)]), pose)
    return np.zeros((0, 3))


def move_points(points: Array, pose: Array) -> Array:
    """Return points (N, 3) that are given in a frame at a pose (4, 4)."""
    return np.asarray(points @ pose[:3, :3].T + pose[:3, 3])


def read_mesh_points(path: Path) -> Array:
    """Read the corners (N, 3) of a mesh in the file's unit, of Collada in metres; raises RobotDataError."""
    data = read_bytes(path, "mesh", error=RobotDataError)
    check_pointer(path, data)
    readers: dict[str, Callable[[bytes], Array]] = {
        ".stl": _read_stl,
        ".obj": partial(_read_lines, "v", "utf-8"),
        ".dae": _read_collada,
    }
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise RobotDataError(f"mesh {str(path)!r}: supported formats are {', '.join(readers)}")
    try:
        points = reader(data)
    except (ValueError, KeyError, IndexError, AttributeError, TypeError, RecursionError) as error:
        raise RobotDataError(f"mesh {str(path)!r} is damaged: {' '.join(str(error).split())[:200]}") from error
    if not len(points) or not are_plausible(points):
        raise RobotDataError(f"mesh {str(path)!r} has no points, or points that are not finite")
    return np.asarray(points, dtype=float)


def check_pointer(path: Path, data: bytes) -> None:
    """Raise RobotDataError for a pointer of Git LFS in place of the content."""
    if data.startswith(POINTER):
        raise RobotDataError(f"file {str(path)!r} is a Git LFS pointer, not its content; run: git lfs pull")


def _read_stl(data: bytes) -> Array:
    if len(data) >= STL_HEADER:
        count = int.from_bytes(data[80:84], "little")
        if len(data) == STL_HEADER + count * STL_TRIANGLE:
            triangles = np.frombuffer(data, np.dtype(("V", STL_TRIANGLE)), count, STL_HEADER)
            floats = triangles.view(np.uint8).reshape(count, STL_TRIANGLE)[:, 12:48].copy().view("<f4")
            return np.unique(floats.reshape(-1, 3).astype(float), axis=0)
    return _read_lines("vertex", "ascii", data)


def _read_lines(first: str, encoding: str, data: bytes) -> Array:
    """Return the numbers of the lines of a text that begin with a word."""
    words = (line.split() for line in data.decode(encoding).splitlines())
    return np.array([[float(w) for w in line[1:4]] for line in words if line[:1] == [first]])


def _read_collada(data: bytes) -> Array:
    root = parse_xml(data)
    remove_namespace(root)
    geometries = {f"#{geometry.get('id')}": _read_positions(geometry) for geometry in root.iter("geometry")}
    unit = root.find("asset/unit")
    scale = float(unit.get("meter", "1")) if unit is not None else 1.0
    scene = root.find("library_visual_scenes/visual_scene")
    placed: list[Array] = []

    def visit(node: Any, pose: Array) -> None:
        for child in node:
            if child.tag in ("matrix", "translate", "rotate", "scale"):
                pose = pose @ _transform(child)
            elif child.tag == "instance_geometry":
                placed.append(move_points(geometries[child.get("url")], pose))
            elif child.tag == "node":
                visit(child, pose)

    if scene is not None:
        visit(scene, np.eye(4))
    # ``up_axis`` is ignored, as RViz, Gazebo classic, MoveIt and Pinocchio do.
    return np.asarray(scale * np.concatenate(placed or list(geometries.values())))


def _read_positions(geometry: Any) -> Array:
    vertices = geometry.find("mesh/vertices/input[@semantic='POSITION']")
    source = vertices.get("source").lstrip("#")
    array = next(s for s in geometry.iter("source") if s.get("id") == source)
    return np.array([float(word) for word in array.findtext("float_array").split()]).reshape(-1, 3)


def _transform(node: Any) -> Array:
    values = [float(word) for word in (node.text or "").split()]
    pose = np.eye(4)
    if node.tag == "matrix":
        return np.array(values).reshape(4, 4)
    if node.tag == "translate":
        pose[:3, 3] = values
    elif node.tag == "scale":
        pose[:3, :3] = np.diag(values)
    else:
        pose[:3, :3] = rotate(np.array(values[:3]) / np.linalg.norm(values[:3]), math.radians(values[3]))
    return pose
