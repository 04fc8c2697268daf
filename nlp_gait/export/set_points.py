"""Joint angles over time for other programs and from them: arguments of NAOqi, Webots' `.motion` files, and CSV.

The grammar of `.motion` is that of Webots' own parser (`src/controller/c/motion.c`), and stricter where that guesses: a header
``#WEBOTS_MOTION,V1.0,<motor>,...``; then rows ``[[MM:]SS:]mmm,<pose name>,<radians or *>,...`` with strictly increasing times and
one value a motor; lines shorter than 4,096 characters; an empty line ends the file. Webots interpolates linearly between rows.
"""

import math
import re
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from nlp_gait.columns import read_table
from nlp_gait.errors import InputError, unknown
from nlp_gait.files import read_text, write_text
from nlp_gait.formulation import Array, Result, sample_finely
from nlp_gait.formulation.result import count_periods
from nlp_gait.formulation.signals import JointAngles
from nlp_gait.robots import Robot

PERIOD_MS = 40  # as in Gupta, Pratihar, Deb (2023), and Webots' worlds for NAO
APPROACH_S = 2.0  # from the robot's current pose to the first one: a key of NAOqi needs a time > 0
COUPLED = ("RHipYawPitch",)  # both hip yaw-pitch joints are one motor, which NAOqi commands by the left one's name
HEADER, VERSION = "#WEBOTS_MOTION", "V1.0"
LONGEST_LINE = 4095  # characters with the line's end: size of the parser's buffer
UNTOUCHED = "*"
# Up to four digits of seconds: a longer motion is a damaged file, and would overflow the parser's integers.
_TIME = re.compile(r"(?:(?:(\d{1,4}):)?(\d{1,4}):)?(\d{1,7})", re.ASCII)
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)
# ``LKneePitch``, ``LKneePitch_deg``, ``LKneePitch [deg]``, and ``q_LKneePitch_rad`` of `export --format csv`.
COLUMN = re.compile(r"(?P<name>\w+?)(?:_(?P<suffix>rad|deg)| ?\[(?P<unit>[^\]]*)\])?")
TIMES = ("t", "time", "time_s")
FACTORS = {"rad": 1.0, "deg": math.pi / 180.0, "": 1.0}


@dataclass(frozen=True, kw_only=True, eq=False)
class SetPoints:
    """Poses of all joints."""

    joints: tuple[str, ...]
    times_ms: tuple[int, ...]  #: (T,) whole milliseconds, strictly increasing
    angles: Array  #: (T, J) [rad]; NaN leaves a joint alone


def make_set_points(result: Result, period_ms: int = PERIOD_MS) -> SetPoints:
    """Return planned joint angles exactly a period apart, see ``count_periods``.

    Raises InputError without time histories, or if the period is not a whole number of milliseconds >= 1.
    """
    from scipy.interpolate import CubicSpline  # takes as long to import as all the rest of a command

    if isinstance(period_ms, bool) or not isinstance(period_ms, int) or period_ms < 1:
        raise InputError(f"the period must be a whole number of milliseconds >= 1, got {period_ms!r}")
    signals = sample_finely(result)
    duration = float(signals.arrays["t"][-1])
    count = count_periods(signals, period_ms)
    times_ms = tuple(range(0, (count + 1) * period_ms, period_ms))
    angles = CubicSpline(signals.arrays["t"], signals.arrays["q"])(np.minimum(np.array(times_ms) / 1000.0, duration))
    return SetPoints(joints=signals.joints, times_ms=times_ms, angles=angles)


def to_naoqi(points: SetPoints) -> dict[str, Any]:
    """Return the arguments of ``ALMotion.angleInterpolation``: names, keys [rad] and times [s], in absolute angles."""
    names = [name for name in points.joints if name not in COUPLED]
    times = [round(APPROACH_S + time / 1000.0, 3) for time in points.times_ms]
    keys = [points.angles[:, points.joints.index(name)].tolist() for name in names]
    return {"names": names, "keys": keys, "times": [times for _ in names], "isAbsolute": True}


def write_motion(path: Path, points: SetPoints) -> None:
    """Write set-points as a `.motion` file, after reading the text back; raises InputError and OutputError."""
    text = format_motion(points)
    parse_motion(text, path.name)
    write_text(path, text)


