"""Documents for studies, papers and questions: text, tables, figures, sections."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from compare.analysis.units import format_number

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Plot

    from compare.drawing.shapes import Drawing

Value = str | float | int | bool | None
"""Content of a cell; None for an empty one."""

Rows = Sequence[Sequence[Value]]
"""One value for each column."""


@dataclass(frozen=True, kw_only=True)
class Table:
    """Table of values with all digits, and their format on a page."""

    #: heading, with its unit, to the format of its numbers on a page, such as ``".4f"``; an empty one shows all digits
    columns: Mapping[str, str]
    rows: Rows  #: one value for each column
    name: str = ""  #: stem of its CSV file; empty for a table without a CSV file
    caption: str = ""  #: description
    prose: bool = False  #: the cells are sentences: all columns are left-aligned

    @property
    def cells(self) -> list[list[str]]:
        """Rows as shown on a page."""
        forms = self.columns.values()
        return [[_format_cell(value, form) for value, form in zip(row, forms, strict=True)] for row in self.rows]

    @property
    def csv_rows(self) -> list[list[object]]:
        """Headings and rows with all digits for ``format_csv``: booleans in lower case, empty cells for None."""
        rows: list[list[object]] = [[str(v).lower() if isinstance(v, bool) else v for v in row] for row in self.rows]
        return [list(self.columns), *rows]


@dataclass(frozen=True, kw_only=True, eq=False)
class Figure:
    """A drawing of shapes or of Matplotlib, the stem of its SVG file, and its caption."""

    name: str
    caption: str
    drawing: Drawing | Plot | Callable[[], Drawing | Plot]  #: or the function that draws it
    #: From which the page draws an interactive figure, if its scripts have an entry for ``kind``; else the drawing stays
    data: Mapping[str, Any] | None = None

    def draw(self) -> Drawing | Plot:
        """Return the drawing."""
        return self.drawing() if callable(self.drawing) else self.drawing


@dataclass(frozen=True)
class Prose:
    """Markdown written by the program. Text of users belongs in plain strings and tables, which are shown literally."""

    markdown: str


@dataclass(frozen=True, kw_only=True, eq=False)
class Section:
    """A heading and its parts in order; a plain string is a paragraph."""

    title: str
    parts: Sequence[Part]
    folded: bool = False  #: the page shows the heading, which opens the parts


Part = str | Prose | Table | Figure | Section


@dataclass(frozen=True, kw_only=True, eq=False)
class Document:
    """A report."""

    title: str  #: of the page
    headline: Sequence[str] = ()  #: the answer, before anything else
    parts: Sequence[Part]  #: the rest, in order

    @property
    def sections(self) -> list[Section]:
        """Sections of the first level that are open."""
        return [part for part in self.parts if isinstance(part, Section) and not part.folded]


def make_text_table(
    header: Sequence[str], rows: Sequence[Sequence[str]], caption: str = "", prose: bool = False
) -> Table:
    """Return a table of texts, sortable by the number at the beginning of a cell."""
    return Table(columns=dict.fromkeys(header, ""), rows=rows, caption=caption, prose=prose)


def make_table_section(
    title: str, header: Sequence[str], rows: Sequence[Sequence[str]], *words: str, prose: bool = False
) -> tuple[Section, ...]:
    """Return a section of sentences and a table of texts; none without rows."""
    return (Section(title=title, parts=(*words, make_text_table(header, rows, prose=prose))),) if rows else ()


def iterate_leaves(parts: Sequence[Part]) -> Iterator[str | Prose | Table | Figure]:
    """Yield all parts except sections, in the order of the page."""
    for part in parts:
        if isinstance(part, Section):
            yield from iterate_leaves(part.parts)
        else:
            yield part


def _format_cell(value: Value, form: str) -> str:
    if value is None:
        return "-"
    if isinstance(value, str):
        return value
    if isinstance(value, bool):
        return "yes" if value else "no"
    return format_number(value, form)
