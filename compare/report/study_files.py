"""Files of a study for other programs and papers: CSV, Parquet, LaTeX tables, figures as PDF."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from compare.analysis.comparison import Comparison
from compare.analysis.record_statistics import TARGETS
from compare.drawing import PAPER_STYLE
from compare.drawing.comparison_figures import plot_convergence, plot_ecdf, plot_final_gaps
from compare.drawing.figures import add_styles, check_style, save_pdf
from compare.report.latex_table import describe_runs, escape_latex, format_latex_table
from compare.study.record import HEADER, JUDGED, make_judged_cells, make_row
from nlp_gait.errors import MissingExtraError
from nlp_gait.files import format_csv, make_file_name, replace_file, replace_nan, write_text

Table = Sequence[Sequence[object]]
"""Header and rows; None for an unknown value."""

MEASURED = ("n", "budget", "gap", "equivalent_evaluations")
COSTS = ("evaluations", "seconds")
FIGURES = {
    "convergence": (
        plot_convergence,
        "Gap to the best known value over equivalent evaluations, median and range of the runs",
    ),
    "runtime": (
        plot_ecdf,
        "Share of pairs of run and target solved, 31 targets from 100 % to 1e-4 % above the best known value",
    ),
    "final": (plot_final_gaps, "Gap of every run at its end; bars: medians"),
}


@dataclass(frozen=True, kw_only=True)
class FurtherFiles:
    """Which files to write beside a study's report."""

    csv: bool = False  #: all runs, and the points of each problem; written again, too, where they exist already
    parquet: bool = False  #: the same table of runs
    latex: bool = False  #: a table of each problem
    pdf: bool = False  #: figures of each problem one column wide, and their captions in LaTeX
    style: Path | None = None  #: matplotlib style file of the PDF figures, on top of ``paper.mplstyle``

    def write(self, folder: Path, comparisons: Sequence[Comparison]) -> list[Path]:
        """Write the files and return their paths.

        Raises:
            InputError: Matplotlib cannot read the style file.
            MissingExtraError: pyarrow is not installed.
            OutputError: a file cannot be written.
        """
        if self.style is not None:
            check_style(self.style)
        written = []
        if self.csv or (folder / "runs.csv").exists():
            written += _write_csv(folder, {"runs": make_runs_table(comparisons), **_make_point_tables(comparisons)})
        if self.parquet:
            written.append(_write_parquet(folder / "runs.parquet", make_runs_table(comparisons)))
        for comparison in comparisons:
            stem = folder / make_file_name(comparison.problem)
            if self.latex:
                written.append(write_text(stem.with_name(f"{stem.name}-table.tex"), format_latex_table(comparison)))
            if self.pdf:
                written += _write_figures(stem, comparison, self.style)
        return written


def make_runs_table(comparisons: Sequence[Comparison]) -> Table:
    """Return all runs: ``HEADER``, dimension, budget, gap, equivalent evaluations, and costs to each target, empty if missed."""
    to_targets = [f"{axis}_to_{target:g}" for axis in COSTS for target in TARGETS]
    rows: list[Sequence[object]] = [(*HEADER, *MEASURED, *to_targets)]
    for comparison in comparisons:
        for solver in comparison.solvers:
            for record, curve, cost in zip(solver.records, solver.curves, solver.costs, strict=True):
                budget = (record.definition.get("stop") or {}).get("evaluations")
                measured = (len(record.x) or None, budget, comparison.gap(cost), curve.total_cost())
                reached = (curve.cost_to_reach(target, axis) for axis in COSTS for target in TARGETS)
                rows.append((*make_row(record), *measured, *reached))
    return replace_nan(rows)


def _make_point_tables(comparisons: Sequence[Comparison]) -> dict[str, Table]:
    """Return the final points of each problem with the judge's values, by the name of their file."""
    tables: dict[str, Table] = {}
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


def _write_csv(folder: Path, tables: Mapping[str, Table]) -> list[Path]:
    return [write_text(folder / f"{name}.csv", format_csv(replace_nan(rows))) for name, rows in tables.items()]


def _write_parquet(path: Path, table: Table) -> Path:
    try:
        import pyarrow
        from pyarrow.parquet import write_table
    except ImportError as error:
        raise MissingExtraError(f"--parquet needs pyarrow ({error}): pip install 'nlp-gait[parquet]'") from error
    header, *rows = table
    columns = {str(name): pyarrow.array(column) for name, column in zip(header, zip(*rows, strict=True), strict=True)}
    with replace_file(path) as file:
        write_table(pyarrow.table(columns), file)
    return path


def _write_figures(stem: Path, comparison: Comparison, style: Path | None) -> list[Path]:
    """Write ``<problem>-<figure>.pdf`` for each figure, and ``<problem>-figures.tex`` with their captions."""
    written, text = [], ""
    with add_styles(PAPER_STYLE, *(() if style is None else (style,))):
        for name, (plot, words) in FIGURES.items():
            figure = f"{stem.name}-{name}"
            written.append(save_pdf(plot(comparison, column=True), stem.with_name(f"{figure}.pdf")))
            caption = escape_latex(f"{words}; {comparison.problem}, {describe_runs(comparison)}.")
            text += (
                f"\\begin{{figure}}\n\\centering\n\\includegraphics{{{figure}.pdf}}\n"
                f"\\caption{{{caption}}}\n\\label{{fig:{figure}}}\n\\end{{figure}}\n"
            )
    return [*written, write_text(stem.with_name(f"{stem.name}-figures.tex"), text)]
