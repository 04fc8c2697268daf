"""Files of a study for other programs and papers: CSV, LaTeX tables with booktabs, figures as PDF."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

from compare.analysis.comparison import Comparison
from compare.analysis.record_statistics import TARGETS
from compare.drawing.figures import save_figure
from compare.report.document import Document, Figure, iterate_leaves
from compare.report.latex import describe_run_counts, escape_latex, format_latex_overview, format_latex_table
from compare.study.record import COLUMNS, JUDGED, list_variables, make_row
from nlp_gait.files import format_csv, make_file_name, replace_nan, write_text

TableRows = Sequence[Sequence[object]]
"""Header and rows; None for an unknown value."""

MEASURED = ("n", "budget", "gap", "equivalent_evaluations")
COSTS = ("evaluations", "seconds")
# What the figures show that have no caption on the page, where a sentence and a legend are next to them.
CAPTIONS = {"final": "Final gap of each run; bar: median", "gaits": "Best gait from the side, later poses darker"}


@dataclass(frozen=True, kw_only=True)
class FurtherFiles:
    """Which files to write beside a study's report."""

    csv: bool = False  #: all runs, and the points of each problem; written again, too, where they exist already
    latex: bool = False  #: a table of each problem, and one of several problems and all solvers
    figures: bool = False  #: all figures of the report as PNG and as PDF, with their captions in LaTeX

    def write(self, folder: Path, comparisons: Sequence[Comparison], document: Document) -> list[Path]:
        """Write the files and return their paths; raises OutputError."""
        written = []
        if self.csv or (folder / "runs.csv").exists():
            tables = {"runs": make_runs_table(comparisons), **_make_point_tables(comparisons)}
            for name, rows in tables.items():
                written.append(write_text(folder / f"{name}.csv", format_csv(replace_nan(rows))))
        if self.figures:
            figures = [part for part in iterate_leaves(document.parts) if isinstance(part, Figure)]
            plots = [(figure.name, figure.plot()) for figure in figures]
            written += [save_figure(plot, folder / f"{name}.{kind}") for name, plot in plots for kind in ("png", "pdf")]
            written.append(write_text(folder / "figures.tex", _write_captions(figures, comparisons)))
        if self.latex:
            latex = {make_file_name(c.problem): format_latex_table(c) for c in comparisons}
            latex |= {"problems": format_latex_overview(comparisons)} if len(comparisons) > 1 else {}
            written += [write_text(folder / f"{name}-table.tex", table) for name, table in latex.items()]
        return written


def make_runs_table(comparisons: Sequence[Comparison]) -> TableRows:
    """Return all runs: ``COLUMNS``, dimension, budget, gap, equivalent evaluations, and costs to each target, empty if missed."""
    to_targets = [f"{axis}_to_{target:g}" for axis in COSTS for target in TARGETS]
    rows: list[Sequence[object]] = [(*COLUMNS, *MEASURED, *to_targets)]
    for comparison in comparisons:
        for solver in comparison.solvers:
            for record, curve, cost in zip(solver.records, solver.curves, solver.costs, strict=True):
                budget = record.inputs.evaluations
                measured = (len(record.x) or None, budget, comparison.gap(cost), curve.total_cost())
                reached = (curve.cost_to_reach(target, axis) for axis in COSTS for target in TARGETS)
                rows.append((*make_row(record), *measured, *reached))
    return replace_nan(rows)


def _make_point_tables(comparisons: Sequence[Comparison]) -> dict[str, TableRows]:
    """Return the final points of each problem with the judge's values, by the name of their file."""
    tables: dict[str, TableRows] = {}
    for comparison in comparisons:
        records = comparison.records
        names = list_variables(records)
        taken = {*names, *JUDGED}
        indexes = list(dict.fromkeys(name for r in records for name in r.metrics if name not in taken))
        tables[f"{make_file_name(comparison.problem)}-points"] = [
            ("solver", "run", *names, *JUDGED, *indexes),
            *(
                (r.solver, r.run, *map(r.x.get, names), *make_row(r, JUDGED), *map(r.metrics.get, indexes))
                for r in records
                if r.x
            ),
        ]
    return tables


def _write_captions(figures: Sequence[Figure], comparisons: Sequence[Comparison]) -> str:
    """Return all figures in LaTeX, each with what it shows."""
    text = ""
    for figure in figures:
        comparison = next((c for c in comparisons if figure.name.startswith(f"{make_file_name(c.problem)}-")), None)
        words = figure.caption.removesuffix(".") or CAPTIONS.get(figure.name.rpartition("-")[2], figure.name)
        if comparison is not None:
            words += f"; {comparison.problem}, {describe_run_counts(comparison)}"
        text += (
            f"\\begin{{figure}}\n\\centering\n\\includegraphics[width=\\linewidth]{{{figure.name}.pdf}}\n"
            f"\\caption{{{escape_latex(words)}.}}\n\\label{{fig:{figure.name}}}\n\\end{{figure}}\n"
        )
    return text
