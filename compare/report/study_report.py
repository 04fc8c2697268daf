"""Report of a study from its records."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from compare.analysis.comparison import DEFAULT_WEIGHTING, Comparison, compare_problems, label_editions
from compare.analysis.simulated_gaits import select_best_gaits
from compare.analysis.statistics.run_length import Weighting
from compare.analysis.verdict import write_verdict
from compare.drawing.distributions import list_expected_costs, plot_performance_profile
from compare.report.document import Document, Figure, Section
from compare.report.method_section import method_section
from compare.report.problem_section import HOW, problem_section
from compare.report.writing import write_document
from compare.study.manifest import Manifest, read_manifest
from compare.study.record import HEADER, JUDGED, RunRecord, make_judged_cells, make_row
from compare.study.record_files import read_records
from compare.study.simulations import SimulatedGait, load_simulations
from nlp_gait.files import format_csv, make_file_name, replace_nan, write_text


def rebuild_report(folder: Path, weighting: Weighting = DEFAULT_WEIGHTING, *, as_csv: bool = False) -> list[Path]:
    """Rewrite the report of all records of a folder, earlier definitions included, and return the paths of its files.

    Raises:
        InputError: no records there, or a damaged one.
        OutputError: the files cannot be written.
    """
    return write_report(folder, label_editions(read_records(folder)), read_manifest(folder), weighting, as_csv=as_csv)


def write_report(
    folder: Path,
    records: Sequence[RunRecord],
    manifest: Manifest,
    weighting: Weighting = DEFAULT_WEIGHTING,
    *,
    as_csv: bool = False,
) -> list[Path]:
    """Write the report with stored simulations, the figures as PNG and SVG, and optionally CSV files; return all paths."""
    plays = load_simulations(folder, select_best_gaits(records))
    written = write_document(folder, make_study_document(records, manifest, weighting, plays))
    if as_csv:
        written += _write_csv_files(folder, records)
    return written


def make_study_document(
    records: Sequence[RunRecord],
    manifest: Manifest,
    weighting: Weighting = DEFAULT_WEIGHTING,
    plays: Sequence[SimulatedGait] = (),
) -> Document:
    """Return the document of a study's records and of their best gaits simulated in the engine."""
    comparisons = compare_problems(records, weighting)
    sections = [problem_section(c, [play for play in plays if play.problem == c.problem]) for c in comparisons]
    if len(comparisons) > 1 and list_expected_costs(comparisons):
        sections.append(_over_problems(comparisons))
    return Document(
        title="Comparison of solvers on " + ", ".join(c.problem for c in comparisons),
        verdict=write_verdict(comparisons),
        parts=(*sections, *(() if plays else (HOW,)), method_section(comparisons, manifest, weighting)),
    )


def _over_problems(comparisons: Sequence[Comparison]) -> Section:
    figure = Figure(
        name="performance-profile",
        caption="Share of problems and targets that a solver reaches within a factor of the cheapest one's expected evaluations.",
        drawing=plot_performance_profile(comparisons),
    )
    return Section(title="Over all problems", parts=(figure,))


def _write_csv_files(folder: Path, records: Sequence[RunRecord]) -> list[Path]:
    """Write ``runs.csv``, and ``<problem>-points.csv`` for each problem; unknown values are empty cells."""
    tables: dict[str, list[Sequence[object]]] = {"runs": [HEADER, *map(make_row, records)]}
    for problem in dict.fromkeys(record.problem for record in records):
        own = [record for record in records if record.problem == problem]
        names = list(dict.fromkeys(name for record in own for name in record.x))
        taken = {*names, *JUDGED}
        indexes = list(dict.fromkeys(name for record in own for name in record.verdict.indexes if name not in taken))
        rows = tables[f"{make_file_name(problem)}-points"] = [("solver", "run", *names, *JUDGED, *indexes)]
        for r in own:
            if r.x:
                values = (*map(r.x.get, names), *make_judged_cells(r), *map(r.verdict.indexes.get, indexes))
                rows.append((r.solver, r.run, *values))
    for name, rows in tables.items():
        write_text(folder / f"{name}.csv", format_csv(replace_nan(rows)))  # None is an empty cell
    return [folder / f"{name}.csv" for name in tables]
