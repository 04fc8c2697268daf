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
from compare.report.writing import write_csv_files, write_document
from compare.study.manifest import Manifest, read_manifest
from compare.study.record import RunRecord
from compare.study.record_files import read_records
from compare.study.simulations import SimulatedGait, load_simulations
from nlp_gait.files import make_file_name


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
    """Write ``report.html``, ``report.md``, the figures as PNG and SVG, and optionally CSV files; return all paths.

    Simulations stored in the folder are included.
    """
    plays = load_simulations(folder, select_best_gaits(records))
    written = write_document(folder, make_study_document(records, manifest, weighting, plays))
    if as_csv:
        written += write_csv_files(
            folder, records, {record.problem: make_file_name(record.problem) for record in records}
        )
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
