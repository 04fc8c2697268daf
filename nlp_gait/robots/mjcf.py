"""MJCF files as links and joints of a robot; MuJoCo itself reads them, with all files that they include."""

import logging
import math
import re
from collections.abc import Mapping
from functools import partial
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np

from nlp_gait.errors import MissingExtraError, RobotDataError
from nlp_gait.files import read_bytes
from nlp_gait.robots.meshes import (
    POINTER,
    check_pointer,
    list_shape_points,
    move_points,
)
from nlp_gait.robots.robot import ANY_ANGLE, LARGEST_NUMBER, Joint, are_plausible, make_unit_axis
from nlp_gait.robots.tree import Array, Mass, to_vector
from nlp_gait.robots.welding import FootShapes, LinkFrame, RobotParts, join_frames, list_carriers

LOG = logging.getLogger("nlp_gait")
LIGHT_KG = 1e-5  # mass of a link between two hinges of a body
JOINT_FREE, JOINT_HINGE, JOINT_TRANSMISSIONS = 0, 3, (0, 1)  # mjJNT_FREE, _HINGE; mjTRN_JOINT and mjTRN_JOINTINPARENT


# By a part of MuJoCo's message.
REMEDIES = {
    "opening file": "; meshes must be where the file names them (its meshdir)",
    "not found": "; is it in a file that includes this one, such as a scene? Then give that one",
    "unrecognized attribute": "; this version of MuJoCo has no such attribute: remove it",
}


def read_mjcf(path: str) -> RobotParts:
    """Read the links and joints of an MJCF file.

    The robot is the heaviest tree of bodies in the world. All frames get its root's axes at the reference pose, where all angles
    count as zero. Bodies that do not turn against each other become one; a body with several hinges has a light link between
    two of them. Raises MissingExtraError without MuJoCo, RobotDataError if that cannot read the file, or ValueError if it
    contains no robot.
    """
    model = _compile(path)
    notes: list[str] = []
    root = _find_root(model, notes)
    data = _place_bodies(model, root)
    names = {i: model.body(i).name or f"body {i}" for i in np.flatnonzero(model.body_rootid == root).tolist()}
    if len(set(names.values())) < len(names):
        raise ValueError("two bodies have the same name")
    frames, turning, hinges = {}, [], dict[str, int]()
    for i, name in names.items():
        parent = None if i == root else names[int(model.body_parentid[i])]
        mass = Mass(float(model.body_mass[i]), np.zeros(3), np.diag(model.body_inertia[i]))
        mass = mass.turn(data.ximat[i].reshape(3, 3)).move(data.xipos[i])
        frames[name] = LinkFrame(parent, False, data.xpos[i], mass)
        listed = [] if i == root else _list_hinges(model, i)
        for hinge in listed:
            child = name if hinge == listed[-1] else f"{name} behind {model.joint(hinge).name}"
            carried = mass if hinge == listed[-1] else Mass(LIGHT_KG, data.xanchor[hinge], np.zeros((3, 3)))
            frames[child] = LinkFrame(parent, True, data.xanchor[hinge], carried)
            turning.append(_read_turning(model, hinge, str(parent), child, data.xaxis[hinge]))
            hinges[child], parent = hinge, child
    carriers = list_carriers(frames)
    unusable = {
        body: "has no actuator: it is not driven, and closed chains are not supported; add its motor"
        for body, hinge in hinges.items()
        if model.nu and not model.jnt_actfrclimited[hinge] and hinge not in _list_driven(model)
    }
    for equality in range(model.neq):
        kind = _name("mjtEq", "mjEQ_", model.eq_type[equality])
        coupled = f"is coupled by the equality {kind!r}: closed chains are not supported"
        bodies = [names[body] for body in _list_coupled_bodies(model, equality, kind) if body in names]
        unusable |= {carriers[body]: coupled for body in bodies}
    notes += _list_ignored(model)
    read_shapes = partial(_read_foot_shapes, model, data, names, frames)
    return join_frames(Path(path).stem, frames, turning, read_shapes, notes, unusable)


def _read_turning(model: Any, hinge: int, parent: str, child: str, axis: Array) -> Joint:
    low, high = model.jnt_range[hinge] - model.qpos0[model.jnt_qposadr[hinge]]
    rate = model.jnt_dofadr[hinge]
    return Joint(
        name=model.joint(hinge).name or f"joint {hinge}",
        parent=parent,
        child=child,
        origin_m=(0.0, 0.0, 0.0),  # ``join_frames`` places it
        axis=make_unit_axis(to_vector(axis)),
        limits_rad=(float(low), float(high)) if model.jnt_limited[hinge] else ANY_ANGLE,
        velocity_limit_rad_s=math.inf,  # MJCF has none
        torque_limit_Nm=_find_torque_limit(model, hinge),
        armature_kgm2=float(model.dof_armature[rate]),
        damping_Nms_rad=float(np.ravel(model.dof_damping[rate])[0]),
        friction_Nm=float(model.dof_frictionloss[rate]),
    )


