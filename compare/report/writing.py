"""Documents written as a self-contained HTML page and as Markdown with figures beside it."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path

from jinja2 import Environment, PackageLoader, StrictUndefined
from markupsafe import Markup

from compare.analysis.comparison import DEFAULT_WEIGHTING, Comparison, compare_problems
from compare.analysis.statistics.run_length import Weighting
from compare.analysis.verdict import verdict
from compare.drawing.distributions import expected_costs, profile_figure
from compare.drawing.figures import inline_svg, save
from compare.report.document import Document, Figure, Section
from compare.report.method_section import method_section
from compare.report.problem_section import problem_section
from compare.study.manifest import Manifest, read_manifest
from compare.study.record import RunRecord
from compare.study.study import read_records
from nlp_gait.files import write_text

MARKDOWN_SPECIAL = re.compile(r"([\\`*_{}\[\]#|~])")


def rebuild_report(folder: Path, weighting: Weighting = DEFAULT_WEIGHTING) -> list[Path]:
    """Write the report of a folder of records anew; returns the paths of its files.

    Raises:
        InputError: no records there, or a damaged one.
        OutputError: the files cannot be written.
    """
    return write_report(folder, read_records(folder), read_manifest(folder), weighting)


def write_report(
    folder: Path, records: Sequence[RunRecord], manifest: Manifest, weighting: Weighting = DEFAULT_WEIGHTING
) -> list[Path]:
    """Write ``report.html``, ``report.md`` and the figures as PNG and SVG; returns the paths of all files."""
    document = document_of(records, manifest, weighting)
    files = [save(figure.drawing, folder / figure.name) for figure in _figures(document.sections)]
    pages = [folder / "report.html", folder / "report.md"]
    write_text(pages[0], html(document, [svg.read_text(encoding="utf-8") for _, svg in files]))
    write_text(pages[1], markdown_page(document))
    return [*pages, *(path for pair in files for path in pair)]


def document_of(records: Sequence[RunRecord], manifest: Manifest, weighting: Weighting = DEFAULT_WEIGHTING) -> Document:
    """Document of a study's records."""
    comparisons = compare_problems(records, weighting)
    sections = [problem_section(comparison) for comparison in comparisons]
    if len(comparisons) > 1 and expected_costs(comparisons):
        sections.append(_over_problems(comparisons))
    return Document(
        title="Comparison of solvers on " + ", ".join(c.problem for c in comparisons),
        verdict=verdict(comparisons),
        sections=(*sections, method_section(comparisons, manifest, weighting)),
    )


def _over_problems(comparisons: Sequence[Comparison]) -> Section:
    figure = Figure(
        name="performance-profile",
        caption="Share of problems and targets that a solver reaches within a factor of the cheapest one's expected evaluations.",
        drawing=profile_figure(comparisons),
    )
    return Section(title="Over all problems", figures=(figure,))


def html(document: Document, drawings: Sequence[str]) -> str:
    """One page without any other file; all text in it is escaped.

    Args:
        document: what to show.
        drawings: its figures as SVG files, in their order.
    """
    environment = Environment(loader=PackageLoader("compare.report"), autoescape=True, undefined=StrictUndefined)
    svg = {
        figure.name: Markup(inline_svg(drawing, f"f{i}", f"figure {i}"))
        for i, (figure, drawing) in enumerate(zip(_figures(document.sections), drawings, strict=True), start=1)
    }
    return environment.get_template("report.html.j2").render(document=document, svg=svg)


def markdown_page(document: Document) -> str:
    """Markdown with the figures' PNG files beside it."""
    environment = Environment(
        loader=PackageLoader("compare.report"),
        autoescape=False,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    environment.filters["md"] = _literal
    text = environment.get_template("report.md.j2").render(document=document)
    return re.sub(r"\n{3,}", "\n\n", text).strip() + "\n"


def _literal(text: str) -> str:
    """Text as Markdown shows it literally, on one line."""
    escaped = MARKDOWN_SPECIAL.sub(r"\\\1", " ".join(text.split()))
    return escaped.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")


def _figures(sections: Sequence[Section]) -> list[Figure]:
    return [figure for section in sections for figure in (*section.figures, *_figures(section.sections))]
