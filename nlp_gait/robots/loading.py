"""Robots from files: JSON, URDF and MJCF. A JSON file may extend any of them and replace some of its records."""

import hashlib
import math
import os
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass, field, replace
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any, Literal

import numpy as np

from nlp_gait.decoding import decode, read_dataclass
from nlp_gait.errors import RobotDataError, UnknownNameError, format_value, unknown, warn_once
from nlp_gait.files import check_path, convert_errors
from nlp_gait.robots.inference import EXTENTS, SIDES, Feet, Legs, Side, check_sizes, find_legs, find_middle, infer_feet
from nlp_gait.robots.packages import MARK, MODEL_ENDINGS, find_kind, find_robot_file
from nlp_gait.robots.perturbation import perturb, split_name
from nlp_gait.robots.robot import ANY_ANGLE, Foot, Joint, Link, Robot, check_robot_name, make_unit_axis
from nlp_gait.robots.tree import check_inertias, move_along_axis, move_root, shift_to_com
from nlp_gait.robots.welding import Joints, Links, RobotParts, correct_tensors, find_faults, weld_faults

FILE_ENDINGS = (".json", *MODEL_ENDINGS)
NEGLIGIBLE_M = 1e-6  # published origins are rounded to this
# Fields that replace those of the extended file.
REPLACED = ("name", "description", "root", "forward", "heat_loss_W_per_Nm2", "inertia_about")

# Robots from files by name or path, while ``hold_robots`` is active.
_held: ContextVar[dict[str, Robot] | None] = ContextVar("held_robots", default=None)

_DATA = resources.files("nlp_gait.robots") / "data"


@dataclass(frozen=True, kw_only=True)
class RobotFile:
    """Content of a robot file."""

    schema: Literal[1] = 1
    name: str | None = None
    extends: str | None = None
    description: str | None = None
    conventions: Any = None
    sources: Mapping[str, str] = field(default_factory=dict)
    inertia_about: Literal["com", "joint"] | None = None
    root: str | None = None
    links: Mapping[str, Any] = field(default_factory=dict)
    joints: Mapping[str, Any] = field(default_factory=dict)
    feet: Mapping[Side, Mapping[str, Any]] = field(default_factory=dict)
    forward: Literal["x", "-x", "y", "-y"] | None = None
    posture_rad: Mapping[str, float] = field(default_factory=dict)
    heat_loss_W_per_Nm2: float | None = None

    def __post_init__(self) -> None:
        if self.name is not None:
            check_robot_name(self.name, "robot")
        for group in ("links", "joints"):
            for name in getattr(self, group):
                check_robot_name(name, group)


@dataclass(frozen=True, kw_only=True)
class RobotDescription:
    """What files say about a robot, before the rest is inferred; a hash of the robot takes its text."""

    file: RobotFile
    links: Mapping[str, Link]
    joints: Mapping[str, Joint]
    model: RobotParts | None = field(default=None, repr=False)  # the URDF or MJCF that it extends
    model_path: str = field(default="", repr=False)  # the file may be moved


def list_robots() -> tuple[str, ...]:
    """Return the names of the robots of the package."""
    return tuple(sorted(entry.name.removesuffix(".json") for entry in _DATA.iterdir() if entry.name.endswith(".json")))


def load_robot(name_or_path: str) -> Robot:
    """Load a robot by its name, or from a file: a path that ends in ``.json``, or one of a URDF or MJCF, known by its first tag.

    A file of an installed package is named ``PACKAGE:NAME``, see ``robots/packages.py``.

    What such a file does not state is inferred, see ``robots/inference.py``; a ``.json`` of the same name next to it overrides
    both. Changes of masses, leg lengths and soles may follow after an ``@``, see ``robots/perturbation.py``. A file is read
    again each time, because it may have changed, except within ``hold_robots``. Raises UnknownNameError; RobotDataError for a
    file that cannot be read, is damaged or describes an impossible robot; or MissingExtraError for a URDF without its extra.
    """
    if not isinstance(name_or_path, str):
        raise UnknownNameError(f"the name of a robot must be a text, got {format_value(name_or_path)}")
    check_path(name_or_path, f"robot {name_or_path!r}", RobotDataError)
    if not is_robot_file(name_or_path):
        return _load_shipped(name_or_path)
    held = _held.get()
    if held is None:
        return _load(name_or_path)
    if name_or_path not in held:
        held[name_or_path] = _load(name_or_path)
    return held[name_or_path]


@contextmanager
def hold_robots() -> Iterator[None]:
    """Read the files of each robot once while this context is active, also as a decorator; later changes do not count."""
    token = _held.set({} if _held.get() is None else _held.get())
    try:
        yield
    finally:
        _held.reset(token)


def is_robot_file(name_or_path: str) -> bool:
    """Return whether a robot comes from a file, its user's or an installed package's, instead of this package."""
    source = split_name(name_or_path)[0]
    return source.lower().endswith(FILE_ENDINGS) or MARK in source


