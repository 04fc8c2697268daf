"""Read robot files: one JSON object a robot, which may extend another one, or a URDF, and replace some of its records."""

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
from nlp_gait.errors import RobotDataError, UnknownNameError, shown, unknown
from nlp_gait.files import refusing
from nlp_gait.robots.fields import check_name
from nlp_gait.robots.inertia import check_inertias, shifted_to_com
from nlp_gait.robots.perturbation import perturbed, split_name
from nlp_gait.robots.robot import Foot, Joint, Link, Robot, Vector
from nlp_gait.robots.tree import reversed_joint
from nlp_gait.robots.urdf import urdf_record

FILE_ENDINGS = (".json", ".urdf")
LONGEST_CHAIN = 8  # of robots that extend each other

T = TypeVar("T")
Side = Literal["left", "right"]
About = Literal["com", "joint"] | None

_DATA = resources.files("nlp_gait.robots") / "data"


@dataclass(frozen=True, kw_only=True)
class RobotFile:
    """Content of a robot file. Links, joints and feet are decoded later, once it is known which of them are replaced."""

    schema: Literal[1]
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
    """Robot by its name, or from a file: a path that ends in ``.json``, or in ``.urdf`` with a ``.json`` beside it.

    Changes of masses, leg lengths and soles may follow after an ``@``, see ``robots/perturbation.py``. A file is read anew each
    time: it may have changed, or be another one under the same relative path.

    Raises:
        UnknownNameError: no such robot.
        RobotDataError: the file cannot be read, is damaged or describes an impossible robot.
        MissingExtraError: a URDF cannot be read without its extra.
    """
    if not isinstance(name_or_path, str):
        raise UnknownNameError(f"the name of a robot must be a text, got {shown(name_or_path)}")
    return _made_from(name_or_path) if is_robot_file(name_or_path) else _loaded(name_or_path)


def is_robot_file(name_or_path: str) -> bool:
    """Whether a robot comes from a file rather than with the package."""
    return split_name(name_or_path)[0].endswith(FILE_ENDINGS)


def robot_content(path: str) -> str:
    """Hash of all files that a robot from a file is made of; raises as ``load_robot``."""
    source, _ = split_name(path)
    return hashlib.sha256(
        repr(_merged(_beside_urdf(source) if source.endswith(".urdf") else source)).encode()
    ).hexdigest()


@cache
def _loaded(name: str) -> Robot:
    return _made_from(name)


def _made_from(name_or_path: str) -> Robot:
    source, changes = split_name(name_or_path)
    path = _beside_urdf(source) if source.endswith(".urdf") else source
    return perturbed(_robot(_merged(path), path), changes)


def _beside_urdf(path: str) -> str:
    """The robot file that extends a URDF and lies beside it under the same name."""
    partner = Path(path).with_suffix(".json")
    if not os.path.isfile(partner):
        raise RobotDataError(
            f"robot file {path!r}: a URDF says nothing about soles; write {str(partner)!r} with "
            f'{{"schema": 1, "extends": "{Path(path).name}", "feet": {{"left": ..., "right": ...}}}}'
        )
    base = _read(str(partner)).extends
    if base is None or _resolved(base, str(partner)) != os.path.normpath(path):
        raise RobotDataError(
            f"robot file {str(partner)!r}: 'extends' must be {Path(path).name!r}, beside which it lies"
        )
    return str(partner)


def _merged(source: str, seen: tuple[str, ...] = ()) -> RobotFile:
    """Content of a robot file with what it extends; links, joints and feet are ``_Record``."""
    own = _read(source)
    file = _with_records(own, source)
    if own.extends is None:
        return file
    base_source = _resolved(own.extends, source)
    if base_source in seen or len(seen) >= LONGEST_CHAIN:
        raise RobotDataError(f"robot {source!r}: 'extends' must name another robot, got {own.extends!r}")
    if base_source.endswith(".urdf"):
        about = own.inertia_about
        with refusing(f"robot file {base_source!r}", RobotDataError):
            raw = urdf_record(base_source, about_joint=about == "joint")
            base = _with_records(decoded(RobotFile, {**raw, "inertia_about": about and "com"}), base_source)
    else:
        base = _merged(base_source, (*seen, source))
    return replace(
        base,
        **{key: getattr(file, key) for key in ("name", "description", "root") if getattr(file, key) is not None},
        sources={**base.sources, **file.sources},
        links={**base.links, **file.links},
        joints={**_renamed(base.joints, file.joint_names, source), **file.joints},
        feet={**base.feet, **file.feet},
    )


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
    return os.path.normpath(Path(source).parent / base) if base.endswith((".json", ".urdf")) else base


def _read(name_or_path: str) -> RobotFile:
    if not name_or_path.endswith(".json") and name_or_path not in robot_names():
        raise unknown("robot", name_or_path, robot_names())
    path = Path(name_or_path if name_or_path.endswith(".json") else str(_DATA / f"{name_or_path}.json"))
    return read_decoded(RobotFile, path, "robot file", error=RobotDataError)


def _robot(file: RobotFile, source: str) -> Robot:
    if file.name is None or file.root is None:
        missing = "name" if file.name is None else "root"
        raise RobotDataError(f"robot file {source!r}: {missing!r} is missing")
    links = _made(_link, file.links)
    check_inertias(file.name, [links[name] for name, record in file.links.items() if record.about is None])
    return Robot(
        name=file.name,
        description=file.description or "",
        sources=file.sources,
        root=file.root,
        links=links,
        joints=_made(_joint, file.joints),
        feet=_made(lambda side, record: decoded(Foot, record.raw, f"feet.{side}"), file.feet),
    )


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
