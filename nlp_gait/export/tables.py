"""Time histories as CSV and JSON, each column with its unit."""

from __future__ import annotations

import json
from collections.abc import Iterator
from pathlib import Path

from nlp_gait.errors import InputError
from nlp_gait.files import csv_text, write_text
from nlp_gait.problem.gait_problem import Array, Signals
from nlp_gait.problem.result import SCHEMA, Result
from nlp_gait.problems.stairs.formulas.loads import MOVING

# Units of arrays with a column for each joint, and for each moving link of the stair climber.
JOINT_UNITS = {
    "q": "rad",
    "qd": "rad/s",
    "qdd": "rad/s^2",
    "tau": "Nm",
    "power": "W",
    "q_desired": "rad",
    "qd_desired": "rad/s",
}
LINK_UNITS = {"link_q": "rad", "link_qd": "rad/s", "link_qdd": "rad/s^2"}
# Vectors: unit, and axes by the number of columns; two are x and y on the ground, or x and z in the sagittal plane.
GROUND, PLANE = ("x", "y"), ("x", "z")
VECTORS = {
    **{name: ("m", GROUND) for name in ("zmp", "zmp_foot")},
    **{name: ("m", PLANE) for name in ("hip", "ankle", "waist", "com", "stance_pressure")},
    **{f"{side}_{part}": ("m", PLANE) for side in ("left", "right") for part in ("foot", "ankle")},
    "stance_force": ("N", PLANE),
}
OTHERS = {"left_stance": ("1", ("",)), "reach": ("1", ("swing knee", "stance knee"))}


def columns(signals: Signals) -> Iterator[tuple[str, str, Array]]:
    """Name, unit and values (T,) of every column, time first.

    Raises:
        InputError: an array whose unit is not known here.
    """
    yield "t", "s", signals.arrays["t"]
    for name, array in signals.arrays.items():
        if name == "t":
            continue
        table = array[:, None] if array.ndim == 1 else array
        unit, labels = _unit_and_labels(name, table.shape[1], signals.joints)
        for label, column in zip(labels, table.T, strict=True):
            yield f"{name} {label}".strip(), unit, column


def _unit_and_labels(name: str, count: int, joints: tuple[str, ...]) -> tuple[str, tuple[str, ...]]:
    """Unit and names of an array's columns."""
    if name in JOINT_UNITS:
        return JOINT_UNITS[name], joints
    if name in LINK_UNITS:
        return LINK_UNITS[name], MOVING
    if name in OTHERS:
        return OTHERS[name]
    if name not in VECTORS:
        raise InputError(f"time history {name!r} cannot be exported, for its unit is not known")
    unit, plane = VECTORS[name]
    return unit, ("x", "y", "z") if count == 3 else plane[:count]


def write_csv(path: Path, signals: Signals) -> None:
    """One row a sample, a header like ``q LKneePitch [rad]``; raises InputError, OutputError."""
    table = list(columns(signals))
    header = [f"{name} [{unit}]" for name, unit, _ in table]
    write_text(path, csv_text([header, *zip(*(values.tolist() for _, _, values in table), strict=True)]))


def write_json(path: Path, result: Result, signals: Signals) -> None:
    """The gait with its problem and all columns by name, each with its unit; raises InputError, OutputError."""
    problem = result.problem
    data = {
        "schema": SCHEMA,
        "problem": problem.name,
        "options": dict(problem.options),
        "parameters": dict(problem.values),
        "x": problem.by_name(result.x),
        "signals": {name: {"unit": unit, "values": values.tolist()} for name, unit, values in columns(signals)},
    }
    write_text(path, json.dumps(data, indent=1) + "\n")