def hash_robot(name_or_path: object) -> str:
    """Return a hash of all files that describe a robot, "" for one of the package; raises as ``load_robot``."""
    if not isinstance(name_or_path, str) or not is_robot_file(name_or_path):
        return ""
    return hashlib.sha256(repr(_describe(_find_description(split_name(name_or_path)[0]))).encode()).hexdigest()


def list_robot_files(name_or_path: str) -> set[str]:
    """Return the files that describe a robot: its own, those that it extends or includes, meshes; raises as ``load_robot``."""
    source, files = _find_description(split_name(name_or_path)[0]), set[str]()
    while source.endswith(".json") and source not in files:
        files.add(source)
        source = _resolve(_read(source).extends or "", source)
    if _is_model(source):
        from nlp_gait.robots.mjcf import list_dependencies
        from nlp_gait.robots.urdf import list_meshes

        with convert_errors(f"robot file {source!r}", RobotDataError):
            files |= {source, *(list_dependencies if find_kind(Path(source)) == "mjcf" else list_meshes)(source)}
    return {os.path.abspath(file) for file in files}


def _load(name_or_path: str) -> Robot:
    source, changes = split_name(name_or_path)
    path = _find_description(source)
    return perturb(_make_robot(_describe(path), path), changes)


_load_shipped = cache(_load)


def _is_model(source: str) -> bool:
    return source.lower().endswith(MODEL_ENDINGS)


def _find_description(source: str) -> str:
    """Return the file to read first: for a URDF or MJCF the robot file of the same name, if there is one."""
    path = find_robot_file(source)
    if not _is_model(path):
        return path
    partner = Path(path).with_suffix(".json")
    if not os.path.isfile(partner):
        return path
    base = _read(str(partner)).extends
    if base is None or _resolve(base, str(partner)) != os.path.normpath(path):
        raise RobotDataError(f"robot file {str(partner)!r}: 'extends' must be {Path(path).name!r}, the file next to it")
    return str(partner)


def _describe(source: str, extending: tuple[str, ...] = ()) -> RobotDescription:
    """Return what a file, and the files that it extends, say about a robot."""
    if _is_model(source):
        return _read_model(source, None)
    file = _read(source)
    description = _decode_parts(file, source)
    if file.extends is None:
        return description
    base_source = _resolve(file.extends, source)
    if base_source in extending:
        raise RobotDataError(f"robot {source!r}: 'extends' must name another robot, got {file.extends!r}")
    if _is_model(base_source):
        base = _read_model(base_source, file.inertia_about)
    else:
        base = _describe(base_source, (*extending, source))
    merged = replace(
        base.file,
        **{key: getattr(file, key) for key in REPLACED if getattr(file, key) is not None},
        sources={**base.file.sources, **file.sources},
        posture_rad={**base.file.posture_rad, **file.posture_rad},
        feet={**base.file.feet, **file.feet},
    )
    return replace(
        base,
        file=merged,
        links={**base.links, **description.links},
        joints={**base.joints, **description.joints},
    )


def _read_model(source: str, inertia_about: str | None) -> RobotDescription:
    from nlp_gait.robots.mjcf import read_mjcf
    from nlp_gait.robots.urdf import read_urdf

    with convert_errors(f"robot file {source!r}", RobotDataError):
        if find_kind(Path(source)) == "mjcf":
            model = read_mjcf(source)
        else:
            model = read_urdf(source, about_joint=inertia_about == "joint")
        # The constructor checks the names.
        file = RobotFile(name=model.name, description=f"from {Path(source).name}", root=model.root)
        replace(file, links=model.links, joints=model.joints)
    return RobotDescription(file=file, links=model.links, joints=model.joints, model=model, model_path=source)


def _decode_parts(file: RobotFile, source: str) -> RobotDescription:
    """Return the links and joints of a JSON file; raises RobotDataError for one that is faulty."""
    with convert_errors(f"robot file {source!r}", RobotDataError):
        links = {name: decode(Link, raw, f"links.{name}", given={"name": name}) for name, raw in file.links.items()}
        joints = {name: decode(Joint, raw, f"joints.{name}", given={"name": name}) for name, raw in file.joints.items()}
    if file.inertia_about == "joint":
        links = {name: shift_to_com(link) for name, link in links.items()}
    joints = {name: replace(joint, axis=make_unit_axis(joint.axis)) for name, joint in joints.items()}
    for fault in (*find_faults(links).values(), *find_faults(joints).values()):
        raise fault
    return RobotDescription(file=replace(file, links={}, joints={}), links=links, joints=joints)


def _resolve(base: str, source: str) -> str:
    """Return the name or path of an extended robot; a path is relative to the file that names it."""
    # Normalised, to recognise two files that extend each other by different paths.
    return os.path.normpath(Path(source).parent / base) if base.lower().endswith(FILE_ENDINGS) else base


