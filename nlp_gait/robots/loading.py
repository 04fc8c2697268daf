"""Read robot files: one JSON object a robot, which may extend another one, or a URDF, and replace some of its records."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from functools import cache
from importlib import resources
from pathlib import Path
from typing import Any, TypeVar

from nlp_gait.errors import RobotDataError, kind_name, unknown
from nlp_gait.files import read_json
from nlp_gait.robots.fields import LARGEST_NUMBER, check_keys
from nlp_gait.robots.inertia import check_inertias, shifted_to_com
from nlp_gait.robots.perturbation import perturbed, split_name
from nlp_gait.robots.robot import Foot, Joint, Link, Motor, Robot
from nlp_gait.robots.tree import reversed_joint
from nlp_gait.robots.urdf import urdf_record

SCHEMA = 1
LONGEST_CHAIN = 8  # of robots that extend each other

T = TypeVar("T")

_DATA = resources.files("nlp_gait.robots") / "data"


def robot_names() -> tuple[str, ...]:
    """Names of the robots that come with the package."""
    return tuple(sorted(entry.name.removesuffix(".json") for entry in _DATA.iterdir() if entry.name.endswith(".json")))


@cache
def load_robot(name_or_path: str) -> Robot:
    """Robot by its name, or from a file: a path that ends in ``.json``, or in ``.urdf`` with a ``.json`` beside it.

    Behind an ``@`` may stand changes of masses, leg lengths and soles, see ``robots/perturbation.py``.

    Raises:
        UnknownNameError: no such robot.
        RobotDataError: the file cannot be read, is damaged or describes an impossible robot.
        MissingExtraError: a URDF cannot be read without its extra.
    """
    source, changes = split_name(name_or_path)
    return perturbed(_robot(_merged(_beside_urdf(source) if source.endswith(".urdf") else source)), changes)


def _beside_urdf(path: str) -> str:
    """The robot file that extends a URDF and lies beside it under the same name."""
    partner = Path(path).with_suffix(".json")
    if not os.path.isfile(partner):
        raise RobotDataError(
            f"robot file {path!r}: a URDF says nothing about soles; write {str(partner)!r} with "
            f'{{"schema": {SCHEMA}, "extends": "{Path(path).name}", "feet": {{"left": ..., "right": ...}}}}'
        )
    if _resolved(_read(str(partner)).get("extends"), str(partner)) != os.path.normpath(path):
        raise RobotDataError(
            f"robot file {str(partner)!r}: 'extends' must be {Path(path).name!r}, beside which it lies"
        )
    return str(partner)


def _merged(source: str, seen: tuple[str, ...] = ()) -> dict[str, Any]:
    """Record of a robot with what it extends."""
    raw = _read(source)
    about = raw.get("inertia_about")
    if about not in (None, "com", "joint"):
        raise RobotDataError(f"robot {source!r}: 'inertia_about' must be 'com' or 'joint', got {about!r}")
    if isinstance(raw.get("links"), dict):
        raw["links"] = _stamped(raw["links"], inertia_about=about)
    if "extends" not in raw:
        return raw
    base_source = _resolved(raw["extends"], source)
    if base_source is None or base_source in seen or len(seen) >= LONGEST_CHAIN:
        raise RobotDataError(f"robot {source!r}: 'extends' must name another robot, got {raw['extends']!r}")
    if base_source.endswith(".urdf"):
        base = urdf_record(base_source, about_joint=about == "joint")
        base["links"] = _stamped(base["links"], inertia_about=about and "com")
    else:
        base = _merged(base_source, (*seen, source))
    base["joints"] = _renamed(_group(base, "joints", base_source), _group(raw, "joint_names", source), source)
    merged = {**base, **raw}
    for group in ("links", "joints", "feet", "sources"):
        merged[group] = {**_group(base, group, base_source), **_group(raw, group, source)}
    return merged


def _stamped(records: Mapping[str, Any], **stamp: object) -> dict[str, Any]:
    """Records with one more field; what is no record is left for the check to come."""
    return {name: {**record, **stamp} if isinstance(record, dict) else record for name, record in records.items()}


def _renamed(joints: Mapping[str, Any], names: Mapping[str, Any], source: str) -> dict[str, Any]:
    """Joints under new names, given as new to old; a minus sign before the old one reverses the joint's sense."""
    old = {new: _get(names, new, str, f"robot {source!r}: joint_names").removeprefix("-") for new in names}
    for name in old.values():
        if name not in joints:
            raise unknown(f"joint in joint_names of {source!r}", name, joints)
    renamed = {name: joint for name, joint in joints.items() if name not in old.values()}
    for new, name in old.items():
        if new in renamed:
            raise RobotDataError(f"robot {source!r}: joint_names gives {new!r} to {name!r}, but that name is taken")
        renamed |= _stamped({new: joints[name]}, reversed=names[new].startswith("-"))
    return renamed


