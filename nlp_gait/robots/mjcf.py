"""MJCF files in the form of a JSON robot file; MuJoCo itself reads them, with all files that they include."""

import json
import logging
import math
import os
from functools import lru_cache, partial
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from nlp_gait.errors import MissingExtraError, RobotDataError, warn_once
from nlp_gait.files import protect_input, read_bytes
from nlp_gait.robots.limits import read_in_child
from nlp_gait.robots.meshes import FootShapes, list_box_points, list_cylinder_points
from nlp_gait.robots.robot import LARGEST_NUMBER, are_plausible
from nlp_gait.robots.tree import Array, Mass, combine_masses

LOG = logging.getLogger("nlp_gait")
UNLIMITED_RAD_S = 1000.0  # MJCF has no speed limits
IGNORED = {"armature": "kg m^2", "damping": "Nm s/rad", "frictionloss": "Nm"}  # of a joint


def read_mjcf(path: str) -> dict[str, Any]:
    """Read links and joints of an MJCF file by the schema of a robot file, without feet.

    The robot is the heaviest tree of bodies in the world. All frames get its root's axes at the reference pose, where all angles
    count as zero. Bodies that do not turn against each other become one. Raises MissingExtraError without MuJoCo, RobotDataError
    if that cannot read the file, or ValueError if it contains no robot, or a body with several hinges.
    """
    _read.cache_clear()  # the file, or one that it includes, may have changed
    model = _compile(path)
    root, frames, carriers = _find_tree(model)
    _report_ignored(path, model)
    names = {i: model.body(i).name or f"body {i}" for i in frames}
    if len(set(names.values())) < len(names):
        raise ValueError("two bodies have the same name")
    origins = {i: _place_joint(model, frames, i) for i in set(carriers.values())}
    links = {}
    for carrier, origin in origins.items():
        parts = [_read_mass(model, i, frames[i]) for i in frames if carriers[i] == carrier]
        links[names[carrier]] = combine_masses(parts).move(-origin).to_record()
    joints = {}
    for carrier in sorted(set(carriers.values()) - {root}):
        parent = carriers[int(model.body_parentid[carrier])]
        joint = _list_hinges(model, carrier)[0]
        low, high = model.jnt_range[joint] - model.qpos0[model.jnt_qposadr[joint]]
        limited = bool(model.jnt_limited[joint])
        joints[model.joint(joint).name or f"joint {joint}"] = {
            "parent": names[parent],
            "child": names[carrier],
            "origin_m": (origins[carrier] - origins[parent]).tolist(),
            "axis": (frames[carrier][:3, :3] @ model.jnt_axis[joint]).tolist(),
            "limits_rad": [float(low), float(high)] if limited else [-math.pi, math.pi],
            "velocity_limit_rad_s": UNLIMITED_RAD_S,
            "torque_limit_Nm": _find_torque_limit(model, joint),
        }
    about = {"schema": 1, "name": Path(path).stem, "description": f"from {Path(path).name}"}
    return {**about, "root": names[root], "links": links, "joints": joints}


def _report_ignored(path: str, model: Any) -> None:
    hinges = model.jnt_dofadr[model.jnt_type == int(import_module("mujoco").mjtJoint.mjJNT_HINGE)]
    values = {name: float(np.max(getattr(model, f"dof_{name}")[hinges], initial=0.0)) for name in IGNORED}
    listed = ", ".join(f"{name} up to {values[name]:.3g} {unit}" for name, unit in IGNORED.items() if values[name])
    if listed:
        warn_once("robot file %r: its joints' %s; neither the model nor the simulation contains it", path, listed)


