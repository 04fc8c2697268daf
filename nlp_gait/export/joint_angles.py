"""Joint angles over time from CSV files of other programs."""

import math
import re
from pathlib import Path

import numpy as np

from nlp_gait.columns import read_table
from nlp_gait.errors import InputError, unknown
from nlp_gait.formulation.signals import JointAngles
from nlp_gait.robots import Robot

# ``LKneePitch``, ``LKneePitch_deg``, ``LKneePitch [deg]``, and ``q_LKneePitch_rad`` of `export --to csv`.
COLUMN = re.compile(r"(?P<name>\w+?)(?:_(?P<suffix>rad|deg)| ?\[(?P<unit>[^\]]*)\])?")
TIMES = ("t", "time", "time_s")
FACTORS = {"rad": 1.0, "deg": math.pi / 180.0, "": 1.0}


def read_joint_angles(path: Path, robot: Robot) -> JointAngles:
    """Read angles over time of a robot's joints from a CSV file; raises InputError, UnknownNameError.

    It has a column of times [s] and one of angles for each joint: ``t``, ``LKneePitch``, or ``LKneePitch_deg``; other columns
    of ``nlp-gait export --to csv`` are ignored.
    """
    table = read_table(path, "motion")
    times: int | None = None
    angles: dict[str, tuple[int, float]] = {}
    exported = "t_s" in table.header  # which has other columns, too
    for k, heading in enumerate(table.header):
        match = COLUMN.fullmatch(heading)
        name, unit = (match["name"], match["suffix"] or match["unit"] or "") if match else (heading, "")
        name = name.removeprefix("q_") if exported else name
        name = heading if heading in robot.joints else name
        if name in TIMES or heading == "t_s":
            if unit not in ("", "s"):
                raise InputError(f"{table.owner}: times must be in s, got [{unit}]")
            times = k
        elif name in robot.joints:
            if unit not in FACTORS:
                raise InputError(f"{table.owner}: {name} must be in rad or deg, got [{unit}]")
            angles[name] = k, FACTORS[unit]
        elif not exported:
            raise unknown(f"joint in {table.owner}", heading, robot.joints)
    if times is None:
        raise InputError(
            f"{table.owner} needs a header with a column t of times [s]; it has {', '.join(table.header) or 'none'}"
        )
    values = np.array(table.rows)
    q = np.reshape([values[:, k] * factor for k, factor in angles.values()], (len(angles), len(values))).T
    return JointAngles(owner=table.owner, joints=tuple(angles), t=values[:, times], q=q)
