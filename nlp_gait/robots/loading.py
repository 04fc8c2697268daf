"""Read robot files: one JSON object a robot, which may extend another one, or a URDF or MJCF, and replace some of its records."""

from __future__ import annotations

import hashlib
import math
import os
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any, Literal, NamedTuple, TypeVar

from nlp_gait.decoding import decoded, decoded_value, read_decoded
from nlp_gait.errors import GaitError, RobotDataError, UnknownNameError, shown, unknown, warn_once
from nlp_gait.files import check_path, refusing
from nlp_gait.robots.fields import check_name
from nlp_gait.robots.inertia import check_inertias, shifted_to_com
from nlp_gait.robots.mjcf import mjcf_points, mjcf_record
from nlp_gait.robots.perturbation import perturbed, split_name
from nlp_gait.robots.robot import Foot, Joint, Link, Robot, Vector
from nlp_gait.robots.tree import reversed_joint
from nlp_gait.robots.understanding import Understood, understood
from nlp_gait.robots.urdf import collision_points, urdf_record

MODEL_ENDINGS = (".urdf", ".xml")
FILE_ENDINGS = (".json", *MODEL_ENDINGS)
LONGEST_CHAIN = 8  # of robots that extend each other
# What a file says once, in place of what it extends.
REPLACED = ("name", "description", "root", "forward", "heat_loss_W_per_Nm2", "unphysical")

T = TypeVar("T")
Side = Literal["left", "right"]
About = Literal["com", "joint"] | None

_DATA = resources.files("nlp_gait.robots") / "data"


@dataclass(frozen=True, kw_only=True)
class RobotFile:
    """Content of a robot file. Links, joints and feet are decoded later, once it is known which of them are replaced."""

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
    unphysical: Literal["refuse", "repair"] | None = None

    def __post_init__(self) -> None:
        """Refuse names that cannot be printed."""
        if self.name is not None:
            check_name(self.name, "robot")
        for group in ("links", "joints", "joint_names"):
            for name in getattr(self, group):
                check_name(name, group)
        for side in self.feet:
            decoded_value(Side, side, "a key of feet")


class _Record(NamedTuple):
    """A link, joint or foot as a file describes it.

    Attributes:
        raw: its fields.
        file: the file.
        about: point to which the file says that its inertia tensors refer, if it says so.
        reversed: the joint's angle is counted the other way round.
    """

    raw: Any
    file: str
    about: About = None
    reversed: bool = False


def robot_names() -> tuple[str, ...]:
    """Names of the robots that come with the package."""
    return tuple(sorted(entry.name.removesuffix(".json") for entry in _DATA.iterdir() if entry.name.endswith(".json")))


def load_robot(name_or_path: str) -> Robot:
    """Robot by its name, or from a file: a path that ends in ``.json``, ``.urdf`` or, for MJCF, ``.xml``.

    What such a file leaves out is derived, see ``robots/understanding.py``;
    a ``.json`` of the same name beside it says it otherwise.

    Changes of masses, leg lengths and soles may follow after an ``@``, see ``robots/perturbation.py``. A file is read anew each
    time: it may have changed, or be another one under the same relative path.

    Raises:
        UnknownNameError: no such robot.
        RobotDataError: the file cannot be read, is damaged or describes an impossible robot.
        MissingExtraError: a URDF cannot be read without its extra.
    """
    if not isinstance(name_or_path, str):
        raise UnknownNameError(f"the name of a robot must be a text, got {shown(name_or_path)}")
    check_path(name_or_path, f"robot {name_or_path!r}", RobotDataError)
    return _made_from(name_or_path) if is_robot_file(name_or_path) else _loaded(name_or_path)


def is_robot_file(name_or_path: str) -> bool:
    """Whether a robot comes from a file rather than with the package."""
    return split_name(name_or_path)[0].endswith(FILE_ENDINGS)


def robot_content(path: str) -> str:
    """Hash of all files that a robot from a file is made of; raises as ``load_robot``."""
    return hashlib.sha256(repr(_merged(_described_in(split_name(path)[0]))).encode()).hexdigest()


@cache
def _loaded(name: str) -> Robot:
    return _made_from(name)


