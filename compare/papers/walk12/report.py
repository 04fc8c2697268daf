"""Report of the reproduced 12-joint walk: the text is ``walk12_report.md``, with every number filled in from the findings."""

from __future__ import annotations

import math
from collections.abc import Iterable
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np

from compare.papers.walk12.paper import F1MAX, TABLE_3, row_of
from compare.papers.walk12.runs import GA_EVALUATIONS, PSO_EVALUATIONS, RUNS, STARTS, Run
from compare.papers.walk12.tables import MODEL, PAPER, Findings, f_of_papers_gaits, gaits, table_3, table_4
from nlp_gait.files import write_text

PRINTED_DIGIT = 5e-5  # a difference below this is rounding
PLATEAU_M = 1e-4  # a step length this close to its bound is on a plateau


def write_report(folder: Path, findings: Findings) -> None:
    """Write all tables and ``report.md``."""
    template = (resources.files("compare.papers.walk12") / "report.md").read_text(encoding="utf-8")
    tables = {
        "table_3_paper": table_3(folder, findings, PAPER),
        "table_3_model": table_3(folder, findings, MODEL),
        "gaits": gaits(folder, findings),
        "table_4": table_4(folder, findings),
    }
    values = {**tables, **_settings(), **_normalisation(findings), **_tradeoff(findings), **_errata(findings)}
    text = template.format_map({name: v.strip() if isinstance(v, str) else v for name, v in values.items()})
    write_text(folder / "report.md", text)


def _settings() -> dict[str, int]:
    return {"ga_evaluations": GA_EVALUATIONS, "pso_evaluations": PSO_EVALUATIONS, "runs": RUNS, "starts": STARTS}


def _normalisation(findings: Findings) -> dict[str, Any]:
    most_stable = findings.runs(PAPER, 1.0)
    gaps = {row.weight: row.f - run["f"] for row, run in zip(TABLE_3, _ipopt(findings, MODEL), strict=True)}
    leads = {
        f"lead_{label}": _range(
            run["dense"]["f"] - f
            for run, f in zip(_ipopt(findings, label), f_of_papers_gaits(findings, label), strict=True)
        )
        for label in (PAPER, MODEL)
    }
    return {
        **leads,
        "own_f1max": findings.own_f1max,
        "dense_f1max": most_stable["ipopt"]["dense"]["f1_per_m2s"],
        "ga_f1": (most_stable["ga"]["worst"] * F1MAX, most_stable["ga"]["best"] * F1MAX),
        "printed_above": ", ".join(f"{w:g} (by {gap:.4f})" for w, gap in gaps.items() if gap > PRINTED_DIGIT),
    }


def _ipopt(findings: Findings, label: str) -> list[Run]:
    return [runs["ipopt"] for runs in findings.table_3[label]]


def _tradeoff(findings: Findings) -> dict[str, Any]:
    lengths = {run["weight"]: run["x"][0] for run in findings.weighted}
    longest = max(weight for weight, s in lengths.items() if s > 0.13 - PLATEAU_M)
    shortest = min(weight for weight, s in lengths.items() if s < 0.05 + PLATEAU_M)
    s, Q = (np.array([run[name] for run in findings.front]) for name in ("step_length_m", "Q_m2s"))
    rise = (1 / Q[:-1] - 1 / Q[-1]) / (s[-1] - s[:-1])  # of f1, from the longest step to each shorter one
    return {
        "plateaus": (longest, shortest),
        "tangent_mm": 1e3 * s[int(np.argmax(rise))],
        "sweep_iterations": int(np.median([run["iterations"] for run in findings.weighted])),
    }


def _errata(findings: Findings) -> dict[str, Any]:
    errata = findings.errata
    exact = np.array(errata["f1"]["exact"])
    changes = {reading: _range(100 * (np.array(f1) / exact - 1)) for reading, f1 in errata["f1"].items()}
    seconds = [run for run in findings.table_4 if run["horizon"] == "1s"]
    return {
        "f1_change": {reading: f"{low:+.2f} % to {high:+.2f} %" for reading, (low, high) in changes.items()},
        "free": [run["f"] for run in errata["moment_free_optimum"]],
        "hip_miss_mm": 1e3 * errata["hip_miss_m"],
        "corner_slopes": errata["corner_slopes"],
        "corner_start": errata["corner_start"],
        "lateral_jump": math.pi * row_of(0.15).x[1],
        "stable": errata["stable"][-1],
        "horizon_gap": _range(100 * abs(run["paper_f1"] / run["implied_f1"] - 1) for run in seconds),
    }


def _range(values: Iterable[float]) -> tuple[float, float]:
    known = [float(value) for value in values]
    return min(known), max(known)
