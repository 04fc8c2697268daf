"""Tables of a reproduction: each as Markdown for the report and as CSV for other programs."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

from compare.analysis.table import markdown
from nlp_gait.files import csv_text, write_text

Cell = str | float | int


def write_table(stem: Path, columns: Mapping[str, str], rows: Sequence[Sequence[Cell]]) -> str:
    """Write ``<stem>.md`` and ``<stem>.csv``, the latter with all digits; returns the Markdown.

    Args:
        stem: path without suffix.
        columns: header, with its unit, to the format of its numbers in Markdown, for example ``".4f"``.
        rows: numbers and text; text is shown as it is.

    Raises:
        OutputError: the files cannot be written.
    """
    shown = [
        [
            cell if isinstance(cell, str) else format(cell, form)
            for cell, form in zip(row, columns.values(), strict=True)
        ]
        for row in rows
    ]
    text = markdown(list(columns), shown)
    write_text(stem.with_name(f"{stem.name}.md"), text)
    write_csv(stem.with_name(f"{stem.name}.csv"), list(columns), rows)
    return text


def write_csv(path: Path, header: Sequence[str], rows: Sequence[Sequence[Cell]]) -> None:
    """Write rows of numbers and text with all digits."""
    write_text(path, csv_text([header, *rows]))