def format_motion(points: SetPoints) -> str:
    """Return the content of a `.motion` file."""
    lines = [",".join((HEADER, VERSION, *points.joints))]
    for number, (time, row) in enumerate(zip(points.times_ms, points.angles.tolist(), strict=True), start=1):
        values = (UNTOUCHED if math.isnan(value) else f"{value:.9f}" for value in row)
        seconds, milliseconds = divmod(time, 1000)
        lines.append(f"{seconds // 60:02d}:{seconds % 60:02d}:{milliseconds:03d},Pose{number},{','.join(values)}")
    return "\n".join(lines) + "\n"


def read_motion(path: Path, motors: Collection[str] | None = None) -> SetPoints:
    """Read the set-points of a `.motion` file for the motors of a robot (None: any); raises InputError with the line."""
    return parse_motion(read_text(path, "motion"), path.name, motors)


def parse_motion(text: str, name: str, motors: Collection[str] | None = None) -> SetPoints:
    """Parse the content of a `.motion` file; ``name`` is for messages. Raises as ``read_motion``."""
    lines = [line.removesuffix("\r") for line in text.split("\n")]
    joints = _parse_header(lines[0], f"motion {name!r}, line 1", motors)
    times: list[int] = []
    rows: list[list[float]] = []
    for number, line in enumerate(lines[1:], start=2):
        if not line.strip():
            break
        where = f"motion {name!r}, line {number}"
        if len(line) >= LONGEST_LINE:
            raise InputError(f"{where}: {len(line)} characters; Webots' parser needs fewer than {LONGEST_LINE}")
        time, *rest = line.split(",")
        times.append(_parse_time(time, where, times[-1] if times else -1))
        if not rest or not rest[0].strip():
            raise InputError(f"{where}: the pose has no name")
        values = rest[1:]
        if len(values) != len(joints):
            raise InputError(f"{where}: {len(values)} values for {len(joints)} motors")
        rows.append([_parse_angle(value, joint, where) for value, joint in zip(values, joints, strict=True)])
    if not rows:
        raise InputError(f"motion {name!r} has no pose")
    return SetPoints(joints=joints, times_ms=tuple(times), angles=np.array(rows))


def _parse_header(line: str, where: str, motors: Collection[str] | None) -> tuple[str, ...]:
    fields = line.split(",")
    joints = fields[2:]
    if fields[:2] != [HEADER, VERSION]:
        raise InputError(f"{where}: must begin with {HEADER},{VERSION}, got {line[:40]!r}")
    if len(line) >= LONGEST_LINE:
        raise InputError(f"{where}: {len(line)} characters; Webots' parser needs fewer than {LONGEST_LINE}")
    if not joints or not all(joint.strip() for joint in joints):
        raise InputError(f"{where}: a motor has no name")
    for joint in joints:
        if joints.count(joint) > 1:
            raise InputError(f"{where}: motor {joint!r} appears twice")
        if motors is not None and joint not in motors:
            raise InputError(f"{where}: the robot has no motor {joint!r}")
    return tuple(joints)


def _parse_time(text: str, where: str, last: int) -> int:
    match = _TIME.fullmatch(text)
    if match is None:
        raise InputError(f"{where}: expected a time [[MM:]SS:]mmm, got {text!r}")
    minutes, seconds, milliseconds = (int(part or 0) for part in match.groups())
    time = minutes * 60_000 + seconds * 1000 + milliseconds
    if time <= last:
        raise InputError(f"{where}: time {time} ms is not after {last} ms")
    return time


def _parse_angle(text: str, joint: str, where: str) -> float:
    if text == UNTOUCHED:
        return math.nan
    if _NUMBER.fullmatch(text) is None or not math.isfinite(float(text)):
        raise InputError(f"{where}: expected an angle of {joint} in radians or {UNTOUCHED}, got {text!r}")
    return float(text)


def read_joint_angles(path: Path, robot: Robot) -> JointAngles:
    """Read angles over time of a robot's joints from a ``.motion`` file of Webots or CSV; raises InputError, UnknownNameError.

    CSV has a column of times [s] and one of angles for each joint: ``t``, ``LKneePitch``, or ``LKneePitch_deg``; other columns
    of ``nlp-gait export --format csv`` are ignored.
    """
    if path.suffix == ".motion":
        points = read_motion(path, robot.joints)
        known = [k for k, column in enumerate(points.angles.T) if not np.isnan(column).all()]
        joints = tuple(points.joints[k] for k in known)
        t = np.array(points.times_ms) / 1000.0
        return JointAngles(owner=f"motion {str(path)!r}", joints=joints, t=t, q=points.angles[:, known])
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