def _resolved(base: Any, source: str) -> str | None:
    """What a robot extends: a name, or a file, whose path is relative to the file that names it."""
    if not isinstance(base, str):
        return None
    # Normalised, so that two files that extend each other by roundabout paths are found out.
    return os.path.normpath(Path(source).parent / base) if base.endswith((".json", ".urdf")) else base


def _read(name_or_path: str) -> dict[str, Any]:
    if name_or_path.endswith(".json"):
        raw = read_json(Path(name_or_path), "robot file", error=RobotDataError)
    elif name_or_path in robot_names():
        raw = json.loads((_DATA / f"{name_or_path}.json").read_text(encoding="utf-8"))
    else:
        raise unknown("robot", name_or_path, robot_names())
    found = raw.get("schema") if isinstance(raw, dict) else type(raw).__name__
    if type(found) is not int or found != SCHEMA:
        raise RobotDataError(f"robot file {name_or_path!r}: 'schema' must be {SCHEMA}, got {found!r}")
    check_keys(raw, name_or_path)
    return raw


def _robot(raw: Mapping[str, Any]) -> Robot:
    name = _get(raw, "name", str, "robot")
    owner = f"robot {name!r}"
    links = {key: _link(key, value) for key, value in _records(raw, "links", owner)}
    check_inertias(name, [links[key] for key, value in _records(raw, "links", owner) if not value.get("inertia_about")])
    joints = {key: _joint(key, value) for key, value in _records(raw, "joints", owner)}
    feet = {key: _foot(key, value) for key, value in _records(raw, "feet", owner)}
    return Robot(
        name=name,
        description=_get({"description": "", **raw}, "description", str, owner),
        sources={
            key: _get({key: value}, key, str, f"{owner}: sources")
            for key, value in _group(raw, "sources", name).items()
        },
        root=_get(raw, "root", str, owner),
        links=links,
        joints=joints,
        feet=feet,
    )


def _link(name: str, raw: Mapping[str, Any]) -> Link:
    owner = f"link {name!r}"
    link = Link(
        name=name,
        mass_kg=_number(raw, "mass_kg", owner),
        com_m=_numbers(raw, "com_m", 3, owner),  # type: ignore[arg-type]
        inertia_com_kgm2=_numbers(raw, "inertia_com_kgm2", 6, owner),  # type: ignore[arg-type]
    )
    return shifted_to_com(link) if raw.get("inertia_about") == "joint" else link


