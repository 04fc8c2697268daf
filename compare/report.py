"""Files of a comparison: table and convergence picture, from records only."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from compare.convergence import convergence_figure
from compare.figures import save
from compare.record import RunRecord
from compare.storage import write_text
from compare.table import HEADER, cells, markdown, summarise
from nlp_gait.problems.gait_problem import Objective


def write_report(folder: Path, problem: str, records: Sequence[RunRecord], objective: Objective) -> list[Path]:
    """Write ``<problem>.md`` and ``<problem>-convergence.png`` and ``.svg``; returns their paths."""
    rows = [cells(summary, objective) for summary in summarise(records, objective)]
    figure = folder / f"{problem}-convergence"
    report = folder / f"{problem}.md"
    failed = [f"- {r.algorithm}, run {r.run}: {r.status}" for r in records if not r.verdict.feasible]
    between = [
        f"- {r.algorithm}, run {r.run}: {'; '.join(r.verdict.violated)}"
        for r in records
        if r.verdict.feasible and r.verdict.dense_feasible is False
    ]
    text = [
        f"# {problem}: {objective.name} [{objective.unit}], to {objective.sense}",
        "Every value is the judge's: the exact functions at the reported point, on the problem's own samples. "
        "The gap is that of the median to the best feasible value known here.",
        markdown(HEADER, rows),
        f"![Best so far against evaluations]({figure.name}.png)",
    ]
    if failed:
        text += ["## Runs that ended infeasible", "\n".join(failed)]
    if between:
        text += ["## Feasible on their own samples, violated between them", "\n".join(between)]
    write_text(report, "\n\n".join(text) + "\n")
    return [report, *save(convergence_figure(records, objective), figure)]
