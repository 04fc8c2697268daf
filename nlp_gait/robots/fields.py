"""Keys that robot files may have: one that nobody reads is a mistake in writing it, and would be passed over in silence."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

from nlp_gait.errors import RobotDataError, unknown

TOP = (
    *("schema", "name", "extends", "description", "conventions", "sources", "inertia_about", "joint_names"),
    *("root", "links", "joints", "feet"),
)
LINK = ("mass_kg", "com_m", "inertia_com_kgm2")
JOINT = (
    *("parent", "child", "origin_m", "axis", "limits_rad", "planning_limits_rad"),
    *("velocity_limit_rad_s", "torque_limit_Nm", "motor"),
)
MOTOR = ("make", "gear_ratio", "no_load_rpm", "stall_torque_mNm", "continuous_torque_mNm")
FOOT = ("link", "ankle_height_m", "front_m", "back_m", "left_m", "right_m", "sole_polygon_m")
SIDES = ("left", "right")
LONGEST_NAME = 100
LARGEST_NUMBER = 1e9  # in the unit of its field: beyond what any robot has, and its squares stay finite


def check_keys(raw: Mapping[str, Any], source: str) -> None:
    """Refuse unknown keys, and names that cannot be printed; what is no object is left for the check to come.

    Raises:
        UnknownNameError: with the nearest known keys.
        RobotDataError: a name is empty, too long, or holds control characters.
    """
    _known(raw, TOP, f"robot file {source!r}")
    names = [("robot", raw["name"])] if isinstance(raw.get("name"), str) else []
    for group, keys in (("links", LINK), ("joints", JOINT), ("feet", FOOT)):
        for name, record in _objects(raw.get(group)):
            names.append((group, name))
            _known(record, keys, f"{group} {name!r} in {source!r}")
            for _, motor in _objects({"motor": record.get("motor")}):
                _known(motor, MOTOR, f"motor of {name!r} in {source!r}")
    if isinstance(raw.get("feet"), Mapping):
        _known(raw["feet"], SIDES, f"feet in {source!r}")
    if isinstance(raw.get("joint_names"), Mapping):
        names += [("joint_names", name) for name in raw["joint_names"]]
    for group, name in names:
        check_name(name, f"robot file {source!r}: {group}")


def check_name(name: str, where: str) -> None:
    """Refuse a name that is empty, long, or not printable; raises RobotDataError."""
    if not name or len(name) > LONGEST_NAME or not name.isprintable():
        raise RobotDataError(
            f"{where}: a name has 1 to {LONGEST_NAME} printable characters, got {name[:LONGEST_NAME]!r}"
        )


def _objects(group: Any) -> Iterable[tuple[str, Mapping[str, Any]]]:
    items = group.items() if isinstance(group, Mapping) else ()
    return [(name, record) for name, record in items if isinstance(record, Mapping)]


def _known(raw: Mapping[str, Any], keys: Iterable[str], where: str) -> None:
    for key in raw:
        if key not in keys:
            raise unknown(f"key of {where}", key, keys)
