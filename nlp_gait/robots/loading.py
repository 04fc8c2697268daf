"""Robots from files: JSON, URDF and MJCF. A JSON file may extend any of them and replace some of its records."""

import hashlib
import math
import os
from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache, partial
from importlib import resources
from importlib.metadata import PackageNotFoundError, distribution
from pathlib import Path
from typing import Any, Literal, NamedTuple, TypeVar

from nlp_gait.decoding import decode, decode_value, read_dataclass
from nlp_gait.errors import GaitError, RobotDataError, UnknownNameError, format_value, unknown, warn_once
from nlp_gait.files import check_path, convert_errors
from nlp_gait.robots.inference import EXTENTS, SIDES, Side, find_legs, infer_feet
from nlp_gait.robots.mjcf import list_dependencies, read_foot_geoms, read_mjcf
from nlp_gait.robots.perturbation import perturb, split_name
from nlp_gait.robots.robot import Foot, Joint, Link, Robot, Vector, check_robot_name
from nlp_gait.robots.tree import check_inertias, reverse_joint, shift_to_com
from nlp_gait.robots.urdf import find_moving_link, list_meshes, read_foot_shapes, read_urdf
from nlp_gait.robots.welding import FindFault, weld_faults

MODEL_ENDINGS = (".urdf", ".xml")
FILE_ENDINGS = (".json", *MODEL_ENDINGS)
PACKAGE_MARK = ":"  # between an installed package and one of its robots
LONGEST_CHAIN = 8  # of robots that extend each other
MOST_JOINTS = 400  # among which legs are searched, which takes 2 s then, and eight times as long for twice as many
# Fields that replace those of the extended file.
REPLACED = ("name", "description", "root", "forward", "heat_loss_W_per_Nm2")

T = TypeVar("T")
About = Literal["com", "joint"] | None

_DATA = resources.files("nlp_gait.robots") / "data"


@dataclass(frozen=True, kw_only=True)
class RobotFile:
    """Content of a robot file. Links, joints and feet are decoded later, when the replaced ones are known."""

    schema: Literal[1] = 1
    name: str | None = None
    extends: str | None = None
    description: str | None = None
    conventions: Any = None
    sources: Mapping[str, str] = field(default_factory=dict)
    inertia_about: About = None
    joint_names: Mapping[str, str] = field(default_factory=dict)
    root: str | None = None
    links: Mapping[str, Any] = field(default_factory=dict)
    joints: Mapping[str, Any] = field(default_factory=dict)
    feet: Mapping[str, Any] = field(default_factory=dict)
    forward: Literal["x", "-x", "y", "-y"] | None = None
    posture_rad: Mapping[str, float] = field(default_factory=dict)
    heat_loss_W_per_Nm2: float | None = None

    def __post_init__(self) -> None:
        if self.name is not None:
            check_robot_name(self.name, "robot")
        for group in ("links", "joints", "joint_names"):
            for name in getattr(self, group):
                check_robot_name(name, group)
        for side in self.feet:
            decode_value(Side, side, "a key of feet")


class _Record(NamedTuple):
    """A link, joint or foot as a file describes it."""

    raw: Any
    file: str
    about: About = None  # reference point of the file's inertia tensors, if it states one
    reversed: bool = False  # the joint's angle is counted in the opposite direction

    def __repr__(self) -> str:  # of the content, which a hash of the robot takes: the file may be moved
        return repr((self.raw, self.about, self.reversed))


def list_robots() -> tuple[str, ...]:
    """Return the names of the robots of the package."""
    return tuple(sorted(entry.name.removesuffix(".json") for entry in _DATA.iterdir() if entry.name.endswith(".json")))