def read_foot_geoms(path: str, link: str) -> FootShapes:
    """Return the points of all shapes that move with a link, as ``urdf.read_foot_shapes``; MuJoCo reads the meshes."""
    model = _compile(path)
    _, frames, carriers = _find_tree(model)
    found = {kind: [np.zeros((0, 3))] for kind in ("collision", "visual")}
    for i, frame in frames.items():
        if (model.body(carriers[i]).name or f"body {carriers[i]}") != link:
            continue
        origin = _place_joint(model, frames, carriers[i])
        for geom in range(model.body_geomadr[i], model.body_geomadr[i] + model.body_geomnum[i]):
            kind = "collision" if model.geom_contype[geom] or model.geom_conaffinity[geom] else "visual"
            pose = frame @ _make_pose(model.geom_pos[geom], model.geom_quat[geom])
            found[kind].append(_list_shape_points(model, geom, pose) - origin)
    kind = "collision" if len(found["collision"]) > 1 else "visual"
    return FootShapes(np.concatenate(found[kind]), kind)


def list_dependencies(path: str) -> list[str]:
    """Return all files that an MJCF file includes or names; raises as ``read_mjcf``."""
    _compile(path)  # a file that MuJoCo accepts
    return [str(file) for file in import_module("mujoco").mju_getXMLDependencies(path)]


def _compile(path: str) -> Any:
    """Return MuJoCo's model of a file, the same for its links and its points."""
    if find_spec("mujoco") is None:
        raise MissingExtraError(
            f"robot file {path!r}: MJCF files need MuJoCo, which is not installed: pip install 'nlp-gait[sim]'"
        )
    read_bytes(Path(path), "robot file", error=RobotDataError)  # refuses special files
    return _read(os.path.abspath(path), path)


@lru_cache(maxsize=4)
def _read(place: str, path: str) -> Any:
    mujoco = import_module("mujoco")  # before the fork, which would import it in vain
    told, _, data = read_in_child(f"robot file {path!r}", partial(_compile_binary, mujoco, path)).partition(b"\n")
    warnings, files = json.loads(told)
    for text in warnings:
        LOG.warning("robot file %r: %s", path, text)
    for file in files:
        protect_input(Path(file))
    try:
        model = mujoco.MjModel.from_binary_path("robot.mjb", {"robot.mjb": data})
        for name in ("body_pos", "body_ipos", "body_mass", "body_inertia", "jnt_pos", "jnt_range", "qpos0"):
            if not are_plausible(getattr(model, name)):
                raise ValueError(f"{name} must hold finite numbers within {LARGEST_NUMBER:g}")
        return model
    except Exception as error:
        raise _convert(path, error) from error


def _compile_binary(mujoco: Any, path: str) -> bytes:
    """Return MuJoCo's warnings and the files read as a line of JSON, and the model in binary form; for a child process."""
    warnings: list[str] = []
    earlier = mujoco.get_mju_user_warning()  # restored where this is no child process
    mujoco.set_mju_user_warning(warnings.append)
    try:
        model = mujoco.MjModel.from_xml_path(path)
        files = [str(file) for file in mujoco.mju_getXMLDependencies(path)]
        data = np.empty(mujoco.mj_sizeModel(model), np.uint8)
        mujoco.mj_saveModel(model, None, data)
    except MemoryError:
        raise
    except Exception as error:  # ValueError, and any error of a plugin or decoder
        if "unknown exception" in str(error):  # of C++: no memory
            raise MemoryError from error
        raise _convert(path, error) from error
    finally:
        mujoco.set_mju_user_warning(earlier)
    return json.dumps([warnings, files]).encode() + b"\n" + data.tobytes()


def _convert(path: str, error: Exception) -> RobotDataError:
    reason = " ".join(str(error).split())[:300] or type(error).__name__
    remedy = "; meshes must be where the file names them (its meshdir)" if "opening file" in reason else ""
    return RobotDataError(f"robot file {path!r} is not read by MuJoCo: {reason}{remedy}")