def _name(kind: str, prefix: str, number: int) -> str:
    return str(getattr(import_module("mujoco"), kind)(int(number)).name.removeprefix(prefix).lower())


def _list_driven(model: Any) -> set[int]:
    """Return the joints of all actuators."""
    return {
        int(model.actuator_trnid[k, 0]) for k in range(model.nu) if model.actuator_trntype[k] in JOINT_TRANSMISSIONS
    }


def _list_coupled_bodies(model: Any, equality: int, kind: str) -> list[int]:
    """Return the bodies that an equality couples, behind the joints of one of joints."""
    numbers = [int(model.eq_obj1id[equality]), int(model.eq_obj2id[equality])]
    of_object = {"joint": model.jnt_bodyid, "site": model.site_bodyid, "body": range(model.nbody)}
    coupled = kind if kind == "joint" else _name("mjtObj", "mjOBJ_", model.eq_objtype[equality])
    return [int(of_object[coupled][number]) for number in numbers if coupled in of_object and number >= 0]


def _list_ignored(model: Any) -> list[str]:
    """Return a note on what changes the motion in MuJoCo and is not read; none without any."""
    springs = [model.joint(j).name for j in range(model.njnt) if np.ravel(model.jnt_stiffness[j])[0]]
    floating = [model.body(i).name for i in range(model.nbody) if model.body_gravcomp[i]]
    parts = [
        *([f"stiffness of {', '.join(springs)}"] if springs else []),
        *([f"gravcomp of {', '.join(floating)}"] if floating else []),
        *([f"{model.neq} equalities"] if model.neq else []),
        *([f"{model.ntendon} tendons"] if model.ntendon else []),
    ]
    return [f"ignored: {', '.join(parts)}"] if parts else []


def _read_foot_shapes(
    model: Any, data: Any, names: Mapping[int, str], frames: Mapping[str, LinkFrame], foot: str
) -> FootShapes:
    """Return the points of all shapes that move with a link, as for a URDF; MuJoCo has read the meshes."""
    carriers = list_carriers(frames)
    points = {kind: [np.zeros((0, 3))] for kind in ("collision", "visual")}
    others = []
    for i in (i for i, name in names.items() if carriers[name] == foot):
        for geom in range(model.body_geomadr[i], model.body_geomadr[i] + model.body_geomnum[i]):
            kind = "collision" if model.geom_contype[geom] or model.geom_conaffinity[geom] else "visual"
            pose = np.eye(4)
            pose[:3, :3], pose[:3, 3] = data.geom_xmat[geom].reshape(3, 3), data.geom_xpos[geom]
            shape, listed = _list_shape_points(model, geom, pose)
            points[kind].append(listed - frames[foot].origin_m)
            others += [] if len(listed) else [shape]
    kind = "collision" if len(points["collision"]) > 1 else "visual"
    return FootShapes(np.concatenate(points[kind]), kind, (), tuple(others))


def list_dependencies(path: str) -> list[str]:
    """Return all files that an MJCF file includes or names; raises as ``read_mjcf``."""
    _compile(path)  # a file that MuJoCo accepts
    return [str(file) for file in import_module("mujoco").mju_getXMLDependencies(path)]


def _compile(path: str) -> Any:
    """Return MuJoCo's model of a file, and log its warnings."""
    if find_spec("mujoco") is None:
        raise MissingExtraError(
            f"robot file {path!r}: MJCF files need MuJoCo, which is not installed: pip install 'nlp-gait[sim]'"
        )
    read_bytes(Path(path), "robot file", error=RobotDataError)  # refuses special files
    mujoco = import_module("mujoco")
    earlier = mujoco.get_mju_user_warning()
    mujoco.set_mju_user_warning(partial(LOG.warning, "robot file %r: %s", path))
    try:
        model = mujoco.MjModel.from_xml_path(path)
    except Exception as error:  # ValueError, and any error of a plugin or decoder
        for name in re.findall(r"'([^'*?\[]+)'", str(error)):
            for file in filter(Path.is_file, Path(path).parent.rglob(Path(name).name)):
                check_pointer(file, file.open("rb").read(len(POINTER)))
        reason = " ".join(str(error).split())[:300] or type(error).__name__
        remedy = next((text for mark, text in REMEDIES.items() if mark in reason), "")
        raise RobotDataError(f"robot file {path!r} is not read by MuJoCo: {reason}{remedy}") from error
    finally:
        mujoco.set_mju_user_warning(earlier)
    for name in ("body_pos", "body_ipos", "body_mass", "body_inertia", "jnt_pos", "jnt_range", "qpos0"):
        if not are_plausible(getattr(model, name)):
            raise RobotDataError(f"robot file {path!r}: {name} must hold finite numbers within {LARGEST_NUMBER:g}")
    return model