def load_robot(name_or_path: str) -> Robot:
    """Load a robot by its name, or from a file: a path that ends in ``.json``, ``.urdf`` or, for MJCF, ``.xml``.

    A URDF in an installed package is named ``PACKAGE:NAME``, see ``find_robot_file``.

    What such a file does not state is inferred, see ``robots/inference.py``; a ``.json`` of the same name next to it overrides
    both. Changes of masses, leg lengths and soles may follow after an ``@``, see ``robots/perturbation.py``. A file is read
    again each time, because it may have changed. Raises UnknownNameError; RobotDataError for a file that cannot be read, is
    damaged or describes an impossible robot; or MissingExtraError for a URDF without its extra.
    """
    if not isinstance(name_or_path, str):
        raise UnknownNameError(f"the name of a robot must be a text, got {format_value(name_or_path)}")
    check_path(name_or_path, f"robot {name_or_path!r}", RobotDataError)
    return _load(name_or_path) if is_robot_file(name_or_path) else _load_shipped(name_or_path)


def is_robot_file(name_or_path: str) -> bool:
    """Return whether a robot comes from a file, its user's or an installed package's, instead of this package."""
    source = split_name(name_or_path)[0]
    return source.endswith(FILE_ENDINGS) or PACKAGE_MARK in source


def find_robot_file(name: str) -> str:
    """Return the URDF of a robot in an installed package, ``example-robot-data:talos_reduced``; other names as they are.

    After the package's name follows the file's name without its ending, or, for files of one name, their folder's.
    """
    if name.endswith(FILE_ENDINGS) or PACKAGE_MARK not in name:
        return name
    package, _, robot = name.partition(PACKAGE_MARK)
    try:
        files = [file.locate() for file in distribution(package).files or () if file.suffix == ".urdf"]
    except PackageNotFoundError:
        raise RobotDataError(
            f"robot {name!r}: the package {package!r} is not installed; install it with pip, or give a file"
        ) from None
    stems = Counter(Path(str(file)).stem for file in files)
    found = {path.stem if stems[path.stem] == 1 else path.parent.name: str(path) for path in map(Path, map(str, files))}
    if robot not in found:
        raise unknown(f"robot of {package!r}", robot, found)
    return found[robot]


def hash_robot(name_or_path: object) -> str:
    """Return a hash of all files that describe a robot, "" for one of the package; raises as ``load_robot``."""
    if not isinstance(name_or_path, str) or not is_robot_file(name_or_path):
        return ""
    return hashlib.sha256(repr(_read_merged(_find_description(split_name(name_or_path)[0]))).encode()).hexdigest()


def list_robot_files(name_or_path: str) -> set[str]:
    """Return the files that describe a robot: its own, those that it extends or includes, meshes; raises as ``load_robot``."""
    source, found = _find_description(split_name(name_or_path)[0]), set[str]()
    while source.endswith(".json") and source not in found:
        found.add(source)
        source = _resolve(_read(source).extends or "", source)
    if source.endswith(MODEL_ENDINGS):
        with convert_errors(f"robot file {source!r}", RobotDataError):
            found |= {source, *(list_dependencies(source) if source.endswith(".xml") else list_meshes(source))}
    return {os.path.abspath(file) for file in found}


def _load(name_or_path: str) -> Robot:
    source, changes = split_name(name_or_path)
    path = _find_description(source)
    return perturb(_make_robot(_read_merged(path), path), changes)


_load_shipped = cache(_load)


def _find_description(source: str) -> str:
    """Return the file to read first: for a URDF or MJCF the robot file of the same name, if there is one."""
    path = find_robot_file(source)
    if not path.endswith(MODEL_ENDINGS):
        return path
    partner = Path(path).with_suffix(".json")
    if not os.path.isfile(partner):
        return path
    base = _read(str(partner)).extends
    if base is None or _resolve(base, str(partner)) != os.path.normpath(path):
        raise RobotDataError(f"robot file {str(partner)!r}: 'extends' must be {Path(path).name!r}, the file next to it")
    return str(partner)