def _find_tree(model: Any) -> tuple[int, dict[int, Array], dict[int, int]]:
    """Return the root body, poses (4, 4) of its tree in its frame, and the body with the hinge that carries each."""
    tops = [i for i in range(1, model.nbody) if model.body_parentid[i] == 0]
    if not tops:
        raise ValueError("it contains no body")
    root = max(tops, key=lambda i: float(model.body_subtreemass[i]))
    frames: dict[int, Array] = {root: np.eye(4)}
    carriers = {root: root}
    for i in range(root + 1, model.nbody):
        parent = int(model.body_parentid[i])
        if parent not in frames:
            continue
        frames[i] = frames[parent] @ _make_pose(model.body_pos[i], model.body_quat[i])
        hinges = _list_hinges(model, i)
        if len(hinges) > 1:
            raise ValueError(
                f"body {model.body(i).name!r} has {len(hinges)} hinges; give each its own body with a small mass"
            )
        carriers[i] = i if hinges else carriers[parent]
    return root, frames, carriers


def _list_hinges(model: Any, body: int) -> list[int]:
    first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
    hinge = int(import_module("mujoco").mjtJoint.mjJNT_HINGE)
    return [j for j in range(first, first + count) if model.jnt_type[j] == hinge]


def _place_joint(model: Any, frames: dict[int, Array], body: int) -> Array:
    """Return the place (3,) of the joint that carries a body; of the root its origin."""
    hinges = _list_hinges(model, body)
    local = model.jnt_pos[hinges[0]] if hinges and model.body_parentid[body] else np.zeros(3)
    return np.asarray(frames[body][:3, :3] @ local + frames[body][:3, 3])


def _read_mass(model: Any, body: int, frame: Array) -> Mass:
    pose = frame @ _make_pose(model.body_ipos[body], model.body_iquat[body])
    own = Mass(float(model.body_mass[body]), np.zeros(3), np.diag(model.body_inertia[body]))
    return own.turn(pose[:3, :3]).move(pose[:3, 3])


def _find_torque_limit(model: Any, joint: int) -> float:
    """Return the limit of the joint, or else of its actuator [Nm]; 0 if neither has one."""
    if model.jnt_actfrclimited[joint]:
        return float(np.abs(model.jnt_actfrcrange[joint]).max())
    for k in range(model.nu):
        if model.actuator_trnid[k, 0] == joint and model.actuator_trntype[k] == 0:
            gear = abs(float(model.actuator_gear[k, 0]))
            if model.actuator_forcelimited[k]:
                return gear * float(np.abs(model.actuator_forcerange[k]).max())
            if model.actuator_ctrllimited[k] and not model.actuator_biasprm[k].any():  # a motor, not a position drive
                gain = abs(float(model.actuator_gainprm[k, 0]))
                return gear * gain * float(np.abs(model.actuator_ctrlrange[k]).max())
    return 0.0


def _list_shape_points(model: Any, geom: int, pose: Array) -> Array:
    """Return points (N, 3) of a shape at a pose (4, 4): corners, edges, or the lowest points of round shapes."""
    kinds = import_module("mujoco").mjtGeom
    kind, size = int(model.geom_type[geom]), model.geom_size[geom]
    if kind == int(kinds.mjGEOM_MESH):
        mesh = int(model.geom_dataid[geom])
        first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
        points = np.array(model.mesh_vert[first : first + count], dtype=float)
    elif kind == int(kinds.mjGEOM_BOX):
        points = list_box_points(size)
    elif kind == int(kinds.mjGEOM_SPHERE):
        return np.array([pose[:3, 3] - [0.0, 0.0, size[0]]])
    elif kind == int(kinds.mjGEOM_CAPSULE):
        ends = np.array([[0.0, 0.0, -size[1]], [0.0, 0.0, size[1]]]) @ pose[:3, :3].T + pose[:3, 3]
        return np.asarray(ends - [0.0, 0.0, size[0]])
    elif kind == int(kinds.mjGEOM_CYLINDER):
        points = list_cylinder_points(size[0], size[1])
    else:
        return np.zeros((0, 3))
    placed = np.asarray(points @ pose[:3, :3].T + pose[:3, 3])
    return placed if are_plausible(placed) else np.zeros((0, 3))


def _make_pose(place: Array, quaternion: Array) -> Array:
    rotation, pose = np.zeros(9), np.eye(4)
    import_module("mujoco").mju_quat2Mat(rotation, quaternion)
    pose[:3, :3], pose[:3, 3] = rotation.reshape(3, 3), place
    return pose
