"""Documents written as a self-contained HTML page and as Markdown, with figures and tables, and versions at the end."""

import re
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import TypeVar

from jinja2 import Environment, PackageLoader, StrictUndefined
from markdown_it import MarkdownIt
from markupsafe import Markup

from compare.drawing.figures import inline_svg
from compare.report.document import Document, Figure, Part, Section, Table, iterate_leaves, make_text_table
from compare.report.provenance import explain
from compare.study.record import format_now, list_versions
from nlp_gait.files import format_csv, write_text

MARKDOWN = MarkdownIt("commonmark", {"html": False}).enable("table")
MARKDOWN_SPECIAL = re.compile(r"([\\`*_{}\[\]#|~])")


def write_document(folder: Path, document: Document, page: str = "report") -> list[Path]:
    """Write ``<page>.html``, ``<page>.md`` and what ``write_parts`` writes; return the paths. Raises OutputError."""
    pages = {"html": render_page(document), "md": render_markdown(document)}
    written = [write_text(folder / f"{page}.{suffix}", text) for suffix, text in pages.items()]
    return [*written, *write_parts(folder, document.parts)]


def write_parts(folder: Path, parts: Sequence[Part]) -> list[Path]:
    """Write each table that has a name as ``<name>.csv`` and each figure as ``<name>.svg``; returns the paths."""
    files: list[Path] = []
    for part in iterate_leaves(parts):
        if isinstance(part, Figure):
            files.append(write_text(folder / f"{part.name}.svg", part.render()))
        elif isinstance(part, Table) and part.name:
            files.append(write_text(folder / f"{part.name}.csv", format_csv(part.csv_rows)))
    return files


def render_page(document: Document) -> str:
    """Return one page without any other file, with the figures as SVG; all text in it is escaped."""
    figures = [part for part in iterate_leaves(document.parts) if isinstance(part, Figure)]
    svg = {
        figure.name: [Markup(inline_svg(panel, f"f{i}-{k}", f"figure {i}")) for k, panel in enumerate(figure.panels)]
        for i, figure in enumerate(figures, start=1)
    }
    return _load_templates(page=True).get_template("report.html.j2").render(document=document, svg=svg)


def render_markdown(document: Document) -> str:
    """Return Markdown that shows the figures' SVG files."""
    text = _load_templates(page=False).get_template("report.md.j2").render(document=document)
    return re.sub(r"\n{3,}", "\n\n", text).strip() + "\n"


@cache
def _load_templates(*, page: bool) -> Environment:
    """Return the templates of HTML or Markdown, which are compiled once."""
    environment = Environment(
        loader=PackageLoader("compare.report"),
        autoescape=page,
        undefined=StrictUndefined,
        trim_blocks=not page,
        lstrip_blocks=not page,
    )
    filters = {"kind": _name_kind, "html": _render_html, "anchor": make_anchor, "md": escape_markdown}
    environment.filters |= filters | {"explain": explain}
    return environment


def _name_kind(part: Part) -> str:
    return type(part).__name__


def make_anchor(title: str) -> str:
    """Id of a section within the page, unlike the ids within figures."""
    return "section-" + re.sub(r"\W+", "-", title).strip("-").lower()


def _render_html(markdown: str) -> Markup:
    """HTML of a text in Markdown; HTML in it is shown, not obeyed."""
    return Markup(MARKDOWN.render(markdown))


def escape_markdown(text: str) -> str:
    """Text as Markdown shows it literally, on one line."""
    escaped = MARKDOWN_SPECIAL.sub(r"\\\1", " ".join(text.split()))
    return escaped.replace("&", "&amp;").replace("<", "&lt;").replace(">", "&gt;")


D = TypeVar("D", bound=Document)


def make_version_table(command: str, date: str, versions: Iterable[Mapping[str, str]]) -> Table:
    """Return the command, its date, and the versions of packages, compiler, processor and system, those that differ together."""
    together: dict[str, list[str]] = {}
    for name, version in dict.fromkeys(item for each in versions for item in each.items()):
        together.setdefault(name, []).append(version)
    rows = [("command", command), ("date", date), *((name, "; ".join(texts)) for name, texts in together.items())]
    return make_text_table(("what", "value"), rows, prose=True)


def make_own_version_table(command: str) -> Table:
    """Return the same of this process, now."""
    return make_version_table(command, format_now(), [list_versions()])


def add_origin(document: D, command: str) -> D:
    """Return a document with this command, machine and versions at its end."""
    ending = Section(title="Versions", parts=(make_own_version_table(command),))
    return replace(document, parts=(*document.parts, ending))
