"""Joint angles over time from files of other programs: CSV, OpenSim's ``.mot`` and ``.sto``, Webots' ``.motion``."""

import math
import re
from pathlib import Path

import numpy as np

from nlp_gait.columns import CsvTable, parse_table
from nlp_gait.errors import InputError, unknown
from nlp_gait.files import read_text
from nlp_gait.formulation.signals import JointAngles
from nlp_gait.robots import Robot

# ``LKneePitch``, ``LKneePitch_deg``, ``LKneePitch [deg]``, and ``q_LKneePitch_rad`` of `export --to csv`.
COLUMN = re.compile(r"(?P<name>\w+?)(?:_(?P<suffix>rad|deg|s|ms)| ?\[(?P<unit>[^\]]*)\])?")
TIMES = ("t", "time")
ANGLE_UNITS = {"rad": 1.0, "deg": math.pi / 180.0}
TIME_UNITS = {"": 1.0, "s": 1.0, "ms": 1e-3}
END_OF_HEADER = "endheader"
WEBOTS_TIME = re.compile(r"(\d+):(\d+):(\d+)")


def read_joint_angles(path: Path, robot: Robot) -> JointAngles:
    """Read angles over time of a robot's joints; raises InputError, UnknownNameError.

    A table has a column of times and one of angles for each joint: ``t``, ``LKneePitch``, or ``LKneePitch_deg``; other columns of
    ``nlp-gait export --to csv`` are ignored. The header of ``.mot`` and ``.sto`` says whether angles are in degrees.
    """
    table, usual_unit = _read_motion_table(path)
    times: tuple[int, float] | None = None
    angles: dict[str, tuple[int, float]] = {}
    exported = "t_s" in table.header  # which has other columns, too
    for k, heading in enumerate(table.header):
        match = COLUMN.fullmatch(heading)
        name, unit = (match["name"], match["suffix"] or match["unit"] or "") if match else (heading, "")
        name = name.removeprefix("q_") if exported else name
        name = heading if heading in robot.joints else name
        if name in TIMES:
            if unit not in TIME_UNITS:
                raise InputError(f"{table.owner}: times must be in s or ms, got [{unit}]")
            times = k, TIME_UNITS[unit]
        elif name in robot.joints:
            unit = unit or usual_unit
            if unit not in ANGLE_UNITS:
                raise InputError(f"{table.owner}: {name} must be in rad or deg, got [{unit}]")
            angles[name] = k, ANGLE_UNITS[unit]
        elif not exported:
            raise unknown(f"joint in {table.owner}", heading, robot.joints)
    if times is None:
        raise InputError(
            f"{table.owner} needs a header with a column t of times [s]; it has {', '.join(table.header) or 'none'}"
        )
    values = np.array(table.rows)
    q = np.reshape([values[:, k] * factor for k, factor in angles.values()], (len(angles), len(values))).T
    return JointAngles(owner=table.owner, joints=tuple(angles), t=values[:, times[0]] * times[1], q=q)


def _read_motion_table(path: Path) -> tuple[CsvTable, str]:
    """Return a table, and the unit of angles whose column names none."""
    text, owner, unit = read_text(path, "motion"), f"motion {str(path)!r}", "rad"
    kind = path.suffix.lower()
    if kind in (".mot", ".sto"):
        lines = text.splitlines()
        end = next((k for k, line in enumerate(lines) if line.strip().lower() == END_OF_HEADER), None)
        if end is None:
            raise InputError(f"{owner} has no line {END_OF_HEADER!r}, which ends the header of a {kind} file")
        header = "".join("".join(lines[:end]).lower().split())
        unit = "deg" if "indegrees=yes" in header else "rad"
        text = "\n".join("\t".join(line.split()) for line in lines[end + 1 :])
    elif kind == ".motion":
        header, *rows = text.splitlines() or [""]
        mark, *joints = header.split(",")
        if mark != "#WEBOTS_MOTION":
            raise InputError(
                f"{owner} must begin with '#WEBOTS_MOTION,V1.0,' and the names of joints, got {header[:40]!r}"
            )
        text = "\n".join([",".join(("t", *joints[1:])), *(_convert_pose(row) for row in rows)])
    return parse_table(text, owner), unit


def _convert_pose(row: str) -> str:
    """Return a row ``MM:SS:mmm,pose,angle,...`` of Webots as time [s] and angles."""
    time, _, angles = row.split(",", 2) if row.count(",") > 1 else (row, "", "")
    if match := WEBOTS_TIME.fullmatch(time.strip()):
        minutes, seconds, milliseconds = map(int, match.groups())
        time = repr(60 * minutes + seconds + milliseconds / 1000)
    return f"{time},{angles}"
