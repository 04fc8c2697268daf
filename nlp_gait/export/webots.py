"""Reader and writer of Webots `.motion` files.

The grammar is that of Webots' own parser (`src/controller/c/motion.c`), and stricter where that guesses: a header
``#WEBOTS_MOTION,V1.0,<motor>,...``; then rows ``[[MM:]SS:]mmm,<pose name>,<radians or *>,...`` with strictly increasing times and
one value a motor; lines shorter than 4,096 characters; an empty line ends the file. Webots interpolates linearly between rows.
"""

import math
import re
from collections.abc import Collection
from pathlib import Path

import numpy as np

from nlp_gait.errors import InputError
from nlp_gait.export.set_points import SetPoints
from nlp_gait.files import read_text, write_text

HEADER, VERSION = "#WEBOTS_MOTION", "V1.0"
LONGEST_LINE = 4095  # characters with the line's end: size of the parser's buffer
UNTOUCHED = "*"
# Up to four digits of seconds: a longer motion is a damaged file, and would overflow the parser's integers.
_TIME = re.compile(r"(?:(?:(\d{1,4}):)?(\d{1,4}):)?(\d{1,7})", re.ASCII)
_NUMBER = re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?", re.ASCII)


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
