"""Set-points of joint angles for a robot or a simulator: `.motion` files of Webots, and the arguments of NAOqi."""

from dataclasses import dataclass
from typing import Any

import numpy as np

from nlp_gait.errors import InputError
from nlp_gait.formulation import Array, Result, sample_finely
from nlp_gait.formulation.result import count_periods

PERIOD_MS = 40  # as in Gupta, Pratihar, Deb (2023), and Webots' worlds for NAO
APPROACH_S = 2.0  # from the robot's current pose to the first one: a key of NAOqi needs a time > 0
LONGEST_LINE = 4095  # characters with the line's end: size of the buffer of Webots' parser
COUPLED = ("RHipYawPitch",)  # both hip yaw-pitch joints are one motor, which NAOqi commands by the left one's name


@dataclass(frozen=True, kw_only=True, eq=False)
class SetPoints:
    """Poses of all joints."""

    joints: tuple[str, ...]
    times_ms: tuple[int, ...]  #: (T,) whole milliseconds, strictly increasing
    angles: Array  #: (T, J) [rad]


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


def format_motion(points: SetPoints) -> str:
    """Return the content of a `.motion` file of Webots; raises InputError if it cannot express the joints' names or number.

    The grammar is that of Webots' own parser (`src/controller/c/motion.c`): a header with the motors; then rows
    ``MM:SS:mmm,<pose name>,<radians>,...``, between which it interpolates linearly.
    """
    lines = [",".join(("#WEBOTS_MOTION", "V1.0", *points.joints))]
    if lines[0].count(",") != len(points.joints) + 1:
        raise InputError("joints of a .motion file must have names without commas; rename them in the robot's file")
    for number, (time, row) in enumerate(zip(points.times_ms, points.angles.tolist(), strict=True), start=1):
        seconds, milliseconds = divmod(time, 1000)
        values = ",".join(f"{value:.9f}" for value in row)
        lines.append(f"{seconds // 60:02d}:{seconds % 60:02d}:{milliseconds:03d},Pose{number},{values}")
    longest = max(map(len, lines))
    if longest >= LONGEST_LINE:
        raise InputError(
            f"a line of the .motion file has {longest} characters for {len(points.joints)} joints; Webots' parser needs fewer "
            f"than {LONGEST_LINE}: export as csv"
        )
    return "\n".join(lines) + "\n"