def _read(name_or_path: str) -> RobotFile:
    if not name_or_path.endswith(".json") and name_or_path not in list_robots():
        raise unknown("robot", name_or_path, list_robots())
    path = Path(name_or_path if name_or_path.endswith(".json") else str(_DATA / f"{name_or_path}.json"))
    file = read_dataclass(RobotFile, path, "robot file", error=RobotDataError)
    if file.extends is None and file.root is None:
        models = [other for other in sorted(path.parent.glob("*")) if other.stem == path.stem and _is_model(other.name)]
        return replace(file, extends=models[0].name) if models else file
    return file


def _make_robot(description: RobotDescription, source: str) -> Robot:
    file = description.file
    if file.name is None or file.root is None:
        missing = "name" if file.name is None else "root"
        raise RobotDataError(f"robot file {source!r}: {missing!r} is missing")
    links, joints = dict(description.links), dict(description.joints)
    feet: Feet = {side: dict(foot) for side, foot in file.feet.items()}
    notes: list[str] = []
    if description.model is not None:
        with convert_errors(f"robot file {description.model_path!r}", RobotDataError):
            feet = _complete(description, description.model, links, joints, feet, notes)
    with convert_errors(f"robot file {source!r}", RobotDataError):
        soles = {side: decode(Foot, foot, f"feet.{side}") for side, foot in feet.items()}
    if file.inertia_about is None:
        check_inertias(file.name, list(links.values()))
    return Robot(
        name=file.name,
        description=file.description or "",
        sources=file.sources,
        root=file.root,
        links=links,
        joints=joints,
        feet=soles,
        posture_rad=file.posture_rad,
        heat_loss_W_per_Nm2=file.heat_loss_W_per_Nm2,
        unusable={} if description.model is None else description.model.unusable,
        notes=tuple(notes),
    )


def _complete(
    description: RobotDescription, model: RobotParts, links: Links, joints: Joints, feet: Feet, notes: list[str]
) -> Feet:
    """Return the feet of a robot from a URDF or MJCF; weld its faulty parts, and note what was inferred."""
    name = str(description.file.name)
    for foot in feet.values():  # a sole's link is often behind a fixed joint
        if foot.get("link") not in links:
            foot["link"] = model.carriers.get(str(foot.get("link")), foot.get("link"))
    check_sizes(name, links, joints, notes)
    legs = find_legs(name, links, joints, feet)
    notes += model.notes
    correct_tensors(links, notes)
    weld_faults(links, joints, legs.links, notes)
    _note_limits(joints, legs, notes)
    if all(legs.chains):
        _move_frames(str(description.file.root), legs, links, joints, notes)
    if not all(set(EXTENTS) <= set(feet.get(side, ())) for side in SIDES):
        forward = description.file.forward
        feet = infer_feet(name, legs, links, joints, feet, model.read_shapes, forward, notes)
    usual = ("left foot:", "right foot:", "no limit of speed: all")  # MJCF has no limits of speed
    if listed := [note for note in notes if not note.startswith(usual)]:
        others = f" (and {len(listed) - 1} more)" if len(listed) > 1 else ""
        warn_once("robot %r: %s%s; see nlp-gait list --robot FILE", name, listed[0], others)
    return feet


def _note_limits(joints: Joints, legs: Legs, notes: list[str]) -> None:
    """Note which joints of the legs have no limit, or a tighter one of software."""
    moving = [joint for joint in joints.values() if joint.child in legs.links]
    for quantity, limit, none in (
        ("angle", "limits_rad", ANY_ANGLE),
        ("torque", "torque_limit_Nm", math.inf),
        ("speed", "velocity_limit_rad_s", math.inf),
    ):
        if free := [joint.name for joint in moving if getattr(joint, limit) == none]:
            listed = "all joints of the legs" if len(free) == len(moving) else ", ".join(free)
            notes.append(f"no limit of {quantity}: {listed}")
    if soft := [joint.name for joint in moving if joint.planning_limits_rad != joint.limits_rad]:
        notes.append(f"soft limits, which are tighter, are used: {', '.join(soft)}")


def _move_frames(root: str, legs: Legs, links: Links, joints: Joints, notes: list[str]) -> None:
    """Move the frames of the feet to the ankles, and the root's to the plane of symmetry near the hips."""
    for chain, ankle in zip(legs.chains, legs.ankles_m, strict=True):
        offset = ankle - chain[0].place
        if np.linalg.norm(offset) > NEGLIGIBLE_M:
            move_along_axis(links, joints, chain[0].joint.name, offset)
    offset = find_middle(legs)
    if (aside := float(np.linalg.norm(offset))) > NEGLIGIBLE_M:
        notes.append(f"the root's origin is {1e3 * aside:.1f} mm from the plane of symmetry: it was moved into it")
    hip, ankle = legs.hip_m[2], legs.ankles_m[0][2]
    if hip > (hip - ankle) / 2:  # as of a root on the ground; gaits and falls refer to an origin near the hips
        notes.append(f"the root's origin is {hip:.2f} m below the hips: it was moved up to them")
        offset[2] = hip
    move_root(root, links, joints, offset)