def _joint(name: str, raw: Mapping[str, Any]) -> Joint:
    owner = f"joint {name!r}"
    axis = _numbers(raw, "axis", 3, owner)
    length = math.hypot(*axis)
    if not 0.99 < length < 1.01:  # published axes are rounded (0.7071); a larger error is a mistake
        raise RobotDataError(f"{owner}: axis must be a unit vector, got {list(axis)} of length {length:.3g}")
    limits = _numbers(raw, "limits_rad", 2, owner)
    planning = _numbers(raw, "planning_limits_rad", 2, owner) if "planning_limits_rad" in raw else limits
    motor = raw.get("motor")
    joint = Joint(
        name=name,
        parent=_get(raw, "parent", str, owner),
        child=_get(raw, "child", str, owner),
        origin_m=_numbers(raw, "origin_m", 3, owner),  # type: ignore[arg-type]
        axis=tuple(a / length for a in axis),  # type: ignore[arg-type]
        limits_rad=limits,  # type: ignore[arg-type]
        planning_limits_rad=planning,  # type: ignore[arg-type]
        velocity_limit_rad_s=_number(raw, "velocity_limit_rad_s", owner),
        torque_limit_Nm=_number(raw, "torque_limit_Nm", owner),
        motor=None if motor is None else _motor(motor, owner),
    )
    return reversed_joint(joint) if raw.get("reversed") else joint


def _motor(raw: Any, owner: str) -> Motor:
    if not isinstance(raw, dict):
        raise RobotDataError(f"{owner}: 'motor' must be an object, got {raw!r}")
    ratings = ("gear_ratio", "no_load_rpm", "stall_torque_mNm", "continuous_torque_mNm")
    return Motor(make=_get(raw, "make", str, owner), **{key: _number(raw, key, owner) for key in ratings})


def _foot(side: str, raw: Mapping[str, Any]) -> Foot:
    owner = f"foot {side!r}"
    extents = ("ankle_height_m", "front_m", "back_m", "left_m", "right_m")
    polygon = raw.get("sole_polygon_m", [])
    if not isinstance(polygon, list):
        raise RobotDataError(f"{owner}: sole_polygon_m must be a list of [x, y], got {polygon!r}")
    corners = tuple(_numbers({"corner": c}, "corner", 2, f"{owner}: sole_polygon_m") for c in polygon)
    return Foot(
        link=_get(raw, "link", str, owner),
        sole_polygon_m=corners,  # type: ignore[arg-type]
        **{key: _number(raw, key, owner) for key in extents},
    )


def _records(raw: Mapping[str, Any], group: str, owner: str) -> list[tuple[str, Mapping[str, Any]]]:
    records = raw.get(group)
    if not isinstance(records, dict) or not all(isinstance(r, dict) for r in records.values()):
        raise RobotDataError(f"{owner}: {group!r} must be an object of records by name, got {type(records).__name__}")
    return list(records.items())


def _group(raw: Mapping[str, Any], group: str, robot: str) -> dict[str, Any]:
    """Entries of a group that need not be there."""
    entries = raw.get(group, {})
    if not isinstance(entries, dict):
        raise RobotDataError(f"robot {robot!r}: {group!r} must be an object, got {entries!r}")
    return entries


def _get(raw: Mapping[str, Any], key: str, kind: type[T], owner: str) -> T:
    value = raw.get(key)
    if not isinstance(value, kind):
        raise RobotDataError(f"{owner}: {key!r} must be {kind_name(kind)}, got {value!r}")
    return value


def _number(raw: Mapping[str, Any], key: str, owner: str) -> float:
    value = raw.get(key)
    if isinstance(value, bool) or not isinstance(value, (int, float)) or not math.isfinite(value):
        raise RobotDataError(f"{owner}: {key!r} must be a finite number, got {value!r}")
    if abs(value) > LARGEST_NUMBER:
        raise RobotDataError(f"{owner}: {key!r} must be within {LARGEST_NUMBER:g}, got {value!r}")
    return float(value)


def _numbers(raw: Mapping[str, Any], key: str, count: int, owner: str) -> tuple[float, ...]:
    value = raw.get(key)
    if not isinstance(value, list) or len(value) != count:
        raise RobotDataError(f"{owner}: {key!r} must be a list of {count} numbers, got {value!r}")
    return tuple(_number({key: item}, key, owner) for item in value)
