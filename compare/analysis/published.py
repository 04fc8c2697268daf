"""Values that papers report for problems of this package, to stand beside a study's own."""

from __future__ import annotations

import json
import math
from collections.abc import Mapping
from functools import cache
from importlib.resources import files
from typing import Any

from compare.analysis.comparison import Comparison

FILE = "published.json"


@cache
def published() -> Mapping[str, Any]:
    """By problem: ``note``, and ``rows`` with ``source`` and ``indexes`` by name."""
    found: Mapping[str, Any] = json.loads(files("compare.analysis").joinpath(FILE).read_text(encoding="utf-8"))[
        "problems"
    ]
    return found


def published_rows(comparison: Comparison) -> tuple[tuple[str, ...], list[tuple[str, ...]], str] | None:
    """Header, rows and note: the paper's values, then the best run of each solver; None if nothing was published.

    Only a problem at its published setting counts: default options and parameters are not known from records, so the
    settings that differ are in the records' definitions and shown with the machine's data.
    """
    record = comparison.reference_holder
    if record is None:
        return None
    problem = str(record.definition.get("problem", {}).get("name"))
    entry = published().get(problem)
    if entry is None or record.definition["problem"].get("parameters"):
        return None
    names = list(entry["rows"][0]["indexes"])
    rows = [(row["source"], *(_number(row["indexes"].get(name)) for name in names)) for row in entry["rows"]]
    for solver in comparison.solvers:
        best = solver.best
        if best is not None:
            rows.append((f"ours, best of {solver.name}", *(_number(best.verdict.indexes.get(name)) for name in names)))
    return ("source", *names), rows, str(entry["note"])


def _number(value: float | None) -> str:
    return "-" if value is None or not math.isfinite(value) else f"{value:.4f}"
