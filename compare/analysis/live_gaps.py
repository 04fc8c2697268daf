"""The gaps of a running study, from the runs that have ended so far."""

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
        self._records: dict[str, dict[str, list[RunRecord]]] = {}
        self._known: dict[str, float | None] = {}

    def add(self, record: RunRecord) -> str:
        """Take a finished run, and return a line for each problem: ``nao-ssp: ipopt 0.0000 % (20), pso 0.33 % (7)``."""
        self._records.setdefault(record.problem, {}).setdefault(record.solver, []).append(record)
        if record.problem not in self._known:
            self._known[record.problem] = find_reference(record.inputs.problem).objective
        return "\n".join(f"{problem}: {', '.join(self._list_gaps(problem))}" for problem in self._records)

    def _list_gaps(self, problem: str) -> list[str]:
        groups, known = self._records[problem], self._known[problem]
        records = [record for group in groups.values() for record in group]
        objective = records[0].inputs.objective
        reference = find_best_known(records, objective) if known is None else known
        gaps = {
            solver: median(
                compute_gap(r.verdict.objective if r.verdict.feasible else float("nan"), reference, objective)
                for r in group
            )
            for solver, group in groups.items()
        }
        return [
            f"{solver} {format_percent(gap if gap >= SMALLEST_GAP else 0.0)} ({len(groups[solver])})"
            for solver, gap in sorted(gaps.items(), key=lambda item: item[1])
        ]
