"""What a report is made of, for studies, papers and questions alike: text, tables, figures and sections of them.

``compare.report.writing`` writes it: ``write_document`` a page as HTML and as Markdown with everything on it, ``write_parts``
tables and figures alone. ``compare.report.template`` makes a document from a text with places for them.
"""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from compare.analysis.units import number

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Drawing

Value = str | float | int | bool | None
"""Content of a cell; None where there is nothing to say."""


Rows = Sequence[Sequence[Value]]
"""One value for each column."""


@dataclass(frozen=True, kw_only=True)
class Cell:
    """Text of a cell, and the number by which its column is sorted; None sorts by the text."""

    text: str
    key: float | None = None


@dataclass(frozen=True, kw_only=True)
class Table:
    """A table of values with all their digits, and how people read them.

    Attributes:
        columns: heading, with its unit, to the format of its numbers on a page, such as ``".4f"``; an empty one shows all digits.
        rows: one value for each column.
        name: stem of its CSV file; empty for a table that stands on the page only.
        caption: what it shows.
        prose: the cells are sentences, so that all columns are set flush left, not only the first.
    """

    columns: Mapping[str, str]
    rows: Rows
    name: str = ""
    caption: str = ""
    prose: bool = False

    @property
    def cells(self) -> tuple[tuple[Cell, ...], ...]:
        """Rows as a page shows them."""
        return tuple(
            tuple(_cell(value, form) for value, form in zip(row, self.columns.values(), strict=True))
            for row in self.rows
        )

    @property
    def csv_rows(self) -> list[list[object]]:
        """Headings and rows with all digits, fit for ``csv_text``: truth values in lower case, nothing for None."""
        rows: list[list[object]] = [[str(v).lower() if isinstance(v, bool) else v for v in row] for row in self.rows]
        return [list(self.columns), *rows]


@dataclass(frozen=True, kw_only=True, eq=False)
class Figure:
    """A drawing, the stem of its PNG and SVG files, and what it shows."""

    name: str
    caption: str
    drawing: Drawing


@dataclass(frozen=True)
class Prose:
    """Markdown that the program itself writes. Words of users belong in plain strings and tables, which are shown literally."""

    markdown: str


@dataclass(frozen=True, kw_only=True, eq=False)
class Section:
    """A heading and what stands below it, in this order; a plain string is a paragraph."""

    title: str
    parts: Sequence[Part]


Part = str | Prose | Table | Figure | Section


@dataclass(frozen=True, kw_only=True, eq=False)
class Document:
    """A report.

    Attributes:
        title: of the page.
        verdict: the essence, in at most three sentences; may be empty.
        parts: the rest, in this order.
    """

    title: str
    verdict: Sequence[str] = ()
    parts: Sequence[Part]


def text_table(header: Sequence[str], rows: Sequence[Sequence[str]], caption: str = "", prose: bool = False) -> Table:
    """Table of texts, sorted by the number that a cell begins with."""
    return Table(columns=dict.fromkeys(header, ""), rows=rows, caption=caption, prose=prose)


def leaves(parts: Sequence[Part]) -> Iterator[str | Prose | Table | Figure]:
    """Everything but sections, in the order of the page."""
    for part in parts:
        if isinstance(part, Section):
            yield from leaves(part.parts)
        else:
            yield part


def _cell(value: Value, form: str) -> Cell:
    if value is None:
        return Cell(text="-", key=math.inf)
    if isinstance(value, str):
        return Cell(text=value, key=_leading_number(value))
    if isinstance(value, bool):
        return Cell(text="yes" if value else "no")
    return Cell(text=number(value, form), key=value if math.isfinite(value) else math.inf)


def _leading_number(text: str) -> float | None:
    """For example 10000 of "10 000 calls", with a thin space; infinity for a dash, so that what is missing comes last."""
    if text == "-":
        return math.inf
    first = text.replace("\u202f", "").split(" ")[0].split("/")[0]
    try:
        number = float(first.removeprefix("<"))
    except ValueError:
        return None
    return number if math.isfinite(number) else None