def _made_from(name_or_path: str) -> Robot:
    source, changes = split_name(name_or_path)
    path = _described_in(source)
    return perturbed(_robot(_merged(path), path), changes)


def _described_in(path: str) -> str:
    """Where a robot's description begins: for a URDF the robot file of the same name that extends it, if one lies beside it."""
    if not path.endswith(MODEL_ENDINGS):
        return path
    partner = Path(path).with_suffix(".json")
    if not os.path.isfile(partner):
        return path
    base = _read(str(partner)).extends
    if base is None or _resolved(base, str(partner)) != os.path.normpath(path):
        raise RobotDataError(
            f"robot file {str(partner)!r}: 'extends' must be {Path(path).name!r}, beside which it lies"
        )
    return str(partner)


def _merged(source: str, seen: tuple[str, ...] = ()) -> RobotFile:
    """Content of a robot file with what it extends; links, joints and feet are ``_Record``."""
    if source.endswith(MODEL_ENDINGS):
        return _of_model(source, None)
    own = _read(source)
    file = _with_records(own, source)
    if own.extends is None:
        return file
    base_source = _resolved(own.extends, source)
    if base_source in seen or len(seen) >= LONGEST_CHAIN:
        raise RobotDataError(f"robot {source!r}: 'extends' must name another robot, got {own.extends!r}")
    if base_source.endswith(MODEL_ENDINGS):
        base = _of_model(base_source, own.inertia_about)
    else:
        base = _merged(base_source, (*seen, source))
    return replace(
        base,
        **{key: getattr(file, key) for key in REPLACED if getattr(file, key) is not None},
        sources={**base.sources, **file.sources},
        posture_rad={**base.posture_rad, **file.posture_rad},
        links={**base.links, **file.links},
        joints={**_renamed(base.joints, file.joint_names, source), **file.joints},
        feet={**base.feet, **file.feet},
    )


def _of_model(source: str, about: About) -> RobotFile:
    """Content of a URDF or MJCF."""
    with refusing(f"robot file {source!r}", RobotDataError):
        raw = mjcf_record(source) if is_mjcf(source) else urdf_record(source, about_joint=about == "joint")
        return _with_records(decoded(RobotFile, {**raw, "inertia_about": about and "com"}), source)


def is_mjcf(source: str) -> bool:
    """Whether a file is MuJoCo's, by its ending."""
    return source.endswith(".xml")


def _with_records(file: RobotFile, source: str) -> RobotFile:
    records = {
        group: {name: _Record(raw, source, file.inertia_about) for name, raw in getattr(file, group).items()}
        for group in ("links", "joints", "feet")
    }
    return replace(file, **records)  # type: ignore[arg-type]


def _renamed(joints: Mapping[str, _Record], names: Mapping[str, str], source: str) -> dict[str, _Record]:
    """Joints under new names, given as new to old; a minus sign before the old one reverses the joint's sense."""
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


def _resolved(base: str, source: str) -> str:
    """What a robot extends: a name, or a file, whose path is relative to the file that names it."""
    # Normalised, so that two files that extend each other by roundabout paths are recognised.
    return os.path.normpath(Path(source).parent / base) if base.endswith(FILE_ENDINGS) else base


def _read(name_or_path: str) -> RobotFile:
    if not name_or_path.endswith(".json") and name_or_path not in robot_names():
        raise unknown("robot", name_or_path, robot_names())
    path = Path(name_or_path if name_or_path.endswith(".json") else str(_DATA / f"{name_or_path}.json"))
    file = read_decoded(RobotFile, path, "robot file", error=RobotDataError)
    beside = [path.with_suffix(ending) for ending in MODEL_ENDINGS if os.path.isfile(path.with_suffix(ending))]
    if file.extends is None and file.root is None and beside:  # it says of that model what it would say otherwise
        return replace(file, extends=beside[0].name)
    return file


