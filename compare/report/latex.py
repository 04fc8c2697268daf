"""Tables of a study for papers, in LaTeX with the package booktabs: one of each problem, and one of problems and solvers."""

import math
import re
from collections.abc import Sequence
from statistics import mean, median, stdev

from compare.analysis.comparison import Comparison, explain_marks, tabulate_problems
from compare.analysis.record_statistics import SIGNIFICANT
from compare.analysis.units import join_words, make_heading, with_unit
from nlp_gait.files import make_file_name
from nlp_gait.formulation.solution import FEASIBILITY_TOLERANCE

HEADER = ("solver", "feasible", "best", "median", "mean", "std.", "worst", "median gap", "$p$")
SPECIAL = str.maketrans(
    {c: rf"\{c}" for c in "&%$#_{}"} | {"~": r"\textasciitilde{}", "^": r"\^{}", "\\": r"\textbackslash{}", "<": "$<$"}
)
UNKNOWN = "--"
MARK = re.compile(r" ([-+=])$")
LEAST_DECIMALS, MOST_DECIMALS = 4, 10


def format_latex_table(comparison: Comparison) -> str:
    """Return the table of one problem: a row for each solver, the best median over all runs first.

    Objectives have as many decimals as different medians need to differ.
    """
    decimals = _choose_decimals(comparison)
    first = comparison.solvers[0]
    p_values = {pair.second: pair.rank_sum for pair in comparison.pairs if pair.first == first.name}
    is_best = bool(p_values) and all(p < SIGNIFICANT for p in p_values.values())
    rows = []
    for solver in comparison.solvers:
        values = sorted((comparison.value(cost) for cost in solver.feasible), reverse=comparison.objective.sign < 0)
        deviation = stdev(values) if len(values) > 1 else None
        numbers = (values[0], median(values), mean(values), deviation, values[-1]) if values else 5 * (None,)
        cells = [_format_number(number, decimals) for number in numbers]
        if solver is first and is_best and values:
            cells[1] = rf"\textbf{{{cells[1]}}}"
        p = p_values.get(solver.name)
        shown_p = UNKNOWN if p is None else "$<$0.001" if p < 0.001 else f"{p:.3f}"
        distance = comparison.gap(solver.median_cost)
        gap = escape_latex(comparison.format_gap(distance)) if math.isfinite(distance) else "infeasible"
        rows.append((escape_latex(solver.title), f"{len(values)}/{len(solver.records)}", *cells, gap, shown_p))
    return _format_table(_write_caption(comparison, is_best), make_file_name(comparison.problem), HEADER, rows)


def format_latex_overview(comparisons: Sequence[Comparison]) -> str:
    """Return the table of problems and solvers, see ``compare.analysis.comparison.tabulate_problems``."""
    subject, rows = tabulate_problems(comparisons)
    header, *body = [[MARK.sub(r" $\1$", escape_latex(cell)) for cell in row] for row in rows]
    return _format_table(escape_latex(explain_marks(subject)), "problems", header, body)


def _format_table(caption: str, label: str, header: Sequence[str], rows: Sequence[Sequence[str]]) -> str:
    head, *lines = [" & ".join(row) + r" \\" for row in (header, *rows)]
    body = "\n".join([r"\toprule", head, r"\midrule", *lines, r"\bottomrule"])
    return (
        "\\begin{table}\n\\centering\\small\\setlength{\\tabcolsep}{4pt}\n"
        f"\\caption{{{caption}}}\n\\label{{tab:{label}}}\n"
        f"\\begin{{tabular}}{{l{'r' * (len(header) - 1)}}}\n{body}\n\\end{{tabular}}\n\\end{{table}}\n"
    )


def _choose_decimals(comparison: Comparison) -> int:
    """Return the least number of decimals by which medians that differ beyond the judge's tolerance differ in print."""
    medians = sorted(solver.median_cost for solver in comparison.solvers if math.isfinite(solver.median_cost))
    steps = [b - a for a, b in zip(medians, medians[1:], strict=False)]
    least = min((s for s in steps if s > FEASIBILITY_TOLERANCE * abs(medians[0])), default=1.0)
    return min(max(math.ceil(-math.log10(least)), LEAST_DECIMALS), MOST_DECIMALS)


def escape_latex(text: str) -> str:
    """Return a text with LaTeX's special characters escaped."""
    return text.translate(SPECIAL)


def describe_run_counts(comparison: Comparison) -> str:
    """Return for example "20 runs of each solver, at most 10,000 evaluations of a search"."""
    runs = sorted({len(solver.records) for solver in comparison.solvers})
    budgets = sorted({record.inputs.evaluations for record in comparison.records if record.inputs.evaluations})
    count = " to ".join(map(str, dict.fromkeys((runs[0], runs[-1]))))
    budget = f", at most {join_words(f'{budget:,}' for budget in budgets)} evaluations of a search" if budgets else ""
    return f"{count} run{'s' * (runs[-1] > 1)} of each solver{budget}"


def _write_caption(comparison: Comparison, is_best: bool) -> str:
    objective = comparison.objective
    gap = "No feasible point is known"
    if math.isfinite(comparison.reference):
        best_known = with_unit(comparison.reference, objective.unit)
        gap = f"Median gap: distance of the median of all runs from {best_known} ({comparison.known.source})"
    sentences = [
        f"{make_heading(objective.name.replace('_', ' '), objective.unit)} on {comparison.problem}, to be {objective.sense}d: "
        f"{describe_run_counts(comparison)}",
        "Best to worst are over the feasible runs",
        gap,
        f"p: two-sided rank-sum test over all runs against {comparison.solvers[0].title}, Holm-corrected over all pairs",
        *([f"Bold: significantly better than all others at {SIGNIFICANT:g}"] if is_best else []),
    ]
    return ". ".join(map(escape_latex, sentences)) + "."


def _format_number(value: float | None, decimals: int) -> str:
    """Format a number with a true minus sign."""
    if value is None:
        return UNKNOWN
    text = f"{value:.{decimals}f}" if abs(value) < 1e6 else f"{value:.4e}"
    return text.replace("-", "$-$", 1) if text.startswith("-") else text
