"""Tables of solvers for papers, in LaTeX with the package booktabs."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path
from statistics import mean, stdev

from compare.analysis.comparison import Comparison, SolverRuns
from compare.analysis.units import heading, join_words, with_unit
from compare.analysis.verdict import SIGNIFICANT, compare_pairs
from nlp_gait.files import make_file_name, write_text

HEADER = ("solver", "feasible", "best", "median", "mean", "std.", "worst", r"gap [\%]", "$p$")
SPECIAL = str.maketrans(
    {c: rf"\{c}" for c in "&%$#_{}"} | {"~": r"\textasciitilde{}", "^": r"\^{}", "\\": r"\textbackslash{}"}
)
UNKNOWN = "--"


def write_latex_tables(folder: Path, comparisons: Sequence[Comparison]) -> list[Path]:
    """Write ``<problem>-table.tex`` for each problem, and return the paths; raises OutputError."""
    paths = [folder / f"{make_file_name(comparison.problem)}-table.tex" for comparison in comparisons]
    for path, comparison in zip(paths, comparisons, strict=True):
        write_text(path, format_latex_table(comparison))
    return paths


def format_latex_table(comparison: Comparison) -> str:
    """Return the table of one problem: a row for each solver, the best median first."""
    leader = comparison.solvers[0]
    differences = {pair.second: pair.rank_sum for pair in compare_pairs(comparison) if pair.first == leader.name}
    rows = [_format_row(comparison, solver, leader, differences) for solver in comparison.solvers]
    lines = [" & ".join(row) + r" \\" for row in (HEADER, *rows)]
    return "\n".join(
        [
            r"\begin{table}",
            r"\centering",
            rf"\caption{{{_write_caption(comparison)}}}",
            rf"\label{{tab:{make_file_name(comparison.problem)}}}",
            rf"\begin{{tabular}}{{l{'r' * (len(HEADER) - 1)}}}",
            r"\toprule",
            lines[0],
            r"\midrule",
            *lines[1:],
            r"\bottomrule",
            r"\end{tabular}",
            r"\end{table}",
            "",
        ]
    )


def _format_row(
    comparison: Comparison, solver: SolverRuns, leader: SolverRuns, differences: dict[str, float]
) -> tuple[str, ...]:
    values = [comparison.value(cost) for cost in solver.feasible]
    known = bool(values)
    p = differences.get(solver.name)
    median = comparison.value(solver.median_cost)
    numbers = [
        values[0] if known else math.nan,
        median,
        mean(values) if known else math.nan,
        stdev(values) if len(values) > 1 else math.nan,
        values[-1] if known else math.nan,
    ]
    cells = [_format_number(number) for number in numbers]
    is_best = solver is leader or (p is not None and p >= SIGNIFICANT)
    if differences and is_best and math.isfinite(median):
        cells[1] = rf"\textbf{{{cells[1]}}}"
    gap = (
        comparison.gap(solver.median_cost)
        if math.isfinite(median) and math.isfinite(comparison.reference)
        else math.nan
    )
    return (
        solver.name.translate(SPECIAL),
        f"{len(values)}/{len(solver.records)}",
        *cells,
        _format_number(100.0 * gap, ".2f"),
        UNKNOWN if p is None else "$<$0.001" if p < 0.001 else f"{p:.3f}",
    )


def _write_caption(comparison: Comparison) -> str:
    objective, records = comparison.objective, comparison.records
    runs = sorted({len(solver.records) for solver in comparison.solvers})
    stops = [record.definition.get("stop") or {} for record in records]
    budgets = sorted({stop["evaluations"] for stop in stops if "evaluations" in stop})
    count = " to ".join(map(str, dict.fromkeys((runs[0], runs[-1]))))
    budget = f", at most {join_words(f'{each:,}' for each in budgets)} evaluations of a search" if budgets else ""
    gap = "No feasible point is known"
    if math.isfinite(comparison.reference):
        best_known = with_unit(comparison.reference, objective.unit)
        gap = f"Gap: distance of the median from the best known value, {best_known} ({comparison.known.source})"
    sentences = [
        f"{heading(objective.name, objective.unit)} on {comparison.problem}, to be {objective.sense}d: n = {count} runs of each "
        f"solver{budget}",
        "The median is over all runs, a dash if half of them are infeasible; the other columns are over the feasible ones",
        gap,
        "p: two-sided rank-sum test against the best median, Holm-corrected over all pairs of solvers",
        f"Bold: the best median and those that do not differ from it at {SIGNIFICANT:g}",
    ]
    return ". ".join(sentence.translate(SPECIAL) for sentence in sentences) + "."


def _format_number(value: float, digits: str = ".4f") -> str:
    """Format a number with a true minus sign."""
    if not math.isfinite(value):
        return UNKNOWN
    text = f"{value:{digits}}" if abs(value) < 1e6 else f"{value:.4e}"
    return text.replace("-", "$-$", 1) if text.startswith("-") else text