def _read_merged(source: str, seen: tuple[str, ...] = ()) -> RobotFile:
    """Return the content of a robot file and those that it extends; links, joints and feet are ``_Record``."""
    if source.endswith(MODEL_ENDINGS):
        return _read_model(source, None)
    own = _read(source)
    file = _with_records(own, source)
    if own.extends is None:
        return file
    base_source = _resolve(own.extends, source)
    if base_source in seen or len(seen) >= LONGEST_CHAIN:
        raise RobotDataError(f"robot {source!r}: 'extends' must name another robot, got {own.extends!r}")
    if base_source.endswith(MODEL_ENDINGS):
        base = _read_model(base_source, own.inertia_about)
    else:
        base = _read_merged(base_source, (*seen, source))
    return replace(
        base,
        **{key: getattr(file, key) for key in REPLACED if getattr(file, key) is not None},
        sources={**base.sources, **file.sources},
        posture_rad={**base.posture_rad, **file.posture_rad},
        links={**base.links, **file.links},
        joints={**_rename(base.joints, file.joint_names, source), **file.joints},
        feet={**base.feet, **file.feet},
    )


def _read_model(source: str, about: About) -> RobotFile:
    with convert_errors(f"robot file {source!r}", RobotDataError):
        raw = read_mjcf(source) if source.endswith(".xml") else read_urdf(source, about_joint=about == "joint")
        return _with_records(decode(RobotFile, {**raw, "inertia_about": about and "com"}), source)


def _with_records(file: RobotFile, source: str) -> RobotFile:
    records = {
        group: {name: _Record(raw, source, file.inertia_about) for name, raw in getattr(file, group).items()}
        for group in ("links", "joints", "feet")
    }
    return replace(file, **records)  # type: ignore[arg-type]


def _rename(joints: Mapping[str, _Record], names: Mapping[str, str], source: str) -> dict[str, _Record]:
    """Return joints with new names, given as new to old; a minus sign in front of the old name reverses the joint."""
    old = {new: name.removeprefix("-") for new, name in names.items()}
    for name in old.values():
        if name not in joints:
            raise unknown(f"joint in joint_names of {source!r}", name, joints)
    renamed = {name: joint for name, joint in joints.items() if name not in old.values()}
    for new, name in old.items():
        if new in renamed:
            raise RobotDataError(f"robot {source!r}: joint_names gives {new!r} to {name!r}, but that name is taken")
        renamed[new] = joints[name]._replace(reversed=names[new].startswith("-"))
    return renamed


def _resolve(base: str, source: str) -> str:
    """Return the name or path of an extended robot; a path is relative to the file that names it."""
    # Normalised, to recognise two files that extend each other by different paths.
    return os.path.normpath(Path(source).parent / base) if base.endswith(FILE_ENDINGS) else base


def _read(name_or_path: str) -> RobotFile:
    if not name_or_path.endswith(".json") and name_or_path not in list_robots():
        raise unknown("robot", name_or_path, list_robots())
    path = Path(name_or_path if name_or_path.endswith(".json") else str(_DATA / f"{name_or_path}.json"))
    file = read_dataclass(RobotFile, path, "robot file", error=RobotDataError)
    models = [model for ending in MODEL_ENDINGS if os.path.isfile(model := path.with_suffix(ending))]
    if file.extends is None and file.root is None and models:
        return replace(file, extends=models[0].name)
    return file


def _make_robot(file: RobotFile, source: str) -> Robot:
    if file.name is None or file.root is None:
        missing = "name" if file.name is None else "root"
        raise RobotDataError(f"robot file {source!r}: {missing!r} is missing")
    file, notes = _complete(file, file.name)
    links = _decode(_decode_link, file.links)
    check_inertias(str(file.name), [links[name] for name, record in file.links.items() if record.about is None])
    return Robot(
        name=str(file.name),
        description=file.description or "",
        sources=file.sources,
        root=str(file.root),
        links=links,
        joints=_decode(_decode_joint, file.joints),
        feet=_decode(lambda side, record: decode(Foot, record.raw, f"feet.{side}"), file.feet),
        posture_rad=file.posture_rad,
        heat_loss_W_per_Nm2=file.heat_loss_W_per_Nm2,
        notes=tuple(notes),
    )


