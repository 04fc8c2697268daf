"""Files of a study for other programs and papers: CSV, LaTeX tables with booktabs, figures as PDF."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from statistics import mean, median, stdev

from compare.analysis.comparison import Comparison
from compare.analysis.pairs import SIGNIFICANT
from compare.analysis.record_statistics import TARGETS
from compare.analysis.units import join_words, make_heading, with_unit
from compare.drawing.charts import plot_charts
from compare.drawing.figures import save_figure, use_paper_style
from compare.report.document import Document, Figure, iterate_leaves
from compare.report.problem_section import FIGURES
from compare.study.record import HEADER, JUDGED, make_judged_cells, make_row
from nlp_gait.files import format_csv, make_file_name, replace_nan, write_text

TableRows = Sequence[Sequence[object]]
"""Header and rows; None for an unknown value."""

MEASURED = ("n", "budget", "gap", "equivalent_evaluations")
COSTS = ("evaluations", "seconds")


@dataclass(frozen=True, kw_only=True)
class FurtherFiles:
    """Which files to write beside a study's report."""

    csv: bool = False  #: all runs, and the points of each problem; written again, too, where they exist already
    latex: bool = False  #: a table of each problem
    #: figures of the report as PNG, and those of each problem one column wide as PDF with their captions in LaTeX
    figures: bool = False

    def write(self, folder: Path, comparisons: Sequence[Comparison], document: Document) -> list[Path]:
        """Write the files and return their paths; raises OutputError."""
        written = []
        if self.csv or (folder / "runs.csv").exists():
            tables = {"runs": make_runs_table(comparisons), **_make_point_tables(comparisons)}
            for name, rows in tables.items():
                written.append(write_text(folder / f"{name}.csv", format_csv(replace_nan(rows))))
        if self.figures:
            drawn = [part for part in iterate_leaves(document.parts) if isinstance(part, Figure)]
            written += [save_figure(figure.draw(), folder / f"{figure.name}.png") for figure in drawn]
        for comparison in comparisons:
            stem = folder / make_file_name(comparison.problem)
            if self.latex:
                written.append(write_text(stem.with_name(f"{stem.name}-table.tex"), format_latex_table(comparison)))
            if self.figures:
                written += _write_figures(stem, comparison)
        return written


def make_runs_table(comparisons: Sequence[Comparison]) -> TableRows:
    """Return all runs: ``HEADER``, dimension, budget, gap, equivalent evaluations, and costs to each target, empty if missed."""
    to_targets = [f"{axis}_to_{target:g}" for axis in COSTS for target in TARGETS]
    rows: list[Sequence[object]] = [(*HEADER, *MEASURED, *to_targets)]
    for comparison in comparisons:
        for solver in comparison.solvers:
            for record, curve, cost in zip(solver.records, solver.curves, solver.costs, strict=True):
                budget = record.inputs.stop.get("evaluations")
                measured = (len(record.x) or None, budget, comparison.gap(cost), curve.total_cost())
                reached = (curve.cost_to_reach(target, axis) for axis in COSTS for target in TARGETS)
                rows.append((*make_row(record), *measured, *reached))
    return replace_nan(rows)


def _make_point_tables(comparisons: Sequence[Comparison]) -> dict[str, TableRows]:
    """Return the final points of each problem with the judge's values, by the name of their file."""
    tables: dict[str, TableRows] = {}
    for comparison in comparisons:
        records = comparison.records
        names = list(dict.fromkeys(name for record in records for name in record.x))
        taken = {*names, *JUDGED}
        indexes = list(dict.fromkeys(name for r in records for name in r.verdict.indexes if name not in taken))
        tables[f"{make_file_name(comparison.problem)}-points"] = [
            ("solver", "run", *names, *JUDGED, *indexes),
            *(
                (r.solver, r.run, *map(r.x.get, names), *make_judged_cells(r), *map(r.verdict.indexes.get, indexes))
                for r in records
                if r.x
            ),
        ]
    return tables


def _write_figures(stem: Path, comparison: Comparison) -> list[Path]:
    """Write ``<problem>-<figure>.pdf`` for each figure, and ``<problem>-figures.tex`` with their captions."""
    written, text = [], ""
    with use_paper_style():
        for name, (compute, caption) in FIGURES.items():
            figure = f"{stem.name}-{name}"
            drawing = plot_charts(compute(comparison), column=True)
            written.append(save_figure(drawing, stem.with_name(f"{figure}.pdf")))
            words = f"{caption.removesuffix('.')}; {comparison.problem}, {describe_run_counts(comparison)}."
            text += (
                f"\\begin{{figure}}\n\\centering\n\\includegraphics{{{figure}.pdf}}\n"
                f"\\caption{{{escape_latex(words)}}}\n\\label{{fig:{figure}}}\n\\end{{figure}}\n"
            )
    return [*written, write_text(stem.with_name(f"{stem.name}-figures.tex"), text)]


LATEX_HEADER = ("solver", "feasible", "best", "median", "mean", "std.", "worst", "gap", "$p$")
SPECIAL = str.maketrans(
    {c: rf"\{c}" for c in "&%$#_{}"} | {"~": r"\textasciitilde{}", "^": r"\^{}", "\\": r"\textbackslash{}"}
)
UNKNOWN = "--"


def format_latex_table(comparison: Comparison) -> str:
    """Return the table of one problem: a row for each solver, the best median over all runs first."""
    p_values = {pair.second: pair.rank_sum for pair in comparison.pairs if pair.first == comparison.solvers[0].name}
    lines = [" & ".join(LATEX_HEADER) + r" \\"]
    for solver in comparison.solvers:
        values = sorted((comparison.value(cost) for cost in solver.feasible), reverse=comparison.objective.sign < 0)
        deviation = stdev(values) if len(values) > 1 else None
        numbers = (values[0], median(values), mean(values), deviation, values[-1]) if values else 5 * (None,)
        cells = [_format_number(number) for number in numbers]
        if solver.name in comparison.leaders and values:
            cells[1] = rf"\textbf{{{cells[1]}}}"
        p, gap = p_values.get(solver.name), escape_latex(comparison.format_gap(comparison.gap(solver.median_cost)))
        shown_p = UNKNOWN if p is None else "$<$0.001" if p < 0.001 else f"{p:.3f}"
        row = (escape_latex(solver.name), f"{len(values)}/{len(solver.records)}", *cells, gap, shown_p)
        lines.append(" & ".join(row) + r" \\")
    return "\n".join(
        [
            r"\begin{table}",
            r"\centering\small\setlength{\tabcolsep}{4pt}",
            rf"\caption{{{_write_caption(comparison)}}}",
            rf"\label{{tab:{make_file_name(comparison.problem)}}}",
            rf"\begin{{tabular}}{{l{'r' * (len(LATEX_HEADER) - 1)}}}",
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


def describe_run_counts(comparison: Comparison) -> str:
    """Return for example "n = 20 runs of each solver, at most 10,000 evaluations of a search"."""
    runs = sorted({len(solver.records) for solver in comparison.solvers})
    stops = [record.inputs.stop for record in comparison.records]
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
        f"{make_heading(objective.name, objective.unit)} on {comparison.problem}, to be {objective.sense}d: "
        f"{describe_run_counts(comparison)}",
        "Best to worst are over the feasible runs",
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