def _robot(file: RobotFile, source: str) -> Robot:
    if file.name is None or file.root is None:
        missing = "name" if file.name is None else "root"
        raise RobotDataError(f"robot file {source!r}: {missing!r} is missing")
    name, root = file.name, file.root
    file, notes = _completed(file)
    links = _made(_link, file.links)
    check_inertias(name, [links[name] for name, record in file.links.items() if record.about is None])
    return Robot(
        name=name,
        description=file.description or "",
        sources=file.sources,
        root=root,
        links=links,
        joints=_made(_joint, file.joints),
        feet=_made(lambda side, record: decoded(Foot, record.raw, f"feet.{side}"), file.feet),
        posture_rad=file.posture_rad,
        heat_loss_W_per_Nm2=file.heat_loss_W_per_Nm2,
        notes=notes,
    )


def _completed(file: RobotFile) -> tuple[RobotFile, tuple[str, ...]]:
    """A robot from a URDF or MJCF with its feet, and without the parts that cannot move by themselves; what was done."""
    models = {record.file for record in file.links.values() if record.file.endswith(MODEL_ENDINGS)}
    if not models:
        return file, ()
    model, name = min(models), str(file.name)
    records = {**file.links, **file.joints}

    def fault_in(make: Callable[[str, _Record], object]) -> Callable[[str, Mapping[str, Any]], GaitError | None]:
        def fault(name: str, raw: Mapping[str, Any]) -> GaitError | None:
            record = records[name]
            try:
                _made(make, {name: record._replace(raw=raw)})
            except GaitError as error:
                if not record.file.endswith(MODEL_ENDINGS):
                    raise
                return error
            return None

        return fault

    # What a robot file says of itself is checked first; what a URDF says may be passed over.
    _made(_link, {key: record for key, record in file.links.items() if not record.file.endswith(MODEL_ENDINGS)})
    _made(_joint, {key: record for key, record in file.joints.items() if not record.file.endswith(MODEL_ENDINGS)})
    for side, record in file.feet.items():
        with refusing(f"robot file {record.file!r}", RobotDataError):
            decoded_value(Mapping[str, Any], record.raw, f"feet.{side}")
    with refusing(f"robot file {model!r}", RobotDataError):
        found: Understood = understood(
            name,
            {key: record.raw for key, record in file.links.items()},
            {key: record.raw for key, record in file.joints.items()},
            {key: record.raw for key, record in file.feet.items()},
            cloud=lambda link: mjcf_points(model, link) if is_mjcf(model) else collision_points(model, link),
            forward=file.forward,
            repair=file.unphysical == "repair",
            fault_of_link=fault_in(_link),
            fault_of_joint=fault_in(_joint),
        )
    for note in found.notes:
        if "foot:" not in note:
            warn_once("robot %r: %s", name, note)
    feet = {side: file.feet.get(side, _Record({}, model))._replace(raw=raw) for side, raw in found.feet.items()}
    links = {key: records[key]._replace(raw=raw) for key, raw in found.links.items()}
    joints = {key: records[key]._replace(raw=raw) for key, raw in found.joints.items()}
    return replace(file, links=links, joints=joints, feet=feet), found.notes


def _made(make: Callable[[str, _Record], T], records: Mapping[str, _Record]) -> dict[str, T]:
    made = {}
    for name, record in records.items():
        with refusing(f"robot file {record.file!r}", RobotDataError):
            made[name] = make(name, record)
    return made


def _link(name: str, record: _Record) -> Link:
    link = decoded(Link, record.raw, f"links.{name}", given={"name": name})
    return shifted_to_com(link) if record.about == "joint" else link


def _joint(name: str, record: _Record) -> Joint:
    where = f"joints.{name}"
    raw = decoded_value(Mapping[str, Any], record.raw, where)
    axis = decoded_value(Vector, raw.get("axis"), f"{where}.axis")
    length = math.hypot(*axis)
    if not 0.99 < length < 1.01:  # published axes are rounded (0.7071); a larger error is a mistake
        raise RobotDataError(f"joint {name!r}: axis must be a unit vector, got {list(axis)} of length {length:.3g}")
    completed = {"planning_limits_rad": raw.get("limits_rad"), **raw, "axis": [a / length for a in axis]}
    joint = decoded(Joint, completed, where, given={"name": name})
    return reversed_joint(joint) if record.reversed else joint
