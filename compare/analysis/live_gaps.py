"""The gaps of a running study, from the runs that have ended so far."""

import math
from collections.abc import Sequence
from statistics import median

from compare.analysis.best_known import compute_gap
from compare.analysis.comparison import SMALLEST_GAP
from compare.analysis.record_statistics import find_best_known
from compare.analysis.units import format_percent
from compare.study.record import RunRecord
from compare.study.references import find_reference


class LiveGaps:
    """Median gap of each solver's finished runs, by problem."""

    def __init__(self) -> None:
        self._records: dict[str, list[RunRecord]] = {}
        self._known: dict[str, float | None] = {}  # best known objectives by problem

    def add(self, record: RunRecord) -> str:
        """Take a finished run, and return a line for each problem: ``nao-ssp: ipopt 0.0000 % (20), pso 0.33 % (7)``."""
        self._records.setdefault(record.problem, []).append(record)
        if record.problem not in self._known:
            self._known[record.problem] = find_reference(record.inputs.problem).objective
        lines = ((problem, _list_gaps(runs, self._known[problem])) for problem, runs in self._records.items())
        return "\n".join(f"{problem}: {', '.join(gaps)}" for problem, gaps in lines)


def _list_gaps(records: Sequence[RunRecord], known: float | None) -> list[str]:
    objective = records[0].inputs.objective
    reference = find_best_known(records) if known is None else known
    gaps: dict[str, list[float]] = {}
    for record in records:
        value = record.verdict.objective if record.verdict.feasible else math.nan
        gaps.setdefault(record.solver, []).append(compute_gap(value, reference, objective))
    medians = sorted((median(values), solver) for solver, values in gaps.items())
    return [
        f"{solver} {format_percent(gap if gap >= SMALLEST_GAP else 0.0)} ({len(gaps[solver])})"
        for gap, solver in medians
    ]
