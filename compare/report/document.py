"""What a report is made of: sections with text, tables and figures, the same for HTML and Markdown."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Drawing


@dataclass(frozen=True, kw_only=True)
class Cell:
    """Text of a table, and the number by which its column is sorted; None sorts by the text."""

    text: str
    key: float | None = None


@dataclass(frozen=True, kw_only=True)
class Table:
    """A table; its first column is text, the others are set flush right unless ``prose``."""

    header: tuple[str, ...]
    rows: tuple[tuple[Cell, ...], ...]
    caption: str = ""
    prose: bool = False


@dataclass(frozen=True, kw_only=True, eq=False)
class Figure:
    """A drawing, the stem of its file, and what it shows."""

    name: str
    caption: str
    drawing: Drawing


@dataclass(frozen=True, kw_only=True, eq=False)
class Section:
    """A section; its parts appear in this order: text, tables, figures, items.

    Attributes:
        title: heading.
        text: paragraphs.
        tables: any number.
        figures: any number.
        items: of a list.
        sections: below it.
    """

    title: str
    text: tuple[str, ...] = ()
    tables: tuple[Table, ...] = ()
    figures: tuple[Figure, ...] = ()
    items: tuple[str, ...] = ()
    sections: tuple[Section, ...] = field(default=())


@dataclass(frozen=True, kw_only=True, eq=False)
class Document:
    """A report.

    Attributes:
        title: of the page.
        verdict: in three sentences.
        sections: the rest.
    """

    title: str
    verdict: tuple[str, ...]
    sections: tuple[Section, ...]


def table(header: Sequence[str], rows: Sequence[Sequence[str]], caption: str = "", prose: bool = False) -> Table:
    """Table of texts, sorted by the number that a cell begins with."""
    cells = tuple(tuple(Cell(text=text, key=_leading_number(text)) for text in row) for row in rows)
    return Table(header=tuple(header), rows=cells, caption=caption, prose=prose)


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
