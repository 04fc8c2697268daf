"""Arguments of NAOqi's ``ALMotion.angleInterpolation`` as JSON."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from nlp_gait.export.setpoints import SetPoints
from nlp_gait.files import write_json

APPROACH_S = 2.0  # to the first pose, from wherever the robot stands: a key needs a time after zero
# Both hip yaw-pitch joints are one motor, which NAOqi commands by the left one's name.
COUPLED = ("RHipYawPitch",)


def naoqi_arguments(points: SetPoints) -> dict[str, Any]:
    """Names, keys [rad] and times [s] of every joint that NAOqi commands, in absolute angles."""
    names = [name for name in points.joints if name not in COUPLED]
    times = [round(APPROACH_S + time / 1000.0, 3) for time in points.times_ms]
    keys = [points.angles[:, points.joints.index(name)].tolist() for name in names]
    return {"names": names, "keys": keys, "times": [times for _ in names], "isAbsolute": True}


def write_naoqi(path: Path, points: SetPoints) -> None:
    """Write the arguments to a JSON file; raises OutputError."""
    write_json(path, naoqi_arguments(points))
