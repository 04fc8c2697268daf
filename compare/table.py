"""The table of solvers: claims of all runs, as the judge finds them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from compare.convergence import best_known
from compare.record import RunRecord
from nlp_gait.problems.gait_problem import Objective

HEADER = ("solver", "runs", "feasible", "best", "median", "worst", "median gap", "evaluations", "time a run")


@dataclass(frozen=True, kw_only=True)
class SolverSummary:
    """All runs of one solver on one problem.

    Attributes:
        algorithm: name.
        runs: how many.
        feasible: how many end feasible, by the judge.
        best: judge's objective over the feasible runs, in the problem's sense; None if there is none; likewise
            ``median`` and ``worst``.
        gap: relative distance of the median from the best known objective.
        evaluations: median number of calls of f.
        time_s: median wall time of a run [s].
    """

    algorithm: str
    runs: int
    feasible: int
    best: float | None
    median: float | None
    worst: float | None
    gap: float | None
    evaluations: int
    time_s: float


def summarise(records: Sequence[RunRecord], objective: Objective) -> list[SolverSummary]:
    """One summary for each solver of one problem, in the order of the records."""
    reference = best_known(records, objective)
    summaries = []
    for name in dict.fromkeys(record.algorithm for record in records):
        runs = [record for record in records if record.algorithm == name]
        costs = np.sort([objective.sign * r.verdict.objective for r in runs if r.verdict.feasible])
        values = [float(objective.sign * v) for v in (costs[0], np.median(costs), costs[-1])] if len(costs) else None
        summaries.append(
            SolverSummary(
                algorithm=name,
                runs=len(runs),
                feasible=len(costs),
                best=values[0] if values else None,
                median=values[1] if values else None,
                worst=values[2] if values else None,
                gap=objective.sign * (values[1] - reference) / abs(reference) if values and reference else None,
                evaluations=int(np.median([r.evaluations["f"] for r in runs])),
                time_s=float(np.median([r.time_s["solve"] for r in runs])),
            )
        )
    return summaries


def cells(summary: SolverSummary, objective: Objective) -> tuple[str, ...]:
    """One row of text under ``HEADER``."""
    unit = "" if objective.unit == "1" else f" {objective.unit}"

    def value(v: float | None) -> str:
        return "-" if v is None else f"{v:.6f}{unit}"

    return (
        summary.algorithm,
        str(summary.runs),
        f"{summary.feasible}/{summary.runs}",
        value(summary.best),
        value(summary.median),
        value(summary.worst),
        "-" if summary.gap is None else f"{100 * summary.gap:.4f} %",
        f"{summary.evaluations}",
        f"{summary.time_s:.3f} s",
    )


def markdown(header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    """Markdown table; the first column is left-aligned, the others right."""
    rule = [":--", *["--:"] * (len(header) - 1)]
    return "\n".join("| " + " | ".join(row) + " |" for row in (header, rule, *rows)) + "\n"
