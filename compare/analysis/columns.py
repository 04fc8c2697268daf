"""Columns of the tables of solvers: a statistic is one entry, with the function that computes it and its format."""

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from statistics import median
from typing import Any

from compare.analysis.comparison import Comparison, SolverRuns
from compare.analysis.record_statistics import TARGETS
from compare.analysis.units import format_number, with_unit

FORMATS: dict[str, Callable[[Any, Comparison, SolverRuns], str]] = {
    "count": lambda value, comparison, solver: format_count(value),
    "share": lambda value, comparison, solver: f"{value}/{len(solver.records)}",
    "gap": lambda value, comparison, solver: comparison.format_gap(value),
    "objective": lambda value, comparison, solver: with_unit(value, comparison.objective.unit),
}


@dataclass(frozen=True)
class Column:
    """A statistic of the runs of a solver on a problem."""

    title: str
    function: Callable[[Comparison, SolverRuns], Any]  #: returns None for an unknown value
    format: str  #: an entry of ``FORMATS``, or a format of numbers such as ``".3f"``

    @property
    def key(self) -> str:
        """Name in JSON: ``time_s`` for ``time [s]``."""
        return re.sub(r"\W+", "_", self.title).strip("_")

    def format_cell(self, comparison: Comparison, solver: SolverRuns) -> str:
        """Return the value as text; a dash for an unknown or infinite one."""
        value = self.function(comparison, solver)
        if value is None or (isinstance(value, float) and not math.isfinite(value)):
            return "-"
        if self.format in FORMATS:
            return FORMATS[self.format](value, comparison, solver)
        return format_number(value, self.format)


def format_count(number: float) -> str:
    """Format a number of evaluations; a dash if it is infinite or unknown."""
    return f"{number:,.0f}".replace(",", "\u202f") if math.isfinite(number) else "-"


def count_reported_feasible(comparison: Comparison, solver: SolverRuns) -> int | None:
    """Return the number of runs whose solver reports a feasible result; None for imported results that report nothing."""
    if all(r.inputs.imported and r.reported_objective is None for r in solver.records):
        return None
    return sum(r.reported_feasible for r in solver.records)


def count_dense_feasible(comparison: Comparison, solver: SolverRuns) -> int | None:
    """Return the number of runs that are feasible between the samples, too; None without a dense grid."""
    dense = [r.feasible_between_samples for r in solver.records]
    return None if all(value is None for value in dense) else sum(value is True for value in dense)


def find_best_reported(comparison: Comparison, solver: SolverRuns) -> float | None:
    """Return the best objective that a run reports as feasible."""
    sign = comparison.objective.sign
    reported = [
        sign * r.reported_objective for r in solver.records if r.reported_feasible and r.reported_objective is not None
    ]
    return sign * min(reported) if reported else None


def compute_of_feasible(
    statistic: Callable[[list[float]], float], comparison: Comparison, solver: SolverRuns
) -> float | None:
    """Return a statistic of the objectives of the feasible runs."""
    return comparison.value(statistic(solver.feasible)) if solver.feasible else None


def compute_of_records(
    statistic: Callable[[list[float]], float], name: str, comparison: Comparison, solver: SolverRuns
) -> float:
    """Return a statistic of a time of the runs with a result [s]; NaN if one is unknown, or there are none."""
    times = [getattr(r.time_s, name) for r in solver.records if r.x]
    return math.nan if not times or any(map(math.isnan, times)) else statistic(times)


def compute_median_evaluations(comparison: Comparison, solver: SolverRuns) -> float:
    """Return the median equivalent evaluations of the runs with a result; NaN if those of one are unknown, or without any."""
    counts = [curve.total_cost() for curve, record in zip(solver.curves, solver.records, strict=True) if record.x]
    return math.nan if not counts or any(map(math.isnan, counts)) else median(counts)


def _make_cost_columns(axis: str, title: str, form: str) -> tuple[Column, ...]:
    return tuple(
        Column(f"{title} to {100 * t:g} %", lambda _, solver, t=t: solver.expected_cost(t, axis), form)  # type: ignore[misc]
        for t in TARGETS
    )


def count_within(target: float, comparison: Comparison, solver: SolverRuns) -> int:
    """Return the number of runs that end within a gap."""
    return comparison.count_reached(solver, target)


RUNS = Column("runs", lambda _, solver: len(solver.records), "d")
FEASIBLE = Column("feasible", lambda _, solver: len(solver.feasible), "share")
MEDIAN_GAP = Column("median gap", lambda comparison, solver: comparison.gap(solver.median_cost), "gap")
BEST_GAP = Column("best gap", lambda comparison, solver: comparison.gap(min(solver.costs)), "gap")
WITHIN = Column("within 1 %", partial(count_within, TARGETS[0]), "share")
EVALUATIONS = Column("median evaluations", compute_median_evaluations, "count")
TIME = Column("median time [s]", partial(compute_of_records, median, "solve"), ".3g")
# On the first screen of a report.
MAIN = (RUNS, FEASIBLE, MEDIAN_GAP, BEST_GAP, WITHIN, EVALUATIONS, TIME)
# In a terminal of 80 columns, where headings are short; evaluations and time are medians, too.
PRINTED = (FEASIBLE, MEDIAN_GAP, WITHIN, replace(EVALUATIONS, title="evaluations"), replace(TIME, title="time [s]"))
# Expected running time: cost of all runs until the target, divided by the number that reached it; infinite if none did.
EVALUATIONS_TO = _make_cost_columns("evaluations", "evaluations", "count")
SECONDS_TO = _make_cost_columns("seconds", "seconds", ".3g")
# What the solvers report, and what the judge finds with the exact functions.
JUDGEMENT = (
    RUNS,
    Column("reported feasible", count_reported_feasible, "share"),
    FEASIBLE,
    Column("feasible between samples", count_dense_feasible, "share"),
    Column("best reported", find_best_reported, "objective"),
    Column("best", partial(compute_of_feasible, min), "objective"),
    Column("median", partial(compute_of_feasible, median), "objective"),
    Column("worst", partial(compute_of_feasible, max), "objective"),
)
EFFORT = (
    EVALUATIONS,
    Column("build [s]", partial(compute_of_records, max, "build"), ".2f"),
    Column("compile [s]", partial(compute_of_records, max, "compile"), ".2f"),
    TIME,
)
ALL = tuple(dict.fromkeys((*JUDGEMENT, *MAIN, *EFFORT, *EVALUATIONS_TO, *SECONDS_TO)))


def summarise(comparison: Comparison, columns: Sequence[Column] = ALL) -> list[dict[str, Any]]:
    """Return the values of all columns by key, for each solver, the best median first."""
    return [
        {"solver": solver.name, **{column.key: column.function(comparison, solver) for column in columns}}
        for solver in comparison.solvers
    ]


def format_rows(
    comparison: Comparison, columns: Sequence[Column] = MAIN
) -> tuple[tuple[str, ...], list[tuple[str, ...]]]:
    """Return header and rows of text, a row for each solver; a column in which nothing is known is left out."""
    cells = {c.title: [c.format_cell(comparison, solver) for solver in comparison.solvers] for c in columns}
    nonempty = {title: texts for title, texts in cells.items() if set(texts) != {"-"}}
    names = [solver.title for solver in comparison.solvers]
    return ("solver", *nonempty), list(zip(names, *nonempty.values(), strict=True))
