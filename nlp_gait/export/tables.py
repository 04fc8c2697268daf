"""Time histories as CSV and JSON, each column with its unit, and as a NumPy archive."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np

from nlp_gait.files import format_csv, replace_file, write_text
from nlp_gait.formulation import Result, Signals
from nlp_gait.formulation.result import SCHEMA


def write_csv(path: Path, signals: Signals) -> None:
    """One row a sample, a header like ``q LKneePitch [rad]``; raises InputError, OutputError."""
    table = list(signals.named_columns())
    header = [f"{name} [{unit}]" for name, unit, _ in table]
    write_text(path, format_csv([header, *zip(*(values.tolist() for _, _, values in table), strict=True)]))


def write_json(path: Path, result: Result, signals: Signals) -> None:
    """The gait with its problem and all columns by name, each with its unit; raises InputError, OutputError."""
    problem = result.problem
    data = {
        "schema": SCHEMA,
        "problem": problem.address,
        "options": dict(problem.options),
        "parameters": dict(problem.values),
        "x": problem.by_name(result.x),
        "signals": {name: {"unit": unit, "values": values.tolist()} for name, unit, values in signals.named_columns()},
    }
    write_text(path, json.dumps(data, indent=1) + "\n")


def write_npz(path: Path, signals: Signals) -> None:
    """All arrays and the joint names (columns of q, qd, qdd and tau) in one ``.npz`` file; raises OutputError."""
    with replace_file(path) as temporary, open(temporary, "wb") as file:
        np.savez(file, allow_pickle=False, joints=np.array(signals.joints), **signals.arrays)
