"""Documents from a Markdown text with fields for numbers, tables and figures."""

from __future__ import annotations

import re
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from compare.report.document import Document, Figure, Part, Prose, Rows, Section, Table

if TYPE_CHECKING:
    from matplotlib.figure import Figure as Drawing

HEADING = re.compile(r"(#+) (.+)")
TABLE = re.compile(r"\{([\w-]+)\}\n\|(.+)\|\n\|(.+)\|")
WHOLE_TABLE = re.compile(r"\{([\w-]+)\}")
FIGURE = re.compile(r"!\[(.*)\]\((.+)\.png\)", re.DOTALL)


def fill_template(
    text: str,
    *,
    values: Mapping[str, Any],
    tables: Mapping[str, Rows],
    figures: Mapping[str, Drawing],
    whole_tables: Sequence[Table] = (),
) -> Document:
    """Return the document of a text.

    Blocks of the text are separated by empty lines. A block is the title after ``#``, a heading after ``##`` or ``###``, a table,
    or ``![what it shows](name.png)`` for the drawing of that name. Anything else is a paragraph, a list or a table in Markdown,
    in which ``{name:.3f}`` is a value as ``str.format`` writes it. A table has three lines, the last one with the formats of the
    columns; ``:--`` in all of them makes it a table of sentences::

        {name}
        | solver | power [W] |
        | | .3f |

    ``{name}`` alone is one of the whole tables, which have their own headings.

    Raises:
        KeyError: the text names a value, table or drawing that is missing.
    """
    title, *blocks = re.split(r"\n{2,}", text.strip())
    open_sections: list[tuple[str, list[Part]]] = [(title.removeprefix("# "), [])]

    whole = {table.name: table for table in whole_tables}

    def close(level: int) -> None:
        while len(open_sections) > level:
            name, parts = open_sections.pop()
            open_sections[-1][1].append(Section(title=name, parts=parts))

    for block in blocks:
        parts = open_sections[-1][1]
        if heading := HEADING.fullmatch(block):
            close(len(heading[1]) - 1)
            open_sections.append((heading[2].format_map(values), []))
        elif table := TABLE.fullmatch(block):
            parts.append(_table(tables[table[1]], table[1], *(line.format_map(values) for line in table.groups()[1:])))
        elif (place := WHOLE_TABLE.fullmatch(block)) and place[1] in whole:
            parts.append(whole[place[1]])
        elif figure := FIGURE.fullmatch(block):
            parts.append(Figure(name=figure[2], caption=figure[1].format_map(values), drawing=figures[figure[2]]))
        else:
            parts.append(Prose(block.format_map(values)))
    close(1)
    return Document(title=open_sections[0][0], parts=open_sections[0][1])


def _table(rows: Rows, name: str, header: str, formats: str) -> Table:
    headings, forms = ([cell.strip() for cell in line.split("|")] for line in (header, formats))
    prose = set(forms) == {":--"}
    columns = {heading: "" if prose else form for heading, form in zip(headings, forms, strict=True)}
    return Table(name=name, columns=columns, rows=rows, prose=prose)
