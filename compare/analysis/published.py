"""A study next to known values: those that papers report, and points better than the shipped best ones, to be contributed."""

import json
import math
from collections.abc import Mapping, Sequence
from functools import cache
from importlib.resources import files
from pathlib import Path
from typing import Any

from compare.analysis.comparison import Comparison
from compare.judge import evaluate
from compare.study.record import load_gait
from nlp_gait.files import make_file_name, replace_nan, write_json

FILE = "published.json"


@cache
def load_published() -> Mapping[str, Any]:
    """Return by problem: ``note``, and ``rows`` with ``source`` and ``indexes`` by name."""
    found: Mapping[str, Any] = json.loads(files("compare.analysis").joinpath(FILE).read_text(encoding="utf-8"))[
        "problems"
    ]
    return found


def make_published_rows(comparison: Comparison) -> tuple[tuple[str, ...], list[tuple[str, ...]], str] | None:
    """Return header, rows and note: the paper's values, then each solver's best run; None without published values.

    Only problems with default parameters are compared.
    """
    record = comparison.best
    if record is None:
        return None
    problem = str(record.definition.get("problem", {}).get("name"))
    entry = load_published().get(problem)
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


def write_better_points(folder: Path, comparisons: Sequence[Comparison]) -> list[Path]:
    """Judge every run that is better than the best known value again, write it as a result, and return the files.

    A file ``better-<problem>.json`` can be read by every command that reads the result of ``solve --out``.
    """
    written = []
    for comparison in comparisons:
        run = comparison.better
        if run is None:
            continue
        gait = load_gait(run)
        evaluation = evaluate(gait.problem, gait.x)
        if evaluation.feasible and comparison.known.is_beaten_by(evaluation.objective["value"], comparison.objective):
            known = {"objective": comparison.reference, "source": comparison.known.source}
            found = {"solver": run.solver, "run": run.run, "seed": run.seed, "settings": run.settings}
            path = folder / f"better-{make_file_name(comparison.problem)}.json"
            write_json(path, replace_nan({**evaluation.to_json(), "found_by": found, "best_known_before": known}))
            written.append(path)
    return written
