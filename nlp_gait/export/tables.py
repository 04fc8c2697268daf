"""Time histories as CSV and JSON, each column with its unit."""

from __future__ import annotations

import csv
import io
import json
from collections.abc import Iterator
from pathlib import Path

from nlp_gait.export.files import write_text
from nlp_gait.export.result import Result
from nlp_gait.problems.gait_problem import Array, Signals

JOINT_UNITS = {"q": "rad", "qd": "rad/s", "qdd": "rad/s^2", "tau": "Nm"}
OTHER_UNITS = {"left_stance": "1", "stance_force": "N"}  # everything else is a point [m]
AXES, PLANAR_AXES = "xyz", "xz"
PLANAR = ("stance_force",)  # vectors in the sagittal plane


def columns(signals: Signals) -> Iterator[tuple[str, str, Array]]:
    """Name, unit and values (T,) of every column: time first, then joints and points by axis."""
    yield "t", "s", signals.arrays["t"]
    for name, array in signals.arrays.items():
        if name in JOINT_UNITS:
            for i, joint in enumerate(signals.joints):
                yield f"{name} {joint}", JOINT_UNITS[name], array[:, i]
        elif name != "t" and array.ndim == 1:
            yield name, OTHER_UNITS.get(name, "m"), array
        elif name != "t":
            axes = PLANAR_AXES if name in PLANAR else AXES
            for axis, column in zip(axes, array.T, strict=False):
                yield f"{name} {axis}", OTHER_UNITS.get(name, "m"), column


def write_csv(path: Path, signals: Signals) -> None:
    """One row a sample, a header like ``q LKneePitch [rad]``; raises OutputError."""
    table = list(columns(signals))
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(f"{name} [{unit}]" for name, unit, _ in table)
    writer.writerows(zip(*(values.tolist() for _, _, values in table), strict=True))
    write_text(path, text.getvalue())


def write_json(path: Path, result: Result, signals: Signals) -> None:
    """The gait with its problem and all columns by name, each with its unit; raises OutputError."""
    problem = result.problem
    data = {
        "problem": problem.name,
        "options": dict(problem.options),
        "parameters": dict(problem.values),
        "x": problem.by_name(result.x),
        "signals": {name: {"unit": unit, "values": values.tolist()} for name, unit, values in columns(signals)},
    }
    write_text(path, json.dumps(data, indent=1) + "\n")