def _find_root(model: Any, notes: list[str]) -> int:
    """Return the root of the heaviest tree of bodies with hinges."""
    tops = {i: float(model.body_subtreemass[i]) for i in range(1, model.nbody) if model.body_parentid[i] == 0}
    if not tops:
        raise ValueError("it contains no body")
    turning = set(model.body_rootid[model.jnt_bodyid[model.jnt_type == JOINT_HINGE]].tolist())
    root = max(tops, key=lambda i: (i in turning, tops[i]))
    hinges = {i: int(np.sum(model.body_rootid[model.jnt_bodyid[model.jnt_type == JOINT_HINGE]] == i)) for i in tops}
    if twins := [model.body(i).name for i in tops if i != root and hinges[i] == hinges[root] > 0]:
        raise ValueError(
            f"bodies {model.body(root).name!r} and {twins[0]!r} hang from the world with {hinges[root]} hinges each: join them "
            'by a body, which MuJoCo keeps with fusestatic="false", or remove one'
        )
    if others := [f"{model.body(i).name!r} ({tops[i]:.3g} kg)" for i in tops if i != root]:
        notes.append(f"read: the tree of {model.body(root).name!r} ({tops[root]:.3g} kg); ignored: {', '.join(others)}")
    return root


def _place_bodies(model: Any, root: int) -> Any:
    """Return MuJoCo's data at zero angles, with the frame of a root in place of the world's."""
    mujoco, upright = import_module("mujoco"), (1.0, 0.0, 0.0, 0.0)
    model.body_pos[root], model.body_quat[root] = 0.0, upright
    data = mujoco.MjData(model)
    for joint in range(model.body_jntadr[root], model.body_jntadr[root] + model.body_jntnum[root]):
        if model.jnt_type[joint] == JOINT_FREE:
            data.qpos[model.jnt_qposadr[joint] :][:7] = 0.0, 0.0, 0.0, *upright
    mujoco.mj_kinematics(model, data)
    return data


def _list_hinges(model: Any, body: int) -> list[int]:
    """Return the hinges that carry a body, the nearest to its parent first."""
    first, count = int(model.body_jntadr[body]), int(model.body_jntnum[body])
    return [j for j in range(first, first + count) if model.jnt_type[j] == JOINT_HINGE]


def _find_torque_limit(model: Any, joint: int) -> float:
    """Return the smaller limit of a joint and of all its actuators together [Nm]; infinite without one."""
    ranges = [model.jnt_actfrcrange[joint]] if model.jnt_actfrclimited[joint] else []
    motors = []
    for k in range(model.nu):
        if model.actuator_trnid[k, 0] == joint and model.actuator_trntype[k] in JOINT_TRANSMISSIONS:
            gear, gain = abs(float(model.actuator_gear[k, 0])), abs(float(model.actuator_gainprm[k, 0]))
            motor = np.array([-math.inf, math.inf])
            if model.actuator_forcelimited[k]:
                motor = gear * model.actuator_forcerange[k]
            elif model.actuator_ctrllimited[k] and not model.actuator_biasprm[k].any():  # a motor, not a position drive
                motor = gear * gain * model.actuator_ctrlrange[k]
            motors.append(motor)
    if motors:
        ranges.append(np.sum(motors, axis=0))
    return float(np.min(np.abs(ranges), initial=math.inf))


def _list_shape_points(model: Any, geom: int, pose: Array) -> tuple[str, Array]:
    """Return the kind of a shape and its points (N, 3)."""
    kind = _name("mjtGeom", "mjGEOM_", model.geom_type[geom])
    if kind == "mesh":
        mesh = int(model.geom_dataid[geom])
        first, count = int(model.mesh_vertadr[mesh]), int(model.mesh_vertnum[mesh])
        points = move_points(np.array(model.mesh_vert[first : first + count], dtype=float), pose)
    else:
        points = list_shape_points(kind, model.geom_size[geom], pose)
    return kind, points if are_plausible(points) else np.zeros((0, 3))
