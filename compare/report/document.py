"""Documents for studies, papers and questions: text, tables, figures, sections."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from compare.analysis.units import format_number
from compare.drawing.figures import Drawing, place_drawings, render_svg

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Plot

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
    """Drawings next to each other, or a figure of Matplotlib; the stem of its SVG file; its caption."""

    name: str
    caption: str
    drawing: Sequence[Drawing] | Plot | Callable[[], Sequence[Drawing] | Plot]  #: or the function that draws it
    gaits: Mapping[str, Any] | None = None  #: which a page plays in place of the first drawing

    @cached_property
    def drawn(self) -> Sequence[Drawing] | Plot:
        """The drawing."""
        return self.drawing() if callable(self.drawing) else self.drawing

    @cached_property
    def panels(self) -> list[str]:
        """SVG of each drawing, for a page."""
        if isinstance(self.drawn, Sequence):
            return [drawing.to_svg() for drawing in self.drawn]
        return [render_svg(self.drawn)]

    def render(self) -> str:
        """Return one SVG file."""
        several = isinstance(self.drawn, Sequence) and len(self.drawn) > 1
        return place_drawings(self.drawn).to_svg() if several else self.panels[0]  # type: ignore[arg-type]

    def plot(self) -> Plot:
        """Return a figure of Matplotlib."""
        return place_drawings(self.drawn).to_figure() if isinstance(self.drawn, Sequence) else self.drawn


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
    half: bool = False  #: two of them stand next to each other on a wide page


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
