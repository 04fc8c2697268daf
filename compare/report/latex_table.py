"""Tables of solvers for papers, in LaTeX with the package booktabs."""

from __future__ import annotations

import math
from statistics import mean, stdev

from compare.analysis.comparison import Comparison
from compare.analysis.solver_table import summarise
from compare.analysis.units import heading, join_words, with_unit
from compare.analysis.verdict import SIGNIFICANT, compare_pairs, find_leaders
from nlp_gait.files import make_file_name

HEADER = ("solver", "feasible", "best", "median", "mean", "std.", "worst", "gap", "$p$")
SPECIAL = str.maketrans(
    {c: rf"\{c}" for c in "&%$#_{}"} | {"~": r"\textasciitilde{}", "^": r"\^{}", "\\": r"\textbackslash{}"}
)
UNKNOWN = "--"


def format_latex_table(comparison: Comparison) -> str:
    """Return the table of one problem: a row for each solver, the best median over all runs first."""
    leader = comparison.solvers[0].name
    p_values = {pair.second: pair.rank_sum for pair in compare_pairs(comparison) if pair.first == leader}
    best = find_leaders(comparison)
    lines = [" & ".join(HEADER) + r" \\"]
    for solver, summary in zip(comparison.solvers, summarise(comparison), strict=True):
        values = [comparison.value(cost) for cost in solver.feasible]
        deviation = stdev(values) if len(values) > 1 else None
        numbers = (summary.best, summary.median, mean(values) if values else None, deviation, summary.worst)
        cells = [_format_number(number) for number in numbers]
        if solver.name in best and values:
            cells[1] = rf"\textbf{{{cells[1]}}}"
        p, gap = p_values.get(solver.name), escape_latex(comparison.format_gap(summary.gap))
        shown_p = UNKNOWN if p is None else "$<$0.001" if p < 0.001 else f"{p:.3f}"
        row = (escape_latex(solver.name), f"{summary.feasible}/{summary.runs}", *cells, gap, shown_p)
        lines.append(" & ".join(row) + r" \\")
    return "\n".join(
        [
            r"\begin{table}",
            r"\centering\small\setlength{\tabcolsep}{4pt}",
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


def escape_latex(text: str) -> str:
    """Return a text with LaTeX's special characters escaped."""
    return text.translate(SPECIAL)


def describe_runs(comparison: Comparison) -> str:
    """Return for example "n = 20 runs of each solver, at most 10,000 evaluations of a search"."""
    runs = sorted({len(solver.records) for solver in comparison.solvers})
    stops = [record.definition.get("stop") or {} for record in comparison.records]
    budgets = sorted({stop["evaluations"] for stop in stops if "evaluations" in stop})
    count = " to ".join(map(str, dict.fromkeys((runs[0], runs[-1]))))
    budget = f", at most {join_words(f'{each:,}' for each in budgets)} evaluations of a search" if budgets else ""
    return f"n = {count} runs of each solver{budget}"


def _write_caption(comparison: Comparison) -> str:
    objective = comparison.objective
    gap = "No feasible point is known"
    if math.isfinite(comparison.reference):
        best_known = with_unit(comparison.reference, objective.unit)
        gap = f"Gap: distance of the median from the best known value, {best_known} ({comparison.known.source})"
    sentences = [
        f"{heading(objective.name, objective.unit)} on {comparison.problem}, to be {objective.sense}d: "
        f"{describe_runs(comparison)}",
        "Best to gap are over the feasible runs",
        gap,
        "p: two-sided rank-sum test over all runs against the first solver, Holm-corrected over all pairs",
        f"Bold: the first solver and those that do not differ from it at {SIGNIFICANT:g}",
    ]
    return ". ".join(map(escape_latex, sentences)) + "."


def _format_number(value: float | None) -> str:
    """Format a number with a true minus sign."""
    if value is None:
        return UNKNOWN
    text = f"{value:.4f}" if abs(value) < 1e6 else f"{value:.4e}"
    return text.replace("-", "$-$", 1) if text.startswith("-") else text
