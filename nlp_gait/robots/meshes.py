"""Corner points of meshes, STL, OBJ and Collada, and where ``package://`` leads; nothing else of them is read."""

from __future__ import annotations

import math
import os
from importlib import import_module
from pathlib import Path
from typing import Any

import numpy as np

from nlp_gait.errors import RobotDataError
from nlp_gait.files import read_bytes
from nlp_gait.robots.fields import sound

Array = np.ndarray[Any, np.dtype[np.float64]]

PACKAGE = "package://"
FOLDER_VARIABLES = ("ROS_PACKAGE_PATH", "AMENT_PREFIX_PATH")
STL_HEADER, STL_TRIANGLE = 84, 50  # bytes
DEEPEST_NODE = 32  # of a Collada scene


def mesh_file(address: str, beside: Path) -> Path | None:
    """File of a mesh: ``package://`` is looked for above the robot's file and where ROS looks; None if it is not there.

    Args:
        address: as the robot's file has it.
        beside: the robot's file.
    """
    if "\0" in address:
        return None
    if not address.startswith(PACKAGE):
        file = beside.parent / address.removeprefix("file://")
        return file if os.path.isfile(file) else None
    path = Path(address.removeprefix(PACKAGE).lstrip("/"))
    if ".." in path.parts or not path.parts:
        return None
    listed = [Path(part) for name in FOLDER_VARIABLES for part in os.environ.get(name, "").split(os.pathsep) if part]
    above = [*beside.absolute().parents, *listed, *(folder / "share" for folder in listed)]
    inside = [folder for folder in above if folder.name == path.parts[0]]
    candidates = [*(folder / path for folder in above), *(folder.joinpath(*path.parts[1:]) for folder in inside)]
    return next((file for file in candidates if os.path.isfile(file)), None)


def mesh_points(path: Path) -> Array:
    """(N, 3) corners in the file's own unit, Collada's in metres.

    Raises:
        RobotDataError: the file cannot be read, or is of another kind or damaged.
    """
    data = read_bytes(path, "mesh", error=RobotDataError)
    readers = {".stl": _stl, ".obj": _obj, ".dae": _collada}
    reader = readers.get(path.suffix.lower())
    if reader is None:
        raise RobotDataError(f"mesh {str(path)!r}: only {', '.join(readers)} are read")
    try:
        points = reader(data)
    except (ValueError, KeyError, IndexError, AttributeError, TypeError, RecursionError) as error:
        raise RobotDataError(f"mesh {str(path)!r} is damaged: {' '.join(str(error).split())[:200]}") from error
    if not len(points) or not sound(points):
        raise RobotDataError(f"mesh {str(path)!r} has no points, or some that are not finite")
    return points


def _stl(data: bytes) -> Array:
    if len(data) >= STL_HEADER:
        count = int.from_bytes(data[80:84], "little")
        if len(data) == STL_HEADER + count * STL_TRIANGLE:
            triangles = np.frombuffer(data, np.dtype(("V", STL_TRIANGLE)), count, STL_HEADER)
            floats = triangles.view(np.uint8).reshape(count, STL_TRIANGLE)[:, 12:48].copy().view("<f4")
            return np.unique(floats.reshape(-1, 3).astype(float), axis=0)
    words = (line.split() for line in data.decode("ascii").splitlines())
    return np.array([[float(w) for w in line[1:4]] for line in words if line[:1] == ["vertex"]])


def _obj(data: bytes) -> Array:
    words = (line.split() for line in data.decode("utf-8").splitlines())
    return np.array([[float(w) for w in line[1:4]] for line in words if line[:1] == ["v"]])


def _collada(data: bytes) -> Array:
    etree = import_module("lxml.etree")
    try:
        root = etree.fromstring(data, etree.XMLParser(resolve_entities=False, no_network=True, remove_comments=True))
    except etree.XMLSyntaxError as error:
        raise ValueError(str(error)) from error
    for element in root.iter():  # names without the namespace
        element.tag = etree.QName(element).localname
    geometries = {f"#{geometry.get('id')}": _positions(geometry) for geometry in root.iter("geometry")}
    unit = root.find("asset/unit")
    scale = float(unit.get("meter", "1")) if unit is not None else 1.0
    up = root.findtext("asset/up_axis", "Y_UP").strip()
    upright = {"Z_UP": np.eye(3), "Y_UP": np.array([[1.0, 0, 0], [0, 0, -1], [0, 1, 0]])}.get(up)
    if upright is None:
        raise ValueError(f"up_axis {up!r} is not read")
    scene = root.find("library_visual_scenes/visual_scene")
    placed: list[Array] = []

    def visit(node: Any, pose: Array, level: int) -> None:
        if level > DEEPEST_NODE:
            raise ValueError("its nodes nest too deep")
        for part in node:
            if part.tag in ("matrix", "translate", "rotate", "scale"):
                pose = pose @ _transform(part)
            elif part.tag == "instance_geometry":
                points = geometries[part.get("url")]
                placed.append(points @ pose[:3, :3].T + pose[:3, 3])
            elif part.tag == "node":
                visit(part, pose, level + 1)

    if scene is not None:
        visit(scene, np.eye(4), 0)
    points = np.concatenate(placed or list(geometries.values()))
    return np.asarray(scale * points @ upright.T)


def _positions(geometry: Any) -> Array:
    """(N, 3) corners of a geometry."""
    vertices = geometry.find("mesh/vertices/input[@semantic='POSITION']")
    source = vertices.get("source").lstrip("#")
    found = next(s for s in geometry.iter("source") if s.get("id") == source)
    return np.array([float(word) for word in found.findtext("float_array").split()]).reshape(-1, 3)


def _transform(part: Any) -> Array:
    """(4, 4) of a node's matrix, translation, rotation or scale."""
    values = [float(word) for word in (part.text or "").split()]
    pose = np.eye(4)
    if part.tag == "matrix":
        return np.array(values).reshape(4, 4)
    if part.tag == "translate":
        pose[:3, 3] = values
    elif part.tag == "scale":
        pose[:3, :3] = np.diag(values)
    else:
        axis, angle = np.array(values[:3]) / np.linalg.norm(values[:3]), math.radians(values[3])
        k = np.cross(np.eye(3), axis)
        pose[:3, :3] = np.eye(3) + math.sin(angle) * k + (1 - math.cos(angle)) * k @ k
    return pose