def _complete(file: RobotFile, name: str) -> tuple[RobotFile, list[str]]:
    """Return a robot from a URDF or MJCF with its feet and without faulty parts, and notes on what was inferred."""
    models = {record.file for record in file.links.values() if record.file.endswith(MODEL_ENDINGS)}
    if not models:
        return file, []
    model, notes = min(models), list[str]()
    if len(file.joints) > MOST_JOINTS:
        raise RobotDataError(
            f"robot file {model!r} has {len(file.joints)} turning joints, more than {MOST_JOINTS}; remove what no gait needs"
        )

    def find_fault_in(records: Mapping[str, _Record], decode: Callable[[str, _Record], object]) -> FindFault:
        # Faults of a robot file are errors; those of a URDF or MJCF may not matter.
        _decode(decode, {key: record for key, record in records.items() if not record.file.endswith(MODEL_ENDINGS)})

        def find_fault(key: str, raw: Mapping[str, Any]) -> GaitError | None:
            record = records[key]
            try:
                _decode(decode, {key: record._replace(raw=raw)})
            except GaitError as error:
                if not record.file.endswith(MODEL_ENDINGS):
                    raise
                return error
            return None

        return find_fault

    faults = find_fault_in(file.links, _decode_link), find_fault_in(file.joints, _decode_joint)
    for side, record in file.feet.items():
        with convert_errors(f"robot file {record.file!r}", RobotDataError):
            decode_value(Mapping[str, Any], record.raw, f"feet.{side}")
    links, joints, feet = ({k: dict(r.raw) for k, r in group.items()} for group in (file.links, file.joints, file.feet))
    with convert_errors(f"robot file {model!r}", RobotDataError):
        for record in feet.values():  # a sole's link is often behind a fixed joint
            if model.endswith(".urdf") and record.get("link") not in links:
                record["link"] = find_moving_link(model, str(record.get("link")))
        legs = find_legs(name, links, joints, feet)
        weld_faults(links, joints, legs.links, *faults, notes)
        if not all(set(EXTENTS) <= set(feet.get(side, ())) for side in SIDES):
            read_shapes = partial(read_foot_geoms if model.endswith(".xml") else read_foot_shapes, model)
            feet = infer_feet(name, legs, links, joints, feet, read_shapes, file.forward, notes)
    count = sum("foot:" not in note for note in notes)
    if count:
        parts = f"{count} note{'s' * (count > 1)} on welded parts"
        warn_once("robot %r: %s; see nlp-gait list --robot FILE", name, parts)
    changed = {
        "links": {key: file.links[key]._replace(raw=raw) for key, raw in links.items()},
        "joints": {key: file.joints[key]._replace(raw=raw) for key, raw in joints.items()},
        "feet": {side: file.feet.get(side, _Record({}, model))._replace(raw=raw) for side, raw in feet.items()},
    }
    return replace(file, **changed), notes  # type: ignore[arg-type]


def _decode(decode: Callable[[str, _Record], T], records: Mapping[str, _Record]) -> dict[str, T]:
    found = {}
    for name, record in records.items():
        with convert_errors(f"robot file {record.file!r}", RobotDataError):
            found[name] = decode(name, record)
    return found


def _decode_link(name: str, record: _Record) -> Link:
    link = decode(Link, record.raw, f"links.{name}", given={"name": name})
    return shift_to_com(link) if record.about == "joint" else link


def _decode_joint(name: str, record: _Record) -> Joint:
    where = f"joints.{name}"
    raw = decode_value(Mapping[str, Any], record.raw, where)
    axis = decode_value(Vector, raw.get("axis"), f"{where}.axis")
    length = math.hypot(*axis)
    if not 0.99 < length < 1.01:  # published axes are rounded (0.7071); a larger error is a mistake
        raise RobotDataError(f"joint {name!r}: axis must be a unit vector, got {list(axis)} of length {length:.3g}")
    completed = {"planning_limits_rad": raw.get("limits_rad"), **raw, "axis": [a / length for a in axis]}
    joint = decode(Joint, completed, where, given={"name": name})
    return reverse_joint(joint) if record.reversed else joint
